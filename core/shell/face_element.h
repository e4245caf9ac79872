#pragma once

#include "core/shell/face_geometry.h"
#include "core/shell/measure_derivatives.h"

namespace shaped {

/// Second derivative of one triangle's energy in its corners: nine 3 x 3 blocks that sum to zero along every row, as
/// the energy ignores translations, so the three blocks between different corners say everything.
struct FaceElement {
  /// Entry k: row corner k + 2, column corner k + 1, the ends of edge k.
  std::array<Eigen::Matrix3d, 3> between;

  /// Block of corner i with itself.
  Eigen::Matrix3d diagonal(std::size_t i) const { return -(between[(i + 1) % 3] + between[(i + 2) % 3].transpose()); }
};

/// Of an energy in the squared lengths.
FaceElement lengthElement(const FaceGeometry& face, const FaceCurvature& curvature);

/// Adds sum_k w_k d2(theta_k)/dx dx for the part of the fold angles that this triangle carries.
/// w: slope of the energy in the angle at each edge, 0 at boundary edges.
void addFoldElement(const FaceGeometry& face, const std::array<double, 3>& w, FaceElement& element);

/// The nearest positive semi-definite element in the Frobenius norm.
void projectToPositive(const FaceGeometry& face, FaceElement& element);

}  // namespace shaped
