#pragma once

#include <Eigen/SparseCore>
#include <memory>
#include <vector>

#include "core/mesh/topology.h"
#include "core/registration/landmark.h"

namespace shaped {

/// A point of the template as a linear function of a deformation's unknowns: sum of coefficient * state.row(row).
struct LinearPoint {
  struct Term {
    Eigen::Index row;
    double coefficient;
  };
  std::vector<Term> terms;

  Eigen::RowVector3d at(const Eigen::MatrixXd& state) const;
};

/// How a template may deform, and what a deformation costs.
///
/// Unknowns: a state of U x 3 numbers, one column a coordinate. Its energy R has in every state z a quadratic upper
/// bound R(y) <= sum over columns of y^T Q y - 2 y^T q(z) + constant that touches it in z, with Q the same for all
/// states and columns: minimising the bound with data that are quadratic in y never raises R plus data (majorise and
/// minimise), and one Cholesky factor serves the three coordinates. R is the bound itself where it is quadratic.
class Deformation {
 public:
  virtual ~Deformation() = default;

  /// The undeformed template.
  virtual Eigen::MatrixXd start() const = 0;
  /// R, square metres.
  virtual double energy(const Eigen::MatrixXd& state) const = 0;
  /// d R / d state, U x 3.
  virtual Eigen::MatrixXd gradient(const Eigen::MatrixXd& state) const = 0;
  /// Q, U x U, lower triangle.
  virtual const Eigen::SparseMatrix<double>& bound() const = 0;
  /// Row of the state that holds a vertex's position.
  virtual Eigen::Index positionRow(Eigen::Index vertex) const = 0;
  /// The plain deformations leave the offset of an anchor off the surface out: it is not linear in the vertices.
  virtual LinearPoint landmark(const Anchor& anchor) const = 0;

  /// V x 3.
  Vertices vertices(const Eigen::MatrixXd& state) const;

 protected:
  explicit Deformation(Eigen::Index vertex_count) : vertex_count_(vertex_count) {}

 private:
  Eigen::Index vertex_count_;
};

/// Every vertex carries an affine map of its surroundings, and neighbours' maps are alike (Allen, Curless, Popovic
/// 2003; Amberg, Romdhani, Vetter 2007):
///   R = sum over edges |(X_i - X_j) G|_F^2,  G = T(m) diag(l, l, l, 1),
/// where T(m) moves the origin to the edge's middle m, so that R does not depend on where the template lies. With the
/// map of vertex i written as x -> A_i (x - v_i) + p_i that is
///   R = sum over edges l^2 |A_i - A_j|^2 + |p_i - p_j + (A_i + A_j)(v_j - v_i) / 2|^2.
/// R is zero for one affine map of the whole template. turn_length l [m], > 0: how far a change of the map reaches.
/// The topology must outlive it.
std::unique_ptr<Deformation> affineDeformation(const Topology& topology, const Vertices& rest, double turn_length);

/// Every vertex moves on its own, R = sum_i a_i |x_i - v_i|^2 with a_i the vertex's share of the area: "the
/// displacement should be small", baseline 1 of [Mur25] (section 3.4.1).
std::unique_ptr<Deformation> freeDisplacement(const Topology& topology, const Vertices& rest);

/// Edges keep their lengths, R = sum over edges (|x_i - x_j| - |v_i - v_j|)^2: baseline 2 of [Mur25]. Bounded by
/// |x_i - x_j - L d|^2 with d the edge's present direction (the triangle inequality).
std::unique_ptr<Deformation> keptEdgeLengths(const Topology& topology, const Vertices& rest);

/// A third of the area of its triangles for each vertex, as a share of the whole: V values, sum 1.
Eigen::VectorXd areaShares(const Faces& faces, const Vertices& vertices);

}  // namespace shaped
