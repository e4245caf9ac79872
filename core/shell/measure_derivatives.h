#pragma once

#include <array>
#include <vector>

#include "core/shell/measures.h"
#include "core/shell/membrane_density.h"
#include "core/shell/structure.h"

namespace shaped {

/// First derivatives of an energy with respect to the measures of one shape.
struct MeasureGradient {
  Eigen::VectorXd edge;   ///< dW/dl, per edge [1]
  Eigen::VectorXd area;   ///< dW/da as far as the area is not expressed by the lengths, per face [1]
  Eigen::VectorXd hinge;  ///< dW/dtheta, per hinge [m^2]

  explicit MeasureGradient(const Topology& topology)
      : edge(Eigen::VectorXd::Zero(static_cast<Eigen::Index>(topology.edges().size()))),
        area(Eigen::VectorXd::Zero(topology.faces().rows())),
        hinge(Eigen::VectorXd::Zero(static_cast<Eigen::Index>(topology.hinges().size()))) {}
  void setZero() { edge.setZero(), area.setZero(), hinge.setZero(); }
};

/// Second derivatives of one triangle's energy in its squared edge lengths, ordered as the triangle's corners.
struct FaceCurvature {
  Symmetric3 length{};             ///< d2W/dl dl
  std::array<double, 3> weight{};  ///< dW/dl
};

/// Second derivatives of one hinge's energy, a quadratic form in the angle theta, the squared length l of the hinge's
/// edge and the area sum S of its two triangles, and the first derivatives that multiply their own curvature.
struct HingeCurvature {
  double angle_angle = 0;
  double angle_length = 0, angle_area = 0;
  double length_length = 0, length_area = 0, area_area = 0;
  double angle = 0;   ///< dW/dtheta
  double length = 0;  ///< dW/dl
  double area = 0;    ///< dW/dS
};

/// Which Hessian to form.
enum class HessianKind {
  kExact,      ///< the second derivative itself
  kProjected,  ///< every element positive semi-definite: triangles by eigenvalues, hinges by Gauss-Newton
};

/// All second-order information about an energy at one shape; the sum over energies is the entrywise sum.
struct MeasureCurvature {
  HessianKind kind = HessianKind::kExact;
  bool first_argument = false;  ///< some energy has this shape as its undeformed one, so lengths and areas enter hinges
  std::vector<FaceCurvature> faces;
  std::vector<HingeCurvature> hinges;

  MeasureCurvature(const Topology& topology, HessianKind hessian_kind)
      : kind(hessian_kind),
        faces(static_cast<std::size_t>(topology.faces().rows())),
        hinges(topology.hinges().size()) {}
  void reset(HessianKind hessian_kind);
};

/// gradient += dW/dx (V x 3) by the chain rule through lengths and angles at `shape`.
void pullBackGradient(const Topology& topology, const Vertices& shape, const MeasureGradient& measures,
                      Vertices& gradient);

/// hessian += d2W/dx dx by the chain rule at `shape`.
void pullBackHessian(const ShellStructure& structure, const Vertices& shape, const MeasureCurvature& curvature,
                     SymmetricBlockMatrix& hessian);

}  // namespace shaped
