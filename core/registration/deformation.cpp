#include "core/registration/deformation.h"

#include <Eigen/Geometry>

#include "core/mesh/quality.h"

namespace shaped {
namespace {

using Triplets = std::vector<Eigen::Triplet<double>>;
using Matrix = Eigen::SparseMatrix<double>;
using State = Eigen::MatrixXd;

Matrix lowerFrom(Eigen::Index size, const Triplets& triplets) {
  Matrix matrix(size, size);
  matrix.setFromTriplets(triplets.begin(), triplets.end());
  return matrix;
}

/// The anchor's offset in the undeformed template, m.
Eigen::Vector3d offsetOf(const Anchor& anchor, const Faces& faces, const Vertices& rest) {
  Eigen::Vector3d point = position(anchor, faces, rest);
  for (int c = 0; c < 3; ++c) point -= anchor.barycentric[c] * rest.row(faces(anchor.face, c)).transpose();
  return point;
}

/// State rows 4 i .. 4 i + 2: the columns of A_i; row 4 i + 3: p_i.
class AffineDeformation : public Deformation {
 public:
  AffineDeformation(const Topology& topology, const Vertices& rest, double turn_length)
      : Deformation(rest.rows()), topology_(topology), rest_(rest), square_(turn_length * turn_length) {
    assemble();
  }

  State start() const override {
    State state(4 * rest_.rows(), 3);
    for (Eigen::Index v = 0; v < rest_.rows(); ++v) {
      state.middleRows<3>(4 * v).setIdentity();
      state.row(4 * v + 3) = rest_.row(v);
    }
    return state;
  }

  double energy(const State& state) const override {
    double sum = 0;
    for (const auto& [i, j] : topology_.edges())
      sum += square_ * turn(state, i, j).squaredNorm() + gap(state, i, j).squaredNorm();
    return sum;
  }

  State gradient(const State& state) const override {
    return 2 * State(bound_.selfadjointView<Eigen::Lower>() * state);
  }

  const Matrix& bound() const override { return bound_; }
  Eigen::Index positionRow(Eigen::Index vertex) const override { return 4 * vertex + 3; }

  /// The offset turns and stretches with the maps of the corners.
  LinearPoint landmark(const Anchor& anchor) const override {
    const Eigen::Vector3d offset = offsetOf(anchor, topology_.faces(), rest_);
    LinearPoint point;
    for (int c = 0; c < 3; ++c) {
      const Eigen::Index row = 4 * topology_.faces()(anchor.face, c);
      for (int axis = 0; axis < 3; ++axis) point.terms.push_back({row + axis, anchor.barycentric[c] * offset[axis]});
      point.terms.push_back({row + 3, anchor.barycentric[c]});
    }
    return point;
  }

 private:
  Eigen::Matrix3d turn(const State& state, Eigen::Index i, Eigen::Index j) const {
    return state.middleRows<3>(4 * i) - state.middleRows<3>(4 * j);
  }

  Eigen::RowVector3d gap(const State& state, Eigen::Index i, Eigen::Index j) const {
    const Eigen::RowVector3d half = 0.5 * (rest_.row(j) - rest_.row(i));
    return state.row(4 * i + 3) - state.row(4 * j + 3) +
           half * (state.middleRows<3>(4 * i) + state.middleRows<3>(4 * j));
  }

  void assemble() {
    Triplets triplets;
    triplets.reserve(topology_.edges().size() * 40);
    for (const auto& [i, j] : topology_.edges()) appendEdge(i, j, triplets);
    bound_ = lowerFrom(4 * rest_.rows(), triplets);
  }

  /// The edge's part of Q: l^2 on the differences of the maps, and the gap's row times itself.
  void appendEdge(Eigen::Index i, Eigen::Index j, Triplets& triplets) const {
    Eigen::Matrix<double, 8, 1> row;
    for (int axis = 0; axis < 3; ++axis) row[axis] = row[axis + 4] = 0.5 * (rest_(j, axis) - rest_(i, axis));
    row[3] = 1;
    row[7] = -1;
    Eigen::Matrix<double, 8, 8> element = row * row.transpose();
    for (int axis = 0; axis < 3; ++axis) {
      element(axis, axis) += square_;
      element(axis + 4, axis + 4) += square_;
      element(axis, axis + 4) -= square_;
      element(axis + 4, axis) -= square_;
    }
    for (int r = 0; r < 8; ++r)
      for (int c = 0; c < 8; ++c) {
        const Eigen::Index at = 4 * (r < 4 ? i : j) + r % 4, other = 4 * (c < 4 ? i : j) + c % 4;
        if (at >= other) triplets.emplace_back(at, other, element(r, c));
      }
  }

