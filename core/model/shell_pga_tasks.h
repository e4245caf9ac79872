#pragma once

#include "core/editing/anchored_fit.h"
#include "core/model/shape_model.h"
#include "core/model/shell_pga_model.h"

namespace shaped {

/// How probable a shape is under the model: a Gaussian in the tangent coordinates with the eigenvalues as variances.
/// Modes with less than 1e-6 of the largest variance, or with a negative one, do not count. The residual distance is
/// sqrt(W[s, P[s]]).
using ShellPgaScore = ShapeScore;

struct ShellPgaProjection {
  Vertices shape;  ///< P[s] at full resolution, rigidly aligned to the input
  SubmanifoldPoint coefficients;
  Eigen::VectorXd tangent_coordinates;  ///< J coordinates along the principal components [m]
  double residual_energy = 0;           ///< W[s, P[s]] on the coarse mesh [m^2]
  ShellPgaScore score;
  double smallest_area_ratio = 1;  ///< over triangles: area in `shape` over area in the mean
};

/// Projection (17)-(20) of [HZRS18] of a full-resolution shape, with its Mahalanobis distance and likelihood. Throws
/// InvalidInput naming "shape" when it does not fit the model's topology, or "modes".
Solved<ShellPgaProjection> project(const ShellPgaModel& model, const Vertices& shape, const ProjectionOptions& options);

/// The full-resolution shape of coefficients. Throws InvalidInput naming "alpha", "alpha[j]" or "scale" when they are
/// no point of the submanifold.
Solved<SynthesizedShape> synthesize(const ShellPgaModel& model, const SubmanifoldPoint& coefficients,
                                    const SynthesisOptions& options);

/// Computes one shape, so that the first request does not wait for memory and caches.
void warm(const ShellPgaModel& model);

/// The Gaussian score of tangent coordinates (J entries, J at most the model's) without the residual.
ShellPgaScore scoreOf(const ShellPgaModel& model, const Eigen::VectorXd& tangent_coordinates);

/// A vertex and where it must lie.
struct Handle {
  std::int32_t vertex = 0;                             ///< of the full mesh
  Eigen::Vector3d position = Eigen::Vector3d::Zero();  ///< [m]
};

struct EditOptions {
  int modes = 0;              ///< J to use, 0 = all of the model's
  int outer_iterations = 40;  ///< alternations between s and P[s] at most, >= 1
  std::stop_token stop;
};

struct ShellPgaEdit {
  Vertices shape;                      ///< full resolution; the handles are met
  Vertices projection;                 ///< P[shape], full resolution, on the model's submanifold
  SubmanifoldPoint coefficients;       ///< of `projection`
  std::vector<double> energies;        ///< W[s, P[s]] on the coarse mesh after each outer iteration, falling [m^2]
  double largest_handle_distance = 0;  ///< [m]
  double smallest_area_ratio = 1;
};

/// Handle editing (21) of [HZRS18]: alternation on the coarse mesh, then Newton's method at full resolution with the
/// handle vertices fixed. Throws InvalidInput naming "handles" or "handles[i]" when a vertex is out of range or named
/// twice, a position is not finite, there are fewer than three handles, or they lie on one line.
Solved<ShellPgaEdit> edit(const ShellPgaModel& model, const std::vector<Handle>& handles, const EditOptions& options);

}  // namespace shaped
