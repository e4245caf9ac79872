#include "core/training/field_network.h"

#include <torch/csrc/autograd/autograd.h>

#include <catch2/catch.hpp>
#include <functional>
#include <random>

#include "core/training/field_loss.h"
#include "core/training/poisson_layer.h"
#include "core/training/tensors.h"
#include "tests/support/shapes.h"

using namespace shaped;
using namespace shaped::test;

namespace {

const auto kDouble = torch::kFloat64;

struct Example {
  Mesh mesh = tube(9, 7);
  std::shared_ptr<const FieldReference> reference =
      std::make_shared<const FieldReference>(*makeFieldReference(mesh.topology, mesh.vertices));
  FieldScaling scaling = scalingOf(*reference);
  Vertices source = jitter(bend(mesh.vertices, 0.2), 0.02, 1), target = jitter(bend(mesh.vertices, 0.5), 0.02, 2);
  FieldPair pair =
      makeFieldPair(reference, source, target, {jitter(target, 0.01, 3), jitter(target, 1, 4), {}}, scaling);

  /// Every layer random, the last too.
  JacobianFieldWeights weights(const FieldArchitecture& architecture) const {
    auto made = untrainedField(scaling, architecture, 5);
    std::mt19937 random(6);
    std::normal_distribution<float> normal(0, 0.1F);
    const Eigen::VectorXf noise =
        Eigen::VectorXf::NullaryExpr(parametersOf(made).size(), [&] { return normal(random); });
    setParameters(parametersOf(made) + noise, made);
    return made;
  }
};

const FieldArchitecture kSmall{{12, 10}, {8, 11}, {16, 16, 16}, true};

torch::Tensor parameterTensor(const JacobianFieldWeights& weights, torch::Dtype type) {
  return tensorOf(parametersOf(weights), type).view(-1);
}

using ScalarFunction = std::function<torch::Tensor(const torch::Tensor&)>;

/// (f(x + h e_i) - f(x - h e_i)) / 2 h.
double centralDifference(const ScalarFunction& f, const torch::Tensor& x, std::int64_t i, double h) {
  const auto at = [&](double offset) {
    auto moved = x.detach().clone();
    moved.view(-1)[i] += offset;
    return f(moved).item<double>();
  };
  return (at(h) - at(-h)) / (2 * h);
}

void checkGradient(const ScalarFunction& f, const torch::Tensor& x, int samples, double h) {
  const auto at = x.detach().clone().requires_grad_();
  const auto gradient = torch::autograd::grad({f(at)}, {at}).front().view(-1);
  const double scale = gradient.abs().max().item<double>();
  REQUIRE(scale > 0);
  std::mt19937_64 random(1);
  for (int s = 0; s < samples; ++s) {
    const auto i = static_cast<std::int64_t>(random() % static_cast<std::uint64_t>(x.numel()));
    CHECK(std::abs(gradient[i].item<double>() - centralDifference(f, x, i, h)) < 1e-6 * scale);
  }
}

}  // namespace

TEST_CASE("Eigen and LibTorch evaluate a field alike") {
  const Example example;
  for (const auto& architecture : {kSmall, FieldArchitecture{}}) {
    const auto weights = example.weights(architecture);
    const auto features = tensorsOf(example.pair.features, torch::kFloat32);
    const auto theirs = matrixOf<Jacobians>(FieldNetwork(weights)(parameterTensor(weights, torch::kFloat32), features));
    const auto ours = JacobianField(weights).predict(example.pair.features);
    CHECK((ours - example.pair.features.current).norm() > 1);
    CHECK((ours - theirs).cwiseAbs().maxCoeff() < 1e-5 * std::max(1.0, ours.cwiseAbs().maxCoeff()));
    const auto doubles = matrixOf<Jacobians>(
        FieldNetwork(weights)(parameterTensor(weights, kDouble), tensorsOf(example.pair.features, kDouble)));
    CHECK((ours - doubles).cwiseAbs().maxCoeff() < 1e-5 * std::max(1.0, ours.cwiseAbs().maxCoeff()));
  }
}

TEST_CASE("the loss's gradient to every kind of weight is that of central differences") {
  const Example example;
  const auto weights = example.weights(kSmall);
  const auto pair = tensorsOf(example.pair, kDouble);
  const FieldNetwork network(weights);
  const auto loss = [&](const torch::Tensor& parameters) {
    const auto [vertex, jacobian] = fieldLoss(network(parameters, pair.features), pair);
    return 10 * vertex + jacobian;
  };
  checkGradient(loss, parameterTensor(weights, kDouble), 300, 1e-6);
}

TEST_CASE("the loss's gradient to what goes into the Poisson equation is that of central differences") {
  const Example example;
  const auto pair = tensorsOf(example.pair, kDouble);
  const auto jacobians =
      pair.features.current +
      0.1 * torch::sin(torch::arange(pair.features.current.numel(), kDouble)).view(pair.features.current.sizes());
  const auto vertex = [&](const torch::Tensor& at) { return fieldLoss(at, pair).vertex; };
  const auto total = [&](const torch::Tensor& at) { return 10 * vertex(at) + fieldLoss(at, pair).jacobian; };
  checkGradient(vertex, jacobians, 100, 1e-4);
  checkGradient(total, jacobians, 100, 1e-4);
}

TEST_CASE("the Poisson layer is the equation's solution and its transpose, in either precision") {
  const Example example;
  const auto& poisson = *example.reference->poisson;
  const auto jacobians = poisson.jacobians(example.target);
  const Vertices centroids = Vertices::Constant(1, 3, 0.5), weights = jitter(example.target, 1, 9);
  for (const auto type : {torch::kFloat32, torch::kFloat64}) {
    const auto at = tensorOf(jacobians, type).requires_grad_();
    const auto shape = poissonSolution(at, example.reference->poisson, centroids);
    CHECK(shape.scalar_type() == type);
    CHECK(matrixOf<Vertices>(shape).isApprox(poisson.solve(jacobians, centroids), 1e-6));
    const auto gradient = torch::autograd::grad({(shape * tensorOf(weights, type)).sum()}, {at}).front();
    CHECK(matrixOf<Jacobians>(gradient).isApprox(poisson.backward(weights), 1e-6));
  }
}

TEST_CASE("matrices of either storage order become tensors of their shape, and come back") {
  const Eigen::MatrixXd columns = Eigen::MatrixXd::Random(4, 3);
  const auto tensor = tensorOf(columns);
  CHECK(tensor.size(0) == 4);
  CHECK(tensor[2][1].item<double>() == columns(2, 1));
  CHECK(matrixOf<Vertices>(tensor) == Vertices(columns));
  CHECK(matrixOf<Eigen::VectorXd>(tensor.view(-1))[5] == columns(1, 2));
}
