#include "core/reduction/subspace.h"

#include <Eigen/Eigenvalues>
#include <Eigen/QR>
#include <algorithm>

#include "core/mesh/alignment.h"

namespace shaped {
namespace {

constexpr double kNegligible = 1e-9;  ///< of a direction

Eigen::Map<const Eigen::VectorXd> flat(const Vertices& shape) { return {shape.data(), shape.size()}; }

}  // namespace

Vertices ShapeSubspace::shape(const Eigen::VectorXd& coordinates) const {
  Vertices result = origin;
  Eigen::Map<Eigen::VectorXd>(result.data(), result.size()).noalias() += basis * coordinates;
  return result;
}

Eigen::VectorXd ShapeSubspace::coordinates(const Vertices& shape) const {
  return basis.transpose() * (flat(shape) - flat(origin));
}

bool ShapeSubspace::append(const Eigen::VectorXd& direction) {
  Eigen::VectorXd rest = direction.normalized();
  for (int pass = 0; pass < 2; ++pass) rest -= basis * (basis.transpose() * rest);
  if (!(rest.norm() > kNegligible)) return false;
  basis.conservativeResize(Eigen::NoChange, basis.cols() + 1);
  basis.rightCols<1>() = rest.normalized();
  return true;
}

Eigen::MatrixXd infinitesimalRigidMotions(const Vertices& shape) {
  const Vertices centred = shape.rowwise() - shape.colwise().mean();
  Eigen::MatrixXd motions = Eigen::MatrixXd::Zero(shape.size(), 6);
  for (Eigen::Index v = 0; v < shape.rows(); ++v)
    for (int axis = 0; axis < 3; ++axis) {
      const int next = (axis + 1) % 3, last = (axis + 2) % 3;
      motions(3 * v + axis, axis) = 1;
      motions(3 * v + next, 3 + axis) = -centred(v, last);
      motions(3 * v + last, 3 + axis) = centred(v, next);
    }
  return Eigen::HouseholderQR<Eigen::MatrixXd>(motions).householderQ() * Eigen::MatrixXd::Identity(shape.size(), 6);
}

ShapeSubspace principalSubspace(const Vertices& origin, const std::vector<Vertices>& shapes, int dimension,
                                double negligible) {
  Eigen::MatrixXd displacements(origin.size(), static_cast<Eigen::Index>(shapes.size()));
  for (std::size_t i = 0; i < shapes.size(); ++i)
    displacements.col(static_cast<Eigen::Index>(i)) = flat(shapes[i]) - flat(origin);
  // There are far fewer shapes than coordinates: right singular vectors first. They have half the digits, but
  // what is appended is orthogonalised.
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> gram(displacements.transpose() * displacements);
  const Eigen::VectorXd squares = gram.eigenvalues().reverse().cwiseMax(0);
  ShapeSubspace result{origin, Eigen::MatrixXd(origin.size(), 0)};
  const auto wanted = std::min<Eigen::Index>(dimension, squares.size());
  for (Eigen::Index j = 0; j < wanted && squares[j] > negligible * negligible * squares[0]; ++j)
    result.append(displacements * gram.eigenvectors().col(squares.size() - 1 - j));
  return result;
}

ShapeSubspace including(const ShapeSubspace& subspace, const Vertices& shape) {
  ShapeSubspace result = subspace;
  result.append(flat(shape) - flat(subspace.origin));
  return result;
}

std::size_t centralShape(const std::vector<Vertices>& shapes) {
  std::vector<Vertices> aligned;
  Vertices mean = Vertices::Zero(shapes.front().rows(), 3);
  for (const auto& shape : shapes) {
    aligned.push_back(apply(alignRigidly(shape, shapes.front()), shape));
    mean += aligned.back() / static_cast<double>(shapes.size());
  }
  const auto distance = [&](const Vertices& shape) { return (shape - mean).squaredNorm(); };
  const auto nearest = std::min_element(
      aligned.begin(), aligned.end(), [&](const Vertices& a, const Vertices& b) { return distance(a) < distance(b); });
  return static_cast<std::size_t>(nearest - aligned.begin());
}

}  // namespace shaped
