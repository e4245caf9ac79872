#include "core/shell/measure_derivatives.h"

#include <algorithm>

#include "core/shell/block_updates.h"
#include "core/shell/face_element.h"
#include "core/shell/hinge_geometry.h"

namespace shaped {
namespace {

void addEdgeForces(const Topology& topology, const Vertices& shape, const Eigen::VectorXd& slope, Vertices& gradient) {
  const auto& edges = topology.edges();
  for (std::size_t e = 0; e < edges.size(); ++e) {
    const auto [a, b] = edges[e];
    const Eigen::RowVector3d force = 2 * slope.data()[e] * (shape.row(b) - shape.row(a));
    gradient.row(b) += force;
    gradient.row(a) -= force;
  }
}

/// A value per hinge at the three edges of a face; 0 at the boundary.
std::array<double, 3> atEdges(const Topology& topology, std::size_t f, const double* per_hinge) {
  std::array<double, 3> result;
  for (std::size_t k = 0; k < 3; ++k) {
    const auto h = topology.faceHinges()[f][k];
    result[k] = h >= 0 ? per_hinge[h] : 0;
  }
  return result;
}

/// Forces on a face's corners from slopes in its area and in the fold angles at its edges.
std::array<Eigen::RowVector3d, 3> faceForces(const FaceGeometry& face, double area, const std::array<double, 3>& w) {
  const auto& [e, N, d, squared] = face;
  const std::array<double, 3> u{w[0] / e[0].norm(), w[1] / e[1].norm(), w[2] / e[2].norm()};
  const auto c = face.foldCoefficients(u);
  const double inverse = 1 / squared, by_length = 0.5 * area * std::sqrt(inverse);
  std::array<Eigen::RowVector3d, 3> forces;
  for (std::size_t i = 0; i < 3; ++i) {
    const std::size_t next = (i + 1) % 3, last = (i + 2) % 3;
    forces[i] = (c[i] * inverse) * N + by_length * (d[next] * e[next] - d[last] * e[last]);
  }
  return forces;
}

/// block += addend, or its transpose where the slot is the transposed one's.
void addBlock(const LowerSlot& slot, const Eigen::Matrix3d& addend, SymmetricBlockMatrix& matrix) {
  const int rows = slot.transposed ? 3 : 1, columns = slot.transposed ? 1 : 3;
  double* block = matrix.block(slot.slot);
  for (int c = 0; c < 3; ++c)
    for (int r = 0; r < 3; ++r) block[rows * r + columns * c] += addend(r, c);
}

/// Adds what the area's slope of the bending energy contributes to the second derivatives in the lengths.
void addAreaSlope(const FaceGeometry& face, double slope, FaceCurvature& curvature) {
  const double inverse = 1 / face.squared_norm, by_length = 0.25 * slope * std::sqrt(inverse);
  const auto& d = face.d;
  for (std::size_t p = 0; p < 6; ++p)
    curvature.length[p] +=
        0.5 * by_length * ((p < 3 ? -1 : 1) - d[kSymmetricPairs[p][0]] * d[kSymmetricPairs[p][1]] * inverse);
  for (std::size_t i = 0; i < 3; ++i) curvature.weight[i] += by_length * d[i];
}

FaceElement faceElement(const Topology& topology, const Vertices& shape, const MeasureCurvature& curvature,
                        std::size_t f) {
  const FaceGeometry face(topology.faces(), static_cast<Eigen::Index>(f), shape);
  if (curvature.kind == HessianKind::kProjected) {
    auto element = lengthElement(face, curvature.faces[f]);
    projectToPositive(face, element);
    return element;
  }
  std::array<double, 3> angle{};
  double area = 0;
  for (std::size_t k = 0; k < 3; ++k)
    if (const auto h = topology.faceHinges()[f][k]; h >= 0) {
      angle[k] = curvature.hinges[static_cast<std::size_t>(h)].angle;
      area += curvature.hinges[static_cast<std::size_t>(h)].area;
    }
  auto lengths = curvature.faces[f];
  if (curvature.first_argument) addAreaSlope(face, area, lengths);
  auto element = lengthElement(face, lengths);
  addFoldElement(face, angle, element);
  return element;
}

void addFace(const std::array<LowerSlot, 6>& slots, const FaceElement& element, SymmetricBlockMatrix& hessian) {
  for (std::size_t i = 0; i < 3; ++i) addBlock(slots[i], element.diagonal(i), hessian);
  for (std::size_t k = 0; k < 3; ++k) addBlock(slots[3 + k], element.between[k], hessian);
}

/// Second derivative in a shape that is only ever deformed: the angle alone enters.
void addDeformedHinge(const std::array<LowerSlot, 10>& slots, const HingeGeometry& geometry, double angle_angle,
                      SymmetricBlockMatrix& hessian) {
  const auto angle = geometry.angleGradient();
  for (const auto& slot : slots) {
    const Eigen::Vector3d column = angle_angle * angle[slot.column];
    addOuter(angle[slot.row], column, hessian.block(slot.slot));
  }
}

/// The quadratic form in angle, length and area, and the edge length's own curvature.
void addUndeformedHinge(const std::array<LowerSlot, 10>& slots, const HingeGeometry& geometry, const HingeCurvature& c,
                        SymmetricBlockMatrix& hessian) {
  const auto angle = geometry.angleGradient(), length = geometry.lengthGradient(), area = geometry.areaGradient();
  HingeGeometry::Gradient by_angle, by_length, by_area;
  for (std::size_t j = 0; j < 4; ++j) {
    by_angle[j] = c.angle_angle * angle[j] + c.angle_length * length[j] + c.angle_area * area[j];
    by_length[j] = c.angle_length * angle[j] + c.length_length * length[j] + c.length_area * area[j];
    by_area[j] = c.angle_area * angle[j] + c.length_area * length[j] + c.area_area * area[j];
  }
  for (const auto& slot : slots) {
    double* block = hessian.block(slot.slot);
    addOuter(angle[slot.row], by_angle[slot.column], block);
    addOuter(length[slot.row], by_length[slot.column], block);
    addOuter(area[slot.row], by_area[slot.column], block);
  }
  constexpr std::array<std::size_t, 3> edge_blocks{0, 1, 4};  // (0,0) (1,1) (1,0)
  for (const auto p : edge_blocks)
    Eigen::Map<Eigen::Matrix3d>(hessian.block(slots[p].slot)).diagonal().array() += (p < 2 ? 2 : -2) * c.length;
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
  addEdgeForces(topology, shape, measures.edge, gradient);
  for (Eigen::Index f = 0; f < topology.faces().rows(); ++f) {
    const auto folds = atEdges(topology, static_cast<std::size_t>(f), measures.hinge.data());
    const auto forces = faceForces(FaceGeometry(topology.faces(), f, shape), measures.area[f], folds);
    for (int i = 0; i < 3; ++i) gradient.row(topology.faces()(f, i)) += forces[static_cast<std::size_t>(i)];
  }
}

void pullBackHessian(const ShellStructure& structure, const Vertices& shape, const MeasureCurvature& curvature,
                     SymmetricBlockMatrix& hessian) {
  const auto& topology = structure.topology();
  for (std::size_t f = 0; f < curvature.faces.size(); ++f)
    addFace(structure.faceSlots()[f], faceElement(topology, shape, curvature, f), hessian);
  const auto& hinges = topology.hinges();
  for (std::size_t h = 0; h < hinges.size(); ++h) {
    const HingeGeometry geometry(hinges[h], shape);
    if (curvature.first_argument)
      addUndeformedHinge(structure.hingeSlots()[h], geometry, curvature.hinges[h], hessian);
    else
      addDeformedHinge(structure.hingeSlots()[h], geometry, curvature.hinges[h].angle_angle, hessian);
  }
}

}  // namespace shaped
