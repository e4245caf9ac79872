#pragma once

#include <Eigen/Core>
#include <memory>
#include <optional>
#include <stop_token>
#include <vector>

#include "core/mesh/scan.h"
#include "core/neural/jacobian_poisson.h"
#include "core/surface/spectrum.h"

namespace shaped {

/// Wave kernel signatures of a triangle that a field sees.
constexpr int kFieldSignatures = 50;
/// What a field's first PointNet sees of a triangle: centroid, normal, signatures.
constexpr int kTriangleInputs = 6 + kFieldSignatures;
/// What its second PointNet sees of a scan's point: position, normal.
constexpr int kScanInputs = 6;
/// Columns of JacobianFieldFeatures::offsets.
constexpr int kOffsetInputs = 15;

/// The shape that Jacobians of one topology's shapes are taken against: the mean of a model, or any template.
struct FieldReference {
  Vertices shape;                                  ///< V x 3 [m]
  std::shared_ptr<const JacobianPoisson> poisson;  ///< on that shape
  SurfaceSpectrum spectrum;                        ///< of that shape, 200 functions (all V where there are fewer)
  Eigen::MatrixXf signatures;                      ///< F x 50: wave kernel signatures, mean of each triangle's corners
};

/// Factorises the Poisson equation, finds the lowest eigenfunctions and computes signatures from the 100 lowest. They
/// are the reference's and stand in for those of every shape of its topology: signatures hardly change from one
/// identity to the next (they tell where on the body a triangle is), and an eigenproblem for each shape would cost more
/// than the field. Nothing once the stop token has fired. Throws InvalidInput naming `reference` when it is not a valid
/// shape of the topology, or its triangles are too thin for either.
std::optional<FieldReference> makeFieldReference(TopologyPtr topology, const Vertices& shape,
                                                 const std::stop_token& stop = {});

/// Constants that bring a field's inputs near 1. They are part of the trained model: another topology's reference is
/// seen by the same ones.
struct FieldScaling {
  Eigen::RowVector3d centre = Eigen::RowVector3d::Zero();  ///< [m]
  double extent = 1;                                       ///< [m], > 0; positions are (x - centre) / extent
  Eigen::RowVectorXf signature_mean;                       ///< 50
  Eigen::RowVectorXf signature_deviation;                  ///< 50, > 0
};

/// Centre of the reference's bounding box and half its diagonal; mean and deviation of its signatures, by area.
FieldScaling scalingOf(const FieldReference& reference);

/// Throws InvalidInput naming the constant that is missing, not finite or not positive.
void requireScaling(const FieldScaling& scaling);

/// What a field sees of a source shape and a scan [Muralikrishnan 2025, appendix B.4.1], before its networks.
struct JacobianFieldFeatures {
  Eigen::MatrixXf triangles;  ///< F x 56: the source's centroids and normals, signatures; scaled, those cut at 5
  Jacobians current;          ///< F x 9: of the source, relative to the reference
  Vertices centroids;         ///< C x 3: of the source's components [m]
  Eigen::MatrixXf scan;       ///< P x 6: the scan's points, scaled, and unit normals, 0 where unknown
  std::vector<std::int32_t> nearest;  ///< F: the scan's point nearest to each triangle's centroid
  /// F x 15: from the centroid to that point, in hundredths of the extent and cut at 10 of them; from the triangle's
  /// normal to the point's (0 where that is unknown); and how the current Jacobian changes when every vertex is moved
  /// along its normal to the mean of the 8 points nearest to it, by at most a twentieth of the extent.
  Eigen::MatrixXf offsets;
};

/// source: V x 3 of the reference's topology, in the rest pose [m]. scan: its points, in the same pose and place: who
/// has a scan in another pose carries its points back first, by inverse skinning with the pose that fitted it. Faces of
/// the scan are not looked at. Every point goes through a network, so a dense scan is best thinned to some 10,000.
///
/// Throws InvalidInput naming `source` (count of vertices, finite), `scan.points` (none, not finite), `scan.normals`
/// (another count, not finite) or `scaling`.
JacobianFieldFeatures jacobianFieldFeatures(const FieldReference& reference, const Vertices& source, const Scan& scan,
                                            const FieldScaling& scaling);

}  // namespace shaped
