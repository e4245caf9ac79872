#pragma once

#include <Eigen/Core>

namespace shaped {

/// The rotation by |w| radians about w, right-handed (Rodrigues' formula); the identity for w = 0.
Eigen::Matrix3d rotationMatrix(const Eigen::Vector3d& w);

/// The axis-angle vector of a rotation, of length 0 to pi; the inverse of rotationMatrix there. At pi either of the two
/// answers. rotation: orthonormal with determinant +1 up to rounding.
Eigen::Vector3d axisAngle(const Eigen::Matrix3d& rotation);

/// How the rotation turns when its vector changes: exp(w + d) = exp(J d) exp(w) to first order (the left Jacobian of
/// SO(3), J = I + (1 - cos a)/a^2 [w] + (a - sin a)/a^3 [w]^2, a = |w|).
Eigen::Matrix3d leftJacobian(const Eigen::Vector3d& w);

/// [w] with [w] x = w cross x.
Eigen::Matrix3d crossMatrix(const Eigen::Vector3d& w);

}  // namespace shaped
