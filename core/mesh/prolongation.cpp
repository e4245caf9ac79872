#include "core/mesh/prolongation.h"

#include <algorithm>
#include <functional>
#include <string>

#include "core/mesh/learned_detail.h"
#include "core/mesh/surface_neighbours.h"
#include "core/numerics/error.h"

namespace shaped {
namespace {

constexpr int kLearningNeighbours = 16;
constexpr int kPlateNeighbours = 7;

void checkCoarsening(const Topology& fine, const Coarsening& coarsening) {
  const auto& kept = coarsening.kept;
  if (!coarsening.coarse || static_cast<std::size_t>(coarsening.coarse->vertexCount()) != kept.size())
    throw InvalidInput("coarsening", "names another number of kept vertices than its topology has");
  if (!std::is_sorted(kept.begin(), kept.end(), std::less_equal<>()) || kept.front() < 0 ||
      kept.back() >= fine.vertexCount())
    throw InvalidInput("coarsening",
                       "kept vertices must ascend within [0, " + std::to_string(fine.vertexCount()) + ")");
  std::vector<char> met(static_cast<std::size_t>(fine.componentCount()), 0);
  for (const auto v : kept) met[fine.components()[v]] = 1;
  if (const auto missing = std::find(met.begin(), met.end(), 0); missing != met.end())
    throw InvalidInput("coarsening",
                       "keeps no vertex of component " + std::to_string(missing - met.begin()) + " of the fine mesh");
}

void checkTraining(const Topology& fine, const std::vector<Vertices>& training) {
  for (std::size_t s = 0; s < training.size(); ++s)
    requireValidShape(fine, training[s], "training[" + std::to_string(s) + "]");
}

/// Rotations and scale do not matter to the fit, but digits do: brings a sample to the origin.
DetailSample sampleOf(const Vertices& shape, const Coarsening& coarsening, const ThinPlate& plate) {
  const Vertices centred = shape.rowwise() - shape.colwise().mean();
  DetailSample sample{frameVectors(coarsening.coarse->faces(), restrictTo(coarsening, centred)), {}};
  sample.missing = centred - plate.solve(sample.frame);
  return sample;
}

}  // namespace

std::shared_ptr<const Prolongation> Prolongation::learn(const TopologyPtr& fine, Coarsening coarsening,
                                                        const Vertices& reference,
                                                        const std::vector<Vertices>& training,
                                                        const std::stop_token& stop) {
  checkCoarsening(*fine, coarsening);
  requireValidShape(*fine, reference, "reference");
  checkTraining(*fine, training);
  const auto neighbours = nearestMarked(*fine, reference, coarsening.kept, kLearningNeighbours, stop);
  if (stop.stop_requested()) return nullptr;
  auto plate = ThinPlate::make(*fine, coarsening, reference, neighbours, stop);
  if (!plate) return nullptr;
  std::vector<DetailSample> samples;
  for (const auto& shape : training) {
    if (stop.stop_requested()) return nullptr;
    samples.push_back(sampleOf(shape, coarsening, *plate));
  }
  auto detail = fitDetail(neighbours, sampleOf(reference, coarsening, *plate), samples, stop);
  if (!detail) return nullptr;
  return std::shared_ptr<const Prolongation>(
      new Prolongation(std::move(coarsening), std::move(plate), std::move(*detail)));
}

Prolongation::Prolongation(Coarsening coarsening, std::shared_ptr<const ThinPlate> plate, SparseRows detail)
    : coarsening_(std::move(coarsening)), plate_(std::move(plate)), detail_(std::move(detail)) {}

Prolongation::Prolongation(const TopologyPtr& fine, Coarsening coarsening, const Vertices& reference, SparseRows detail)
    : coarsening_(std::move(coarsening)), detail_(std::move(detail)) {
  checkCoarsening(*fine, coarsening_);
  requireValidShape(*fine, reference, "reference");
  if (detail_.rows() != fine->vertexCount() || detail_.cols() != 2 * coarsening_.coarse->vertexCount())
    throw InvalidInput("detail", "is " + std::to_string(detail_.rows()) + " x " + std::to_string(detail_.cols()) +
                                     ", want " + std::to_string(fine->vertexCount()) + " x " +
                                     std::to_string(2 * coarsening_.coarse->vertexCount()));
  const auto neighbours = nearestMarked(*fine, reference, coarsening_.kept, kPlateNeighbours);
  plate_ = ThinPlate::make(*fine, coarsening_, reference, neighbours);
}

Vertices Prolongation::prolongate(const Vertices& coarse) const {
  if (coarse.rows() != coarsening_.coarse->vertexCount())
    throw InvalidInput("coarse", "has " + std::to_string(coarse.rows()) + " vertices, want " +
                                     std::to_string(coarsening_.coarse->vertexCount()));
  if (!coarse.allFinite()) throw InvalidInput("coarse", "has a coordinate that is not a finite number");
  const Eigen::RowVector3d centre = coarse.colwise().mean();
  const Vertices frame = frameVectors(coarsening_.coarse->faces(), coarse.rowwise() - centre);
  return (plate_->solve(frame) + detail_ * frame).rowwise() + centre;
}

}  // namespace shaped
