#include "core/geodesic/length_angle.h"

#include <Eigen/Dense>

#include "core/mesh/alignment.h"
#include "core/numerics/long_piece.h"
#include "core/numerics/scalar_cholesky.h"

namespace shaped {
namespace {

using Frame = Eigen::Matrix3d;
using Layout = Eigen::Matrix<double, 3, 2>;  ///< a triangle's corners in its plane

/// Corner 0 at the origin, corner 1 on the x axis.
Layout layOut(const std::array<double, 3>& squared_length) {
  const double along = std::sqrt(squared_length[2]);  // edge 2 joins corners 0 and 1
  const double x = (squared_length[1] + squared_length[2] - squared_length[0]) / (2 * along);
  const double y = std::sqrt(std::max(squared_length[1] - x * x, 1e-6 * squared_length[1]));
  Layout corners;
  corners << 0, 0, along, 0, x, y;
  return corners;
}

Frame frameOf(const Topology& topology, const Vertices& shape, Eigen::Index f) {
  const auto v = topology.faces().row(f);
  const Eigen::Vector3d a = shape.row(v[1]) - shape.row(v[0]), b = shape.row(v[2]) - shape.row(v[0]);
  Frame frame;
  frame.col(0) = a.normalized();
  frame.col(2) = a.cross(b).normalized();
  frame.col(1) = frame.col(2).cross(frame.col(0));
  return frame;
}

Frame nearestRotation(const Eigen::Matrix3d& matrix) {
  const Eigen::JacobiSVD<Eigen::Matrix3d> svd(matrix, Eigen::ComputeFullU | Eigen::ComputeFullV);
  Eigen::Matrix3d u = svd.matrixU();
  if ((u * svd.matrixV().transpose()).determinant() < 0) u.col(2) = -u.col(2);
  return u * svd.matrixV().transpose();
}

Eigen::Matrix3d turnInPlane(const Eigen::Vector2d& direction) {
  const Eigen::Vector2d d = direction.normalized();
  Eigen::Matrix3d turn;
  turn << d.x(), -d.y(), 0, d.y(), d.x(), 0, 0, 0, 1;
  return turn;
}

BlockPatternPtr facePattern(const Topology& topology) {
  std::vector<std::vector<std::int32_t>> stencils;
  for (const auto& hinge : topology.hinges()) stencils.push_back({hinge.faces[0], hinge.faces[1]});
  return std::make_shared<BlockPattern>(static_cast<std::int32_t>(topology.faces().rows()), stencils);
}

void addTo(double* block, const Eigen::Matrix3d& value) { Eigen::Map<Eigen::Matrix3d>(block).noalias() += value; }

/// Positions whose edges agree best with each face's rotated planar layout. Empty when the equations could not be
/// solved, or the stop token has fired.
Vertices integrate(const Topology& topology, const std::vector<Layout>& layouts, const std::vector<Frame>& frames,
                   const std::stop_token& stop) {
  std::vector<Eigen::Triplet<double>> entries;
  Vertices rhs = Vertices::Zero(topology.vertexCount(), 3);
  for (Eigen::Index f = 0; f < topology.faces().rows(); ++f) {
    const auto v = topology.faces().row(f);
    const auto& p = layouts[static_cast<std::size_t>(f)];
    for (int c = 0; c < 3; ++c) {
      const int i = (c + 1) % 3, j = (c + 2) % 3;
      const Eigen::Vector2d edge = p.row(j) - p.row(i), a = p.row(i) - p.row(c), b = p.row(j) - p.row(c);
      const double cotangent = a.dot(b) / std::max(std::abs(a.x() * b.y() - a.y() * b.x()), 1e-12);
      const double weight = std::clamp(cotangent, 0.05, 20.0);
      const Eigen::Vector3d wanted = frames[static_cast<std::size_t>(f)].leftCols<2>() * edge;
      rhs.row(v[j]) += weight * wanted;
      rhs.row(v[i]) -= weight * wanted;
      entries.emplace_back(v[i], v[i], weight);
      entries.emplace_back(v[j], v[j], weight);
      entries.emplace_back(v[i], v[j], -weight);
      entries.emplace_back(v[j], v[i], -weight);
    }
  }
  entries.emplace_back(0, 0, 1);  // the translation
  Eigen::SparseMatrix<double> laplacian(topology.vertexCount(), topology.vertexCount());
  laplacian.setFromTriplets(entries.begin(), entries.end());
  ScalarCholesky solver;
  if (!solver.compute(laplacian, stop)) return {};
  return solver.solve(rhs);
}

/// sum over hinges of |F_g - F_f R|^2: rows of the frames are independent, so three right-hand sides share the matrix.
SymmetricBlockMatrix connectionLaplacian(const Topology& topology, const BlockPatternPtr& pattern,
                                         const std::vector<std::array<std::int32_t, 2>>& corners,
                                         const Eigen::VectorXd& angles, const std::vector<Layout>& layouts) {
  SymmetricBlockMatrix laplacian(pattern);
  const auto& hinges = topology.hinges();
  for (std::size_t h = 0; h < hinges.size(); ++h) {
    const auto f = hinges[h].faces[0], g = hinges[h].faces[1];
    const auto& pf = layouts[static_cast<std::size_t>(f)];
    const auto& pg = layouts[static_cast<std::size_t>(g)];
    const auto cf = corners[h][0], cg = corners[h][1];
    const Eigen::Vector2d along_f = pf.row((cf + 1) % 3) - pf.row(cf);  // v0 -> v1 in the first face
    const Eigen::Vector2d along_g = pg.row((cg + 2) % 3) - pg.row(cg);  // v0 -> v1 in the second face
    const Eigen::Matrix3d fold =
        Eigen::AngleAxisd(angles[static_cast<Eigen::Index>(h)], Eigen::Vector3d::UnitX()).toRotationMatrix();
    const Eigen::Matrix3d transition = turnInPlane(along_f) * fold * turnInPlane(along_g).transpose();
    addTo(laplacian.block(pattern->lowerSlot(f, f)), Eigen::Matrix3d::Identity());
    addTo(laplacian.block(pattern->lowerSlot(g, g)), Eigen::Matrix3d::Identity());
    // with columns y_f = (row of F_f)^T the coupling is -(y_g . R^T y_f)
    if (g > f)
      addTo(laplacian.block(pattern->lowerSlot(g, f)), -transition.transpose());
    else
      addTo(laplacian.block(pattern->lowerSlot(f, g)), -transition);
  }
  constexpr double shift = 1e-6;  // keeps the matrix definite; inverse iteration does not mind
  for (std::int32_t f = 0; f < pattern->nodeCount(); ++f)
    addTo(laplacian.block(pattern->lowerBegin(f)), shift * Eigen::Matrix3d::Identity());
  return laplacian;
}

/// Brings the frames into the smallest eigenspace by inverse iteration; false once the stop token has fired.
bool iterate(const CholeskyFactor& factor, std::vector<Frame>& frames, const std::stop_token& stop) {
  Eigen::MatrixXd rows(3 * static_cast<Eigen::Index>(frames.size()), 3);
  for (int sweep = 0; sweep < 3; ++sweep) {
    for (std::size_t f = 0; f < frames.size(); ++f)
      rows.middleRows<3>(3 * static_cast<Eigen::Index>(f)) = frames[f].transpose();
    if (stop.stop_requested()) return false;
    factor.solve(rows.data(), rows.data(), 3, stop);
    for (std::size_t f = 0; f < frames.size() && !stop.stop_requested(); ++f)
      frames[f] = nearestRotation(rows.middleRows<3>(3 * static_cast<Eigen::Index>(f)).transpose());
  }
  return !stop.stop_requested();
}

}  // namespace

LengthAngleReconstruction::LengthAngleReconstruction(TopologyPtr topology) : topology_(std::move(topology)) {
  for (const auto& hinge : topology_->hinges()) {
    std::array<std::int32_t, 2> starts{};
    for (std::size_t s = 0; s < 2; ++s)
      for (int c = 0; c < 3; ++c)
        if (topology_->faces()(hinge.faces[s], c) == hinge.vertices[0]) starts[s] = c;
    corners_.push_back(starts);
  }
}

Vertices LengthAngleReconstruction::reconstruct(const ShellMeasures& wanted, const Vertices& near,
                                                const std::stop_token& stop) const {
  const auto analysis = analysis_.get(
      stop, [&](const std::stop_token& until) { return CholeskyAnalysis::make(facePattern(*topology_), until); });
  if (!analysis) return {};
  const auto face_count = static_cast<std::size_t>(topology_->faces().rows());
  std::vector<Layout> layouts(face_count);
  std::vector<Frame> frames(face_count);
  for (std::size_t f = 0; f < face_count; ++f) {
    const auto& e = topology_->faceEdges()[f];
    layouts[f] = layOut({wanted.squared_length[e[0]], wanted.squared_length[e[1]], wanted.squared_length[e[2]]});
    frames[f] = frameOf(*topology_, near, static_cast<Eigen::Index>(f));
  }
  if (stop.stop_requested()) return {};
  const auto laplacian = connectionLaplacian(*topology_, analysis->pattern(), corners_, wanted.angle, layouts);
  CholeskyFactor factor(analysis);
  if (!factor.factorise(laplacian, Pins(static_cast<std::int32_t>(face_count)), stop)) return {};
  if (!iterate(factor, frames, stop)) return {};
  const Vertices shape = integrate(*topology_, layouts, frames, stop);
  return shape.rows() > 0 && shape.allFinite() ? apply(alignRigidly(shape, near), shape) : Vertices();
}

ShellMeasures blendMeasures(const ShellMeasures& a, const ShellMeasures& b, double t) {
  ShellMeasures blend;
  blend.squared_length = (a.squared_length.array().log() * (1 - t) + b.squared_length.array().log() * t).exp();
  blend.angle.resize(a.angle.size());
  for (Eigen::Index h = 0; h < a.angle.size(); ++h)
    blend.angle[h] = a.angle[h] + t * angleDifference(b.angle[h], a.angle[h]);
  return blend;
}

}  // namespace shaped
