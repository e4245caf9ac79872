#include "core/neural/jacobian_field_features.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <string>

#include "core/mesh/quality.h"
#include "core/numerics/error.h"
#include "core/surface/point_tree.h"
#include "core/surface/wave_kernel_signature.h"

namespace shaped {
namespace {

constexpr int kEigenfunctions = 200, kSignatureFunctions = 100;
/// Of the extent: offsets of a good fit are about 1 in this unit.
constexpr double kOffsetUnit = 0.01;
/// Of that unit: how far a scan's hole is from the source says nothing.
constexpr double kLargestOffset = 10;
/// Points of a scan whose mean a vertex is pulled to: their noise is a third of a single one's.
constexpr std::size_t kPulledBy = 8;
/// Of the extent.
constexpr double kFarthestPull = 0.05;
/// In deviations. Fingertips reach 20, and would drown all else that a network sees.
constexpr float kLargestSignature = 5;
/// Of the mean: signatures that are the same all over say nothing, and must not be magnified.
constexpr float kLeastDeviation = 1e-3F;

/// The mean of each triangle's corners, F x columns.
template <class Rows>
Rows meansOfCorners(const Faces& faces, const Rows& vertices) {
  Rows means(faces.rows(), vertices.cols());
  for (Eigen::Index f = 0; f < faces.rows(); ++f)
    means.row(f) = (vertices.row(faces(f, 0)) + vertices.row(faces(f, 1)) + vertices.row(faces(f, 2))) / 3;
  return means;
}

/// Nothing once the token has fired.
std::optional<SurfaceSpectrum> spectrumOf(const Topology& topology, const Vertices& shape,
                                          const std::stop_token& stop) {
  SpectrumOptions options;
  options.count = std::min<int>(kEigenfunctions, topology.vertexCount());
  auto spectrum = surfaceSpectrum(topology, shape, options, stop);
  if (spectrum.termination == Termination::kCancelled) return std::nullopt;
  if (!spectrum.converged())
    throw InvalidInput("reference", "has triangles too thin to find the eigenfunctions of its Laplacian; repair it");
  return std::move(spectrum.solution);
}

Eigen::MatrixXf signaturesOf(const Faces& faces, const SurfaceSpectrum& spectrum) {
  const auto count = std::min<Eigen::Index>(kSignatureFunctions, spectrum.eigenvalues.size());
  const SurfaceSpectrum lowest{spectrum.eigenvalues.head(count), spectrum.eigenfunctions.leftCols(count),
                               spectrum.areas};
  const Eigen::MatrixXd signatures = waveKernelSignature(lowest, {.energies = kFieldSignatures});
  return meansOfCorners(faces, signatures).cast<float>();
}

void requireScan(const Scan& scan) {
  if (scan.points.rows() == 0) throw InvalidInput("scan.points", "are none; a field needs at least one");
  if (!scan.points.allFinite()) throw InvalidInput("scan.points", "hold a coordinate that is not a finite number");
  if (scan.normals.rows() != 0 && scan.normals.rows() != scan.points.rows())
    throw InvalidInput("scan.normals", "are " + std::to_string(scan.normals.rows()) + ", want none or " +
                                           std::to_string(scan.points.rows()) + ", one a point");
  if (!scan.normals.allFinite()) throw InvalidInput("scan.normals", "hold a number that is not finite");
}

Eigen::MatrixXf trianglesOf(const FieldReference& reference, const Vertices& source, const Vertices& centroids,
                            const FieldScaling& scaling) {
  const auto& faces = reference.poisson->topology().faces();
  Eigen::MatrixXf inputs(faces.rows(), kTriangleInputs);
  inputs.leftCols<3>() = ((centroids.rowwise() - scaling.centre) / scaling.extent).cast<float>();
  inputs.middleCols<3>(3) = faceNormals(faces, source).cast<float>();
  const Eigen::ArrayXXf centred = reference.signatures.rowwise() - scaling.signature_mean;
  inputs.rightCols<kFieldSignatures>() =
      (centred.rowwise() / scaling.signature_deviation.array()).min(kLargestSignature).max(-kLargestSignature);
  return inputs;
}

Eigen::MatrixXf scanInputs(const Scan& scan, const FieldScaling& scaling) {
  Eigen::MatrixXf inputs = Eigen::MatrixXf::Zero(scan.points.rows(), kScanInputs);
  inputs.leftCols<3>() = ((scan.points.rowwise() - scaling.centre) / scaling.extent).cast<float>();
  if (scan.normals.rows() != 0) inputs.rightCols<3>() = scan.normals.rowwise().normalized().cast<float>();
  return inputs;
}

/// The source with every vertex moved along its normal to the mean of the scan's points about it, V x 3.
Vertices pulledToScan(const PointTree& tree, const Faces& faces, const Vertices& source, double farthest) {
  const Vertices normals = vertexNormals(faces, source);
  std::array<NearPoint, kPulledBy> near{};
  Vertices pulled = source;
  for (Eigen::Index v = 0; v < source.rows(); ++v) {
    const auto found = tree.nearest(source.row(v), near);
    double offset = 0;
    for (std::size_t i = 0; i < found; ++i)
      offset += normals.row(v).dot(tree.points().row(near[i].index) - source.row(v)) / static_cast<double>(found);
    pulled.row(v) += std::clamp(offset, -farthest, farthest) * normals.row(v);
  }
  return pulled;
}

void lookUpNearest(const PointTree& tree, const Scan& scan, const Vertices& centroids, double unit,
                   JacobianFieldFeatures& features) {
  features.nearest.resize(static_cast<std::size_t>(centroids.rows()));
  features.offsets = Eigen::MatrixXf::Zero(centroids.rows(), kOffsetInputs);
  for (Eigen::Index f = 0; f < centroids.rows(); ++f) {
    const auto point = tree.nearest(centroids.row(f)).index;
    features.nearest[static_cast<std::size_t>(f)] = point;
    const Eigen::RowVector3d offset = (scan.points.row(point) - centroids.row(f)) / unit;
    features.offsets.row(f).head<3>() = (offset * std::min(1.0, kLargestOffset / offset.norm())).cast<float>();
    if (scan.normals.rows() == 0) continue;
    features.offsets.row(f).segment<3>(3) =
        features.scan.row(point).tail<3>() - features.triangles.row(f).segment<3>(3);
  }
}

}  // namespace

std::optional<FieldReference> makeFieldReference(TopologyPtr topology, const Vertices& shape,
                                                 const std::stop_token& stop) {
  requireValidShape(*topology, shape, "reference");
  auto poisson = JacobianPoisson::make(topology, shape, stop);
  if (!poisson) return std::nullopt;
  auto spectrum = spectrumOf(*topology, shape, stop);
  if (!spectrum) return std::nullopt;
  Eigen::MatrixXf signatures = signaturesOf(topology->faces(), *spectrum);
  return FieldReference{shape, std::move(poisson), std::move(*spectrum), std::move(signatures)};
}

FieldScaling scalingOf(const FieldReference& reference) {
  FieldScaling scaling;
  scaling.centre = (reference.shape.colwise().minCoeff() + reference.shape.colwise().maxCoeff()) / 2;
  scaling.extent = boundingBoxDiagonal(reference.shape) / 2;
  const Eigen::RowVectorXf shares =
      (reference.poisson->areas() / reference.poisson->areas().sum()).transpose().cast<float>();
  scaling.signature_mean = shares * reference.signatures;
  const Eigen::MatrixXf centred = reference.signatures.rowwise() - scaling.signature_mean;
  scaling.signature_deviation =
      (shares * centred.cwiseAbs2()).cwiseSqrt().cwiseMax(kLeastDeviation * scaling.signature_mean);
  return scaling;
}

void requireScaling(const FieldScaling& scaling) {
  if (!scaling.centre.allFinite() || !std::isfinite(scaling.extent) || scaling.extent <= 0)
    throw InvalidInput("scaling.extent", "is " + std::to_string(scaling.extent) + ", want a length > 0 and a centre");
  if (scaling.signature_mean.size() != kFieldSignatures || scaling.signature_deviation.size() != kFieldSignatures)
    throw InvalidInput("scaling.signature_mean",
                       "and the deviation want " + std::to_string(kFieldSignatures) + " numbers each");
  if (!scaling.signature_mean.allFinite() || !scaling.signature_deviation.allFinite() ||
      scaling.signature_deviation.minCoeff() <= 0)
    throw InvalidInput("scaling.signature_deviation", "and the mean must be finite, the deviation > 0");
}

JacobianFieldFeatures jacobianFieldFeatures(const FieldReference& reference, const Vertices& source, const Scan& scan,
                                            const FieldScaling& scaling) {
  requireScan(scan);
  requireScaling(scaling);
  if (source.rows() != reference.shape.rows())
    throw InvalidInput("source", "has " + std::to_string(source.rows()) + " vertices, want " +
                                     std::to_string(reference.shape.rows()) + ", as the reference has");
  if (!source.allFinite()) throw InvalidInput("source", "holds a coordinate that is not a finite number");
  const Vertices centroids = meansOfCorners(reference.poisson->topology().faces(), source);
  JacobianFieldFeatures features;
  features.triangles = trianglesOf(reference, source, centroids, scaling);
  features.current = reference.poisson->jacobians(source);
  features.centroids = reference.poisson->centroids(source);
  features.scan = scanInputs(scan, scaling);
  const PointTree tree(scan.points);
  lookUpNearest(tree, scan, centroids, kOffsetUnit * scaling.extent, features);
  const auto pulled = pulledToScan(tree, reference.poisson->topology().faces(), source, kFarthestPull * scaling.extent);
  features.offsets.rightCols<9>() = (reference.poisson->jacobians(pulled) - features.current).cast<float>();
  return features;
}

}  // namespace shaped
