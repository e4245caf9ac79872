#include "core/shell/measure_derivatives.h"

#include <Eigen/Eigenvalues>
#include <algorithm>

#include "core/shell/hinge_geometry.h"

namespace shaped {
namespace {

using Matrix9 = Eigen::Matrix<double, 9, 9>;

constexpr std::array<std::array<int, 2>, 6> kFacePairs{{{0, 0}, {1, 1}, {2, 2}, {1, 0}, {2, 1}, {0, 2}}};
constexpr std::array<std::array<std::size_t, 2>, 10> kHingePairs{
    {{0, 0}, {1, 1}, {2, 2}, {3, 3}, {1, 0}, {2, 0}, {3, 0}, {2, 1}, {3, 1}, {3, 2}}};

void addBlock(const LowerSlot& slot, const Eigen::Matrix3d& block, SymmetricBlockMatrix& matrix) {
  Eigen::Map<Eigen::Matrix3d> target(matrix.block(slot.slot));
  if (slot.transposed)
    target += block.transpose();
  else
    target += block;
}

/// Element matrix of a triangle. Edge k runs from corner k + 1 to corner k + 2, dl_k = 2 e_k . (dx_{k+2} - dx_{k+1}).
Matrix9 faceElement(const FaceCurvature& curvature, const std::array<Eigen::Vector3d, 3>& edges) {
  const auto& f = curvature.length;
  const double length[3][3] = {{f[0], f[3], f[5]}, {f[3], f[1], f[4]}, {f[5], f[4], f[2]}};
  // dl/dx, column k for edge k
  Eigen::Matrix<double, 9, 3> chain = Eigen::Matrix<double, 9, 3>::Zero();
  for (int k = 0; k < 3; ++k) {
    chain.block<3, 1>(3 * ((k + 2) % 3), k) = 2 * edges[static_cast<std::size_t>(k)];
    chain.block<3, 1>(3 * ((k + 1) % 3), k) = -2 * edges[static_cast<std::size_t>(k)];
  }
  Matrix9 element = chain * Eigen::Map<const Eigen::Matrix3d>(&length[0][0]) * chain.transpose();
  for (int k = 0; k < 3; ++k) {
    const int a = 3 * ((k + 1) % 3), b = 3 * ((k + 2) % 3);
    const double weight = 2 * curvature.weight[static_cast<std::size_t>(k)];
    for (int axis = 0; axis < 3; ++axis) {
      element(a + axis, a + axis) += weight;
      element(b + axis, b + axis) += weight;
      element(a + axis, b + axis) -= weight;
      element(b + axis, a + axis) -= weight;
    }
  }
  return element;
}

void projectToPositive(Matrix9& element) {
  const Eigen::SelfAdjointEigenSolver<Matrix9> eigen(element);
  element = eigen.eigenvectors() * eigen.eigenvalues().cwiseMax(0).asDiagonal() * eigen.eigenvectors().transpose();
}

void addFace(const ShellStructure& structure, const Vertices& shape, const FaceCurvature& curvature, HessianKind kind,
             std::size_t f, SymmetricBlockMatrix& hessian) {
  const auto v = structure.topology().faces().row(static_cast<Eigen::Index>(f));
  std::array<Eigen::Vector3d, 3> edges;
  for (int k = 0; k < 3; ++k) edges[static_cast<std::size_t>(k)] = shape.row(v[(k + 2) % 3]) - shape.row(v[(k + 1) % 3]);
  Matrix9 element = faceElement(curvature, edges);
  if (kind == HessianKind::kProjected) projectToPositive(element);
  for (std::size_t p = 0; p < 6; ++p)
    addBlock(structure.faceSlots()[f][p], element.block<3, 3>(3 * kFacePairs[p][0], 3 * kFacePairs[p][1]), hessian);
}

/// Second derivative in a shape that is only ever deformed: the angle alone enters.
void addDeformedHinge(const std::array<LowerSlot, 10>& slots, const HingeGeometry& geometry,
                      const HingeCurvature& curvature, SymmetricBlockMatrix& hessian) {
  std::array<Eigen::Vector3d, 4> angle;
  for (std::size_t i = 0; i < 4; ++i) angle[i] = geometry.angleGradient(i);
  for (std::size_t p = 0; p < 10; ++p) {
    const auto [i, j] = kHingePairs[p];
    Eigen::Matrix3d block = (curvature.angle_angle * angle[i]) * angle[j].transpose();
    if (curvature.angle != 0 && p != 9) block += curvature.angle * geometry.angleHessian(i, j);
    addBlock(slots[p], block, hessian);
  }
}

void addUndeformedHinge(const std::array<LowerSlot, 10>& slots, const HingeGeometry& geometry,
                        const HingeCurvature& c, SymmetricBlockMatrix& hessian) {
  Eigen::Matrix3d form;
  form << c.angle_angle, c.angle_length, c.angle_area, c.angle_length, c.length_length, c.length_area, c.angle_area,
      c.length_area, c.area_area;
  std::array<Eigen::Matrix3d, 4> gradients;
  for (std::size_t i = 0; i < 4; ++i)
    gradients[i] << geometry.angleGradient(i), geometry.lengthGradient(i), geometry.areaGradient(i);
  for (std::size_t p = 0; p < 10; ++p) {
    const auto [i, j] = kHingePairs[p];
    Eigen::Matrix3d block = gradients[i] * form * gradients[j].transpose();
    if (c.angle != 0 && p != 9) block += c.angle * geometry.angleHessian(i, j);
    if (i < 2 && j < 2) block.diagonal().array() += (i == j ? 2 : -2) * c.length;
    addBlock(slots[p], block, hessian);
  }
}

}  // namespace

void MeasureCurvature::reset(HessianKind hessian_kind) {
  kind = hessian_kind;
  first_argument = false;
  std::fill(faces.begin(), faces.end(), FaceCurvature{});
  std::fill(hinges.begin(), hinges.end(), HingeCurvature{});
}

void pullBackGradient(const Topology& topology, const Vertices& shape, const MeasureGradient& measures,
                      Vertices& gradient) {
  const auto& edges = topology.edges();
  for (std::size_t e = 0; e < edges.size(); ++e) {
    const auto [a, b] = edges[e];
    const Eigen::RowVector3d force = 2 * measures.edge[static_cast<Eigen::Index>(e)] * (shape.row(b) - shape.row(a));
    gradient.row(b) += force;
    gradient.row(a) -= force;
  }
  const auto& hinges = topology.hinges();
  for (std::size_t h = 0; h < hinges.size(); ++h) {
    const double weight = measures.hinge[static_cast<Eigen::Index>(h)];
    const HingeGeometry geometry(hinges[h], shape);
    for (std::size_t i = 0; i < 4; ++i)
      gradient.row(hinges[h].vertices[i]) += weight * geometry.angleGradient(i).transpose();
  }
}

void pullBackHessian(const ShellStructure& structure, const Vertices& shape, const MeasureCurvature& curvature,
                     SymmetricBlockMatrix& hessian) {
  for (std::size_t f = 0; f < curvature.faces.size(); ++f)
    addFace(structure, shape, curvature.faces[f], curvature.kind, f, hessian);
  const auto& hinges = structure.topology().hinges();
  for (std::size_t h = 0; h < hinges.size(); ++h) {
    const HingeGeometry geometry(hinges[h], shape);
    if (curvature.first_argument)
      addUndeformedHinge(structure.hingeSlots()[h], geometry, curvature.hinges[h], hessian);
    else
      addDeformedHinge(structure.hingeSlots()[h], geometry, curvature.hinges[h], hessian);
  }
}

}  // namespace shaped
