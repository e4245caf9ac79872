#pragma once

#include <memory>
#include <stop_token>
#include <string>
#include <vector>

#include "core/mesh/topology.h"
#include "core/numerics/solved.h"

namespace shaped {

/// A point of the Shell PGA submanifold M_J, [HZRS18] (15)-(16), (20).
struct ShellPgaCoefficients {
  /// 2J weights of p_1 .. p_J, then of the reflections p_-1 .. p_-J; each >= 0, sum 1.
  Eigen::VectorXd alpha;
  /// The factor of (17): the shape is I(mean, q(alpha), 1 / scale); > 0.
  double scale = 1;
};

/// How probable a shape is under the model.
struct ShellPgaScore {
  double mahalanobis = 0;        ///< distance of the projection to the mean in units of the model's deviations
  double log_likelihood = 0;     ///< of the projection's tangent coordinates, natural logarithm
  double residual_distance = 0;  ///< sqrt(W[s, P[s]]), the part that the model does not explain [m]
};

struct ShellPgaProjection {
  Vertices shape;                      ///< P[s] at full resolution, rigidly aligned to the input
  ShellPgaCoefficients coefficients;
  Eigen::VectorXd tangent_coordinates; ///< J coordinates in the basis of principal components [m]
  double residual_energy = 0;          ///< W[s, P[s]] on the coarse mesh [m^2]
  ShellPgaScore score;
  double smallest_area_ratio = 1;      ///< over triangles: area in `shape` over area in the mean
};

struct ProjectionOptions {
  int modes = 0;            ///< J to use, 0 = all of the model's
  double tolerance = 1e-8;  ///< relative gradient norm of the inner solves, > 0
  std::stop_token stop;
};

/// A vertex and where it must lie.
struct Handle {
  std::int32_t vertex = 0;     ///< of the full mesh
  Eigen::Vector3d position{};  ///< [m]
};

struct EditOptions {
  int modes = 0;             ///< J to use, 0 = all of the model's
  int outer_iterations = 10; ///< alternations between s and P[s], >= 1
  std::stop_token stop;
};

struct ShellPgaEdit {
  Vertices shape;                        ///< meets the handles; full resolution
  Vertices projection;                   ///< P[shape], on the model's submanifold; full resolution
  ShellPgaCoefficients coefficients;     ///< of `projection`
  std::vector<double> energies;          ///< W[s, P[s]] after each outer iteration [m^2], falling
  double largest_handle_distance = 0;    ///< [m]
  double smallest_area_ratio = 1;
};

struct EvaluationOptions {
  std::vector<int> modes;        ///< dimensions to evaluate; empty: 1 .. J
  int specificity_samples = 50;  ///< random shapes drawn from the model, >= 0
  unsigned seed = 1;
  std::stop_token stop;
};

/// Quality of a model per number of modes; errors are root mean squares over vertices after rigid alignment [m].
struct ShellPgaEvaluation {
  std::vector<int> modes;
  std::vector<double> compactness;     ///< share of the training variance captured, in [0, 1]
  std::vector<double> generalisation;  ///< error of projecting shapes that were left out of training
  std::vector<double> specificity;     ///< distance of random model shapes to the nearest training shape
};

/// Shell PGA of shapes with one connectivity: mean, variances and principal variations of [HZRS18] on a coarse mesh,
/// and what carries coarse shapes to full resolution. Immutable after construction; safe to share between threads.
class ShellPgaModel;
using ShellPgaModelPtr = std::shared_ptr<const ShellPgaModel>;

/// What describes a model to people.
struct ShellPgaDescription {
  int training_shapes = 0, modes = 0, path_steps = 0;
  int coarse_vertices = 0;
  double bending = 0;           ///< eta [m^2]
  Eigen::VectorXd eigenvalues;  ///< all n, falling [m^2]
  Outcome training;             ///< how the Frechet mean ended
};

}  // namespace shaped
