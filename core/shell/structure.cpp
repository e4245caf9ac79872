#include "core/shell/structure.h"

#include <Eigen/Geometry>

namespace shaped {
namespace {

using StencilPair = std::array<std::uint8_t, 2>;

constexpr std::array<StencilPair, 6> kFacePairs{{{0, 0}, {1, 1}, {2, 2}, {2, 1}, {0, 2}, {1, 0}}};
constexpr std::array<StencilPair, 10> kHingePairs{
    {{0, 0}, {1, 1}, {2, 2}, {3, 3}, {1, 0}, {2, 0}, {3, 0}, {2, 1}, {3, 1}, {3, 2}}};

BlockPatternPtr makePattern(const Topology& topology) {
  std::vector<std::vector<std::int32_t>> stencils;
  for (const auto& hinge : topology.hinges()) stencils.emplace_back(hinge.vertices.begin(), hinge.vertices.end());
  for (Eigen::Index f = 0; f < topology.faces().rows(); ++f)
    stencils.push_back({topology.faces()(f, 0), topology.faces()(f, 1), topology.faces()(f, 2)});
  return std::make_shared<BlockPattern>(topology.vertexCount(), stencils);
}

template <class Stencil>
LowerSlot lowerSlot(const BlockPattern& pattern, const Stencil& vertices, StencilPair pair) {
  const auto [i, j] = pair;
  if (vertices[i] >= vertices[j]) return {pattern.lowerSlot(vertices[i], vertices[j]), i, j, false};
  return {pattern.lowerSlot(vertices[j], vertices[i]), j, i, true};
}

}  // namespace

ShellStructure::ShellStructure(TopologyPtr topology)
    : ShellStructure(topology, std::make_shared<CholeskyAnalysis>(makePattern(*topology))) {}

ShellStructurePtr ShellStructure::make(TopologyPtr topology, const std::stop_token& stop) {
  if (stop.stop_requested()) return nullptr;
  auto analysis = CholeskyAnalysis::make(makePattern(*topology), stop);
  if (!analysis) return nullptr;
  return ShellStructurePtr(new ShellStructure(std::move(topology), std::move(analysis)));
}

ShellStructure::ShellStructure(TopologyPtr topology, CholeskyAnalysisPtr analysis)
    : topology_(std::move(topology)), analysis_(std::move(analysis)) {
  const auto& blocks = *pattern();
  face_slots_.resize(static_cast<std::size_t>(topology_->faces().rows()));
  face_general_slots_.resize(face_slots_.size());
  for (std::size_t f = 0; f < face_slots_.size(); ++f) {
    const auto v = topology_->faces().row(static_cast<Eigen::Index>(f));
    for (std::size_t k = 0; k < 6; ++k) face_slots_[f][k] = lowerSlot(blocks, v, kFacePairs[k]);
    for (int r = 0; r < 3; ++r)
      for (int c = 0; c < 3; ++c) face_general_slots_[f][static_cast<std::size_t>(3 * r + c)] = blocks.slot(v[r], v[c]);
  }
  const auto& hinges = topology_->hinges();
  hinge_slots_.resize(hinges.size());
  hinge_general_slots_.resize(hinges.size());
  for (std::size_t h = 0; h < hinges.size(); ++h) {
    const auto& v = hinges[h].vertices;
    for (std::size_t k = 0; k < 10; ++k) hinge_slots_[h][k] = lowerSlot(blocks, v, kHingePairs[k]);
    for (std::size_t r = 0; r < 4; ++r)
      for (std::size_t c = 0; c < 4; ++c) hinge_general_slots_[h][4 * r + c] = blocks.slot(v[r], v[c]);
  }
}

Pins gaugePins(const Vertices& shape) {
  Pins pins(static_cast<std::int32_t>(shape.rows()));
  const Eigen::RowVector3d centre = shape.colwise().mean();
  Eigen::Index first, second, third;
  (shape.rowwise() - centre).rowwise().squaredNorm().maxCoeff(&first);
  (shape.rowwise() - shape.row(first)).rowwise().squaredNorm().maxCoeff(&second);
  const Eigen::RowVector3d axis = shape.row(second) - shape.row(first);
  double widest = -1;
  third = first;
  for (Eigen::Index v = 0; v < shape.rows(); ++v) {
    const double width = axis.cross(Eigen::RowVector3d(shape.row(v) - shape.row(first))).squaredNorm();
    if (width > widest) widest = width, third = v;
  }
  pins.pinAll(static_cast<std::int32_t>(first));
  int along, normal;
  axis.cwiseAbs().maxCoeff(&along);
  for (int k = 0; k < 3; ++k)
    if (k != along) pins.pin(static_cast<std::int32_t>(second), k);
  axis.cross(Eigen::RowVector3d(shape.row(third) - shape.row(first))).cwiseAbs().maxCoeff(&normal);
  pins.pin(static_cast<std::int32_t>(third), normal);
  return pins;
}

}  // namespace shaped
