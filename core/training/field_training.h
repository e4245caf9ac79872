#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <stop_token>
#include <string>
#include <vector>

#include "core/neural/jacobian_field.h"
#include "core/numerics/solved.h"
#include "core/training/field_parameters.h"

namespace shaped {

/// One example: deform this source to that target, seeing a scan of it.
struct FieldPair {
  std::shared_ptr<const FieldReference> reference;  ///< pairs may differ in it, and so in topology
  JacobianFieldFeatures features;                   ///< of source and scan
  Vertices target;                                  ///< V x 3 of the reference's topology [m]
};

/// Throws as jacobianFieldFeatures does, or naming `target` when it has another count of vertices or is not finite.
FieldPair makeFieldPair(std::shared_ptr<const FieldReference> reference, const Vertices& source, const Vertices& target,
                        const Scan& scan, const FieldScaling& scaling);

/// The loss of [Muralikrishnan 2025, eq. 3.3 and 3.4], with both norms as means over the surface, so that meshes of
/// different resolution count alike. With a_v and a_f the shares of vertices (lumped) and triangles in the reference's
/// area:
///   vertex = sum_v a_v |x'_v - x_v|^2 [m^2],   jacobian = sum_f a_f |J'_f - J_f|^2 (Frobenius),
///   total = vertex_weight vertex + jacobian_weight jacobian.
/// The target x is moved to where the source's components are centred, as a field cannot move them. The target's
/// Jacobians send the reference's normal to zero; the field learns to do so too.
struct FieldLoss {
  double total = 0, vertex = 0, jacobian = 0;

  FieldLoss& operator+=(const FieldLoss& other);
};

/// One pass over all pairs.
struct FieldEpoch {
  int epoch;             ///< from 1
  FieldLoss loss;        ///< mean over the pairs, each seen with the weights of its step
  double learning_rate;  ///< of its last step
};

/// All that training goes on from.
struct FieldTrainingState {
  JacobianFieldWeights weights;
  Eigen::VectorXf first, second;  ///< Adam's moments, one number a parameter
  std::int64_t step = 0;          ///< steps taken
  FieldLoss epoch_loss;           ///< summed over the pairs of the epoch under way
};

/// Before the first step.
FieldTrainingState untrainedState(JacobianFieldWeights weights);

struct FieldTrainingOptions {
  int epochs = 100;                  ///< >= 1
  int batch = 4;                     ///< pairs a step, >= 1; they are worked on in parallel
  double learning_rate = 1e-3;       ///< > 0
  double last_learning_rate = 1e-5;  ///< of the last step, > 0; from step to step it changes by the same factor
  /// Steps over which the rate rises to that, >= 0: Adam's first ones are as large as its later ones, and would throw a
  /// field far from the identity that it starts from.
  int warm_up = 100;
  double vertex_weight = 10;   ///< [1/m^2], >= 0
  double jacobian_weight = 1;  ///< >= 0; not both 0
  std::uint64_t seed = 1;      ///< of the order of the pairs
  std::stop_token stop = {};
  /// Called after each epoch, and with the state then reached.
  std::function<void(const FieldEpoch&, const FieldTrainingState&)> each_epoch = {};

  std::optional<std::string> firstViolation() const;  ///< "epochs = 0, want >= 1"
};

/// Trains a field with Adam [Kingma and Ba 2015], pairs in an order drawn anew each epoch. Goes on where the state
/// stands: with the same pairs and options, training that was stopped and resumed gives the same bits as training that
/// was not. The same whatever the number of threads.
///
/// kIterationLimit after the last epoch; kCancelled when the stop token fired, with the last whole step (a step that is
/// under way is given up); kNumericalFailure when the loss was no longer finite, with the state before it. iterations:
/// steps taken in all. residual: mean loss of the last whole epoch, 0 before the first ends.
/// Throws InvalidInput naming the option, `pairs` when there is none, or what JacobianField finds wrong in the weights.
Solved<FieldTrainingState> trainJacobianField(const std::vector<FieldPair>& pairs, FieldTrainingState state,
                                              const FieldTrainingOptions& options = {});

}  // namespace shaped
