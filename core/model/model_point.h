#pragma once

#include <variant>

#include "core/statistics/submanifold.h"

namespace shaped {

/// Coefficients of a body as one vector: identity (k, in standard deviations), the root's translation (3) [m], then the
/// axis-angle vectors of the joints, the root's first (3 J) [rad].
struct BodyCoefficients {
  Eigen::VectorXd numbers;
};

/// A point of a model: each kind takes one of these for its coefficients, and refuses the others.
using ModelPoint = std::variant<SubmanifoldPoint, BodyCoefficients>;

}  // namespace shaped
