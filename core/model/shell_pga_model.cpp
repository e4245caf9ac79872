#include "core/model/shell_pga_model.h"

#include <Eigen/Geometry>
#include <set>

#include "core/numerics/error.h"
#include "core/surface/closest_point.h"

namespace shaped {
namespace {

std::shared_ptr<const GeodesicCalculus> calculusOf(const ShellPgaParts& parts) {
  return std::make_shared<GeodesicCalculus>(std::make_shared<ShellStructure>(parts.coarsening.coarse),
                                            PairEnergy(parts.bending, parts.symmetry));
}

std::shared_ptr<const Prolongation> prolongationOf(const ShellPgaParts& parts) {
  return std::make_shared<const Prolongation>(parts.topology, parts.coarsening, parts.reference, parts.detail);
}

/// The largest triangle around a coarse vertex: its frame is the steadiest.
std::int32_t largestFaceAt(const Faces& faces, const Vertices& shape, std::int32_t vertex) {
  std::int32_t best = -1;
  double largest = -1;
  for (std::int32_t f = 0; f < faces.rows(); ++f) {
    if (faces(f, 0) != vertex && faces(f, 1) != vertex && faces(f, 2) != vertex) continue;
    const Eigen::RowVector3d a = shape.row(faces(f, 1)) - shape.row(faces(f, 0));
    const double area = a.cross(Eigen::RowVector3d(shape.row(faces(f, 2)) - shape.row(faces(f, 0)))).norm();
    if (area > largest) largest = area, best = f;
  }
  return best;
}

std::size_t bytesOf(const ShellPga& pga) {
  const auto numbers = pga.mean.size() + pga.eigenvalues.size() + pga.eigenvectors.size();
  return sizeof(double) * static_cast<std::size_t>(numbers) + pga.variations.bytes();
}

/// Each face with its edges and hinges, and the edges.
std::size_t bytesOf(const TopologyPtr& topology) {
  return sizeof(std::int32_t) * (9 * static_cast<std::size_t>(topology->faces().rows()) + 2 * topology->edges().size());
}

}  // namespace

ShellPgaModel::ShellPgaModel(ShellPgaParts parts)
    : ShellPgaModel(std::make_shared<const ShellPgaParts>(std::move(parts)), nullptr, nullptr) {}

ShellPgaModel::ShellPgaModel(ShellPgaParts parts, std::shared_ptr<const GeodesicCalculus> calculus,
                             std::shared_ptr<const Prolongation> prolongation)
    : ShellPgaModel(std::make_shared<const ShellPgaParts>(std::move(parts)), std::move(calculus),
                    std::move(prolongation)) {}

ShellPgaModel::ShellPgaModel(std::shared_ptr<const ShellPgaParts> parts,
                             std::shared_ptr<const GeodesicCalculus> calculus,
                             std::shared_ptr<const Prolongation> prolongation)
    : parts_(std::move(parts)),
      submanifold_(std::make_shared<const Submanifold>(calculus ? std::move(calculus) : calculusOf(*parts_),
                                                       std::shared_ptr<const ShellPga>(parts_, &parts_->pga))),
      prolongation_(prolongation ? std::move(prolongation) : prolongationOf(*parts_)),
      mean_(prolongation_->prolongate(parts_->pga.mean)),
      coarse_reference_(restrictTo(parts_->coarsening, parts_->reference)),
      coarse_template_(restrictTo(parts_->coarsening, parts_->template_shape)) {}

ShellPgaModelPtr ShellPgaModel::withRecord(const TrainingRecord& record) const {
  auto parts = *parts_;
  parts.training = record;
  return std::make_shared<const ShellPgaModel>(std::move(parts), submanifold_->calculusPtr(), prolongation_);
}

std::size_t ShellPgaModel::bytes() const {
  std::size_t numbers = 0;
  for (const auto* shape : {&parts_->template_shape, &parts_->reference, &mean_, &coarse_reference_, &coarse_template_})
    numbers += static_cast<std::size_t>(shape->size());
  return numbers * sizeof(double) + bytesOf(parts_->pga) + bytesOf(parts_->topology) +
         bytesOf(parts_->coarsening.coarse) + bytesOf(parts_->detail) + prolongation_->bytes() + submanifold_->bytes();
}

Vertices ShellPgaModel::restrict(const Vertices& shape, const std::string& field) const {
  requireValidShape(topology(), shape, field);
  Vertices coarse = restrictTo(parts_->coarsening, shape);
  requireValidShape(*parts_->coarsening.coarse, coarse, field + " on the model's coarse mesh");
  return coarse;
}

Anchor ShellPgaModel::anchorOfPoint(const Eigen::Vector3d& point) const {
  const auto& faces = parts_->coarsening.coarse->faces();
  const auto nearest = ClosestPointQuery(coarse_template_, faces)(point.transpose());
  return makeAnchor(faces, coarse_template_, nearest.face, Eigen::Vector3d(nearest.barycentric.transpose()), point);
}

Anchor ShellPgaModel::anchorOfVertex(std::int32_t vertex, const std::string& field) const {
  if (vertex < 0 || vertex >= topology().vertexCount())
    throw InvalidInput(field, "vertex " + std::to_string(vertex) + " is outside [0, " +
                                  std::to_string(topology().vertexCount()) + ")");
  const auto& kept = parts_->coarsening.kept;
  const auto at = std::lower_bound(kept.begin(), kept.end(), vertex);
  if (at == kept.end() || *at != vertex) return anchorOfPoint(parts_->template_shape.row(vertex));
  const auto coarse = static_cast<std::int32_t>(at - kept.begin());
  Anchor anchor;
  const auto& faces = parts_->coarsening.coarse->faces();
  anchor.face = largestFaceAt(faces, coarse_template_, coarse);
  for (int c = 0; c < 3; ++c) anchor.barycentric[c] = faces(anchor.face, c) == coarse ? 1 : 0;
  return anchor;
}

/// The surface point of an anchor, with what lies between it and the marker as an offset over the faces around.
MarkerSite ShellPgaModel::siteAt(const Anchor& anchor, const Eigen::Vector3d& marker) const {
  const auto& faces = parts_->coarsening.coarse->faces();
  MarkerSite site;
  site.skin = {anchor.face, anchor.barycentric, Eigen::Vector3d::Zero()};
  site.offset = marker - position(site.skin, faces, coarse_template_);
  std::set<std::int32_t> patch{faces(anchor.face, 0), faces(anchor.face, 1), faces(anchor.face, 2)};
  for (int ring = 0; ring < 2; ++ring) {
    const auto inner = patch;
    for (Eigen::Index f = 0; f < faces.rows(); ++f)
      for (int c = 0; c < 3; ++c)
        if (inner.contains(faces(f, c))) patch.insert({faces(f, 0), faces(f, 1), faces(f, 2)});
  }
  site.patch.assign(patch.begin(), patch.end());
  site.patch_template = coarse_template_(site.patch, Eigen::all);
  return site;
}

std::vector<MarkerSite> ShellPgaModel::sitesOf(const MarkerSet& markers) const {
  std::vector<MarkerSite> sites;
  for (std::size_t l = 0; l < markers.markers.size(); ++l) {
    const auto& marker = markers.markers[l];
    const std::string field = "markers[" + std::to_string(l) + "] (" + marker.label + ")";
    if (marker.vertex >= 0) {
      const Anchor anchor = anchorOfVertex(marker.vertex, field);
      sites.push_back(siteAt(anchor, parts_->template_shape.row(marker.vertex).transpose() + marker.offset));
      continue;
    }
    if (marker.face < 0 || marker.face >= topology().faces().rows())
      throw InvalidInput(field, "face " + std::to_string(marker.face) + " is outside [0, " +
                                    std::to_string(topology().faces().rows()) + ")");
    Eigen::Vector3d skin = Eigen::Vector3d::Zero();
    for (int c = 0; c < 3; ++c)
      skin += marker.barycentric[c] * parts_->template_shape.row(topology().faces()(marker.face, c)).transpose();
    sites.push_back(siteAt(anchorOfPoint(skin), skin + marker.offset));
  }
  return sites;
}

ShellStructurePtr ShellPgaModel::fineStructure(const std::stop_token& stop) const {
  return fine_structure_.get(
      stop, [this](const std::stop_token& until) { return ShellStructure::make(parts_->topology, until); });
}

std::shared_ptr<const Submanifold> ShellPgaModel::fineSubmanifold(const std::stop_token& stop) const {
  return fine_submanifold_.get(stop, [this](const std::stop_token& until) { return makeFineSubmanifold(until); });
}

std::shared_ptr<const Submanifold> ShellPgaModel::makeFineSubmanifold(const std::stop_token& stop) const {
  auto structure = fineStructure(stop);
  if (!structure) return nullptr;
  ShellPga fine = parts_->pga;  // shares the variations
  fine.mean = mean_;
  const auto refine = [prolongation = prolongation_](const Vertices& coarse) {
    return prolongation->prolongate(coarse);
  };
  auto calculus =
      std::make_shared<GeodesicCalculus>(std::move(structure), PairEnergy(parts_->bending, parts_->symmetry));
  return std::make_shared<Submanifold>(std::move(calculus), std::make_shared<ShellPga>(std::move(fine)), refine);
}

}  // namespace shaped