  const Topology& topology_;
  Vertices rest_;
  double square_;
  Matrix bound_;
};

/// What the two plain deformations share: the state is the vertices.
class VertexDeformation : public Deformation {
 public:
  VertexDeformation(const Topology& topology, const Vertices& rest)
      : Deformation(rest.rows()), topology_(topology), rest_(rest) {}

  State start() const override { return rest_; }
  const Matrix& bound() const override { return bound_; }
  Eigen::Index positionRow(Eigen::Index vertex) const override { return vertex; }

  /// The corners' mean plus the offset's part along and across the triangle is not linear: the offset is left out.
  LinearPoint landmark(const Anchor& anchor) const override {
    LinearPoint point;
    for (int c = 0; c < 3; ++c) point.terms.push_back({topology_.faces()(anchor.face, c), anchor.barycentric[c]});
    return point;
  }

 protected:
  const Topology& topology_;
  Vertices rest_;
  Matrix bound_;
};

class FreeDisplacement : public VertexDeformation {
 public:
  FreeDisplacement(const Topology& topology, const Vertices& rest)
      : VertexDeformation(topology, rest), shares_(areaShares(topology.faces(), rest)) {
    Triplets triplets;
    for (Eigen::Index v = 0; v < rest.rows(); ++v) triplets.emplace_back(v, v, shares_[v]);
    bound_ = lowerFrom(rest.rows(), triplets);
  }

  double energy(const State& state) const override {
    return ((state - rest_).rowwise().squaredNorm().array() * shares_.array()).sum();
  }
  State gradient(const State& state) const override { return 2 * (shares_.asDiagonal() * (state - rest_)); }

 private:
  Eigen::VectorXd shares_;
};

class KeptEdgeLengths : public VertexDeformation {
 public:
  KeptEdgeLengths(const Topology& topology, const Vertices& rest) : VertexDeformation(topology, rest) {
    Triplets triplets;
    for (const auto& [i, j] : topology.edges()) {
      triplets.emplace_back(i, i, 1);
      triplets.emplace_back(j, j, 1);
      triplets.emplace_back(j, i, -1);
    }
    bound_ = lowerFrom(rest.rows(), triplets);
  }

  double energy(const State& state) const override {
    double sum = 0;
    for (const auto& [i, j] : topology_.edges()) {
      const double stretch = (state.row(i) - state.row(j)).norm() - (rest_.row(i) - rest_.row(j)).norm();
      sum += stretch * stretch;
    }
    return sum;
  }

  State gradient(const State& state) const override {
    State gradient = State::Zero(state.rows(), 3);
    for (const auto& [i, j] : topology_.edges()) {
      const Eigen::RowVector3d edge = state.row(i) - state.row(j);
      const double length = edge.norm();
      if (!(length > 0)) continue;
      const Eigen::RowVector3d force = 2 * (1 - (rest_.row(i) - rest_.row(j)).norm() / length) * edge;
      gradient.row(i) += force;
      gradient.row(j) -= force;
    }
    return gradient;
  }
};

}  // namespace

Eigen::RowVector3d LinearPoint::at(const Eigen::MatrixXd& state) const {
  Eigen::RowVector3d point = Eigen::RowVector3d::Zero();
  for (const auto& [row, coefficient] : terms) point += coefficient * state.row(row);
  return point;
}

Vertices Deformation::vertices(const Eigen::MatrixXd& state) const {
  Vertices vertices(vertex_count_, 3);
  for (Eigen::Index v = 0; v < vertex_count_; ++v) vertices.row(v) = state.row(positionRow(v));
  return vertices;
}

std::unique_ptr<Deformation> affineDeformation(const Topology& topology, const Vertices& rest, double turn_length) {
  return std::make_unique<AffineDeformation>(topology, rest, turn_length);
}

std::unique_ptr<Deformation> freeDisplacement(const Topology& topology, const Vertices& rest) {
  return std::make_unique<FreeDisplacement>(topology, rest);
}

std::unique_ptr<Deformation> keptEdgeLengths(const Topology& topology, const Vertices& rest) {
  return std::make_unique<KeptEdgeLengths>(topology, rest);
}

Eigen::VectorXd areaShares(const Faces& faces, const Vertices& vertices) {
  const Eigen::VectorXd areas = triangleAreas(faces, vertices);
  Eigen::VectorXd shares = Eigen::VectorXd::Zero(vertices.rows());
  for (Eigen::Index f = 0; f < faces.rows(); ++f)
    for (int c = 0; c < 3; ++c) shares[faces(f, c)] += areas[f];
  return shares / shares.sum();
}

}  // namespace shaped
