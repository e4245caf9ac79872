#include "core/training/poisson_layer.h"

#include <torch/csrc/autograd/custom_function.h>
#include <torch/custom_class.h>

#include "core/training/tensors.h"

namespace shaped {
namespace {

/// Carries the equation from the forward to the backward pass.
struct PoissonHandle : torch::CustomClassHolder {
  explicit PoissonHandle(std::shared_ptr<const JacobianPoisson> held) : poisson(std::move(held)) {}
  std::shared_ptr<const JacobianPoisson> poisson;
};

struct PoissonLayer : torch::autograd::Function<PoissonLayer> {
  static torch::Tensor forward(torch::autograd::AutogradContext* context, const torch::Tensor& jacobians,
                               const std::shared_ptr<const JacobianPoisson>& poisson, const Vertices& centroids) {
    context->saved_data["poisson"] = c10::IValue::make_capsule(c10::make_intrusive<PoissonHandle>(poisson));
    return tensorOf(poisson->solve(matrixOf<Jacobians>(jacobians), centroids), jacobians.scalar_type());
  }

  static torch::autograd::variable_list backward(torch::autograd::AutogradContext* context,
                                                 const torch::autograd::variable_list& gradients) {
    const auto capsule = context->saved_data["poisson"].toCapsule();
    const auto& poisson = *static_cast<const PoissonHandle&>(*capsule).poisson;
    const auto& gradient = gradients.front();
    return {tensorOf(poisson.backward(matrixOf<Vertices>(gradient)), gradient.scalar_type()), torch::Tensor(),
            torch::Tensor()};
  }
};

}  // namespace

torch::Tensor poissonSolution(const torch::Tensor& jacobians, const std::shared_ptr<const JacobianPoisson>& poisson,
                              const Vertices& centroids) {
  return PoissonLayer::apply(jacobians, poisson, centroids);
}

}  // namespace shaped
