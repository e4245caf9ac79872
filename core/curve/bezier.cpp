#include "core/curve/bezier.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <memory>
#include <mutex>
#include <utility>

#include "core/curve/path_enrichment.h"
#include "core/curve/reduced_path_flow.h"
#include "core/curve/reduced_path_newton.h"
#include "core/curve/travel.h"
#include "core/mesh/alignment.h"
#include "core/numerics/error.h"

namespace shaped {
namespace {

constexpr std::size_t kRough = 5;  ///< frames of the paths by which the subspace is enriched
/// Principal directions of the sides that are left out, of the largest singular value: what enrichments add is longer.
constexpr double kNegligible = 1e-3;

/// One geodesic of the construction as its ends move: the path at the latest t and at the one before.
class MovingGeodesic {
 public:
  MovingGeodesic(const GhostSpace& space, double bending, const ReducedPathOptions& options, PathCoordinates start)
      : space_(space), bending_(bending), options_(options), newton_(space, bending, options), now_(std::move(start)) {}

  /// Settles the path between these ends.
  Outcome moveTo(const Eigen::VectorXd& from, const Eigen::VectorXd& to) {
    auto next = now_;
    if (!earlier_.empty())
      for (std::size_t i = 0; i < next.size(); ++i) next[i] += 2 * now_[i] - 3 * before_[i] + earlier_[i];
    else if (!before_.empty())
      for (std::size_t i = 0; i < next.size(); ++i) next[i] += now_[i] - before_[i];
    const Eigen::VectorXd first = from - next.front(), last = to - next.back();
    for (std::size_t i = 0; i < next.size(); ++i) {
      const double share = static_cast<double>(i) / static_cast<double>(next.size() - 1);
      next[i] += (1 - share) * first + share * last;
    }
    next.front() = from;
    next.back() = to;
    const auto outcome =
        options_.solver == PathSolver::kNewton ? newton_.settle(next) : settleByFlow(space_, bending_, next, options_);
    earlier_ = std::exchange(before_, std::exchange(now_, std::move(next)));
    return outcome;
  }
  const PathCoordinates& path() const { return now_; }

 private:
  const GhostSpace& space_;
  double bending_;
  const ReducedPathOptions& options_;
  ReducedPathNewton newton_;
  PathCoordinates now_, before_, earlier_;
};

/// De Casteljau's triangle within one subspace, for growing t.
class Construction {
 public:
  /// sides: geodesics between neighbouring control shapes.
  Construction(const GhostSpace& space, double bending, const ReducedPathOptions& options,
               const std::vector<PathCoordinates>& sides)
      : space_(space), bending_(bending), options_(options), sides_(sides) {
    // At t = 0 every geodesic of a higher level lies on the side that it starts from.
    for (std::size_t count = sides.size(); count-- > 1;)
      for (std::size_t i = 0; i < count; ++i) inner_.emplace_back(space, bending, options, sides[i]);
  }

  /// The point at t.
  Solved<Eigen::VectorXd> at(double t) {
    Outcome outcome;
    std::vector<Solved<Eigen::VectorXd>> points;
    for (const auto& side : sides_) outcome += points.emplace_back(pointAt(side, t));
    for (std::size_t k = 0; points.size() > 1;) {
      std::vector<Solved<Eigen::VectorXd>> next(points.size() - 1);
      tbb::parallel_for(std::size_t{0}, next.size(), [&](std::size_t i) {
        auto& geodesic = inner_[k + i];
        Outcome moved = geodesic.moveTo(points[i].solution, points[i + 1].solution);
        next[i] = pointAt(geodesic.path(), t);
        moved += next[i];
        static_cast<Outcome&>(next[i]) = moved;
      });
      for (const auto& point : next) outcome += point;
      k += next.size();
      points = std::move(next);
    }
    return {std::move(points.front().solution), outcome};
  }
  std::vector<PathCoordinates> innerPaths() const {
    std::vector<PathCoordinates> paths;
    for (const auto& geodesic : inner_) paths.push_back(geodesic.path());
    return paths;
  }
  int geodesics() const { return static_cast<int>(inner_.size()); }

 private:
  Solved<Eigen::VectorXd> pointAt(const PathCoordinates& path, double t) const {
    auto point = pointOf(space_, bending_, path, t, options_);
    return {std::move(point.solution), {point.termination, 0, 0}};
  }

  const GhostSpace& space_;
  double bending_;
  const ReducedPathOptions& options_;
  const std::vector<PathCoordinates>& sides_;
  std::vector<MovingGeodesic> inner_;  ///< level by level
};

/// All steps of one curve.
class BezierRun {
 public:
  BezierRun(const ShellStructurePtr& structure, double bending, const std::vector<Vertices>& controls,
            const BezierOptions& options, const ProgressSink& progress)
      : structure_(structure),
        bending_(bending),
        controls_(controls),
        options_(options),
        settling_{options.geodesic.solver, options.geodesic.symmetry, options.geodesic.tolerance,
                  options.geodesic.steps, options.geodesic.stop},
        progress_(progress) {
    for (const auto& control : controls) {
      const auto motion = alignRigidly(control, controls.front());
      aligned_.push_back(apply(motion, control));
      stops_.push_back(inverse(motion));
    }
    const CoarseningOptions coarse{options.geodesic.ghost_vertices, {}, options.geodesic.stop};
    ghost_ = std::make_shared<const Coarsening>(coarsen(structure->topologyPtr(), aligned_, coarse));
  }

  Solved<BezierCurve> run() {
    Solved<BezierCurve> result({Curve{{controls_.front(), controls_.back()}, false}}, {});
    auto& curve = result.solution;
    const auto sides = computeSides(result);
    curve.geodesics = static_cast<int>(sides.size());
    if (cancelled(result)) return result;
    makeSpace(sides);
    enrichSpace(curve, result);
    if (cancelled(result)) return result;
    const auto points = construct(curve, result);
    if (cancelled(result)) return result;
    curve.curve.frames = placed(points);
    curve.dimension = space_->dimension();
    return result;
  }

 private:
  static bool cancelled(const Outcome& outcome) { return outcome.termination == Termination::kCancelled; }
  void tell(const std::string& stage, double fraction, const Outcome& outcome) const {
    if (progress_) progress_({stage, fraction, outcome.residual});
  }

  /// The geodesics between neighbouring control shapes, at full resolution.
  std::vector<Curve> computeSides(Outcome& outcome) const {
    auto options = options_.geodesic;
    options.frames = options_.auxiliary;
    options.ghost = ghost_;
    const std::size_t count = aligned_.size() - 1;
    std::vector<Solved<GeodesicFlow>> solved(count);
    std::size_t done = 0;
    std::mutex telling;
    // Much of a geodesic is one thing after the other: so many of them keep the other threads busy.
    tbb::parallel_for(std::size_t{0}, count, [&](std::size_t i) {
      solved[i] = geodesicByFlow(structure_, bending_, aligned_[i], aligned_[i + 1], options);
      const std::lock_guard lock(telling);
      ++done;
      tell(std::to_string(done) + " of " + std::to_string(count) + " sides",
           kSides * static_cast<double>(done) / static_cast<double>(count), solved[i]);
    });
    std::vector<Curve> sides;
    for (auto& side : solved) {
      outcome += side;
      sides.push_back(std::move(side.solution.curve));
    }
    return sides;
  }

  void makeSpace(const std::vector<Curve>& sides) {
    const auto& origin = aligned_[centralShape(aligned_)];
    std::vector<std::vector<Vertices>> frames;
    std::vector<Vertices> all;
    for (const auto& side : sides) {
      frames.emplace_back();
      for (const auto& frame : side.frames) frames.back().push_back(apply(alignRigidly(frame, origin), frame));
      all.insert(all.end(), frames.back().begin(), frames.back().end());
    }
    auto subspace = principalSubspace(origin, all, options_.dimension, kNegligible);
    for (const auto& side : frames)
      for (const auto& end : {side.front(), side.back()}) subspace = including(subspace, end);
    space_ = std::make_unique<GhostSpace>(*ghost_, std::move(subspace));
    for (const auto& side : frames) {
      sides_.emplace_back();
      for (const auto& frame : side) sides_.back().push_back(space_->fine().coordinates(frame));
    }
  }

  void settleSides(Outcome& outcome) {
    for (auto& side : sides_) outcome += settle(*space_, bending_, side, settling_);
  }

  /// Adds to the space what a rough construction of the middle wants: it is furthest from all sides.
  void enrichSpace(BezierCurve& curve, Outcome& outcome) {
    settleSides(outcome);
    PathEnrichment last;
    for (int round = 0; round < options_.geodesic.enrichments && sides_.size() > 1 && !cancelled(outcome); ++round) {
      std::vector<PathCoordinates> rough;
      for (const auto& side : sides_) rough.push_back(resampled(*space_, bending_, side, kRough, settling_));
      Construction construction(*space_, bending_, settling_, rough);
      outcome += construction.at(0.5);
      curve.geodesics += construction.geodesics();
      const auto grown = enrich(structure_, bending_, *space_, construction.innerPaths(), options_.geodesic.accuracy,
                                options_.geodesic.stop);
      curve.missing = grown.missing;
      tell("subspace of " + std::to_string(space_->dimension()),
           kSides + (kSpace - kSides) * (round + 1) / options_.geodesic.enrichments, outcome);
      for (auto& side : sides_) side = extended(side, *space_);
      if (grown.added > 0) settleSides(outcome);
      if (!grown.worthAnother(last)) return;
      last = grown;
    }
  }

  /// The inner points of the curve.
  std::vector<Eigen::VectorXd> construct(BezierCurve& curve, Outcome& outcome) const {
    Construction construction(*space_, bending_, settling_, sides_);
    std::vector<Eigen::VectorXd> points;
    for (int j = 1; j + 1 < options_.frames && !cancelled(outcome); ++j) {
      const double t = static_cast<double>(j) / (options_.frames - 1);
      auto point = construction.at(t);
      outcome += point;
      points.push_back(std::move(point.solution));
      curve.geodesics += construction.geodesics();
      tell("frame " + std::to_string(j + 1), kSpace + (1 - kSpace) * t, outcome);
    }
    return points;
  }

  std::vector<Vertices> placed(const std::vector<Eigen::VectorXd>& points) const {
    const Travel travel(stops_, controls_.front().colwise().mean().transpose());
    std::vector<Vertices> frames(points.size() + 2);
    frames.front() = controls_.front();
    frames.back() = controls_.back();
    tbb::parallel_for(std::size_t{0}, points.size(), [&](std::size_t k) {
      const Vertices shape = space_->fine().shape(points[k]);
      const Vertices still = apply(alignRigidly(shape, controls_.front()), shape);
      frames[k + 1] = apply(travel.at(static_cast<double>(k + 1) / static_cast<double>(points.size() + 1)), still);
    });
    return frames;
  }

  static constexpr double kSides = 0.45, kSpace = 0.75;  ///< shares of the work done after the sides and the space

  const ShellStructurePtr& structure_;
  double bending_;
  const std::vector<Vertices>& controls_;
  const BezierOptions& options_;
  ReducedPathOptions settling_;
  const ProgressSink& progress_;
  std::vector<Vertices> aligned_;   ///< the control shapes in the position of the first
  std::vector<RigidMotion> stops_;  ///< and back
  std::shared_ptr<const Coarsening> ghost_;
  std::unique_ptr<GhostSpace> space_;
  std::vector<PathCoordinates> sides_;
};

}  // namespace

std::optional<std::string> BezierOptions::firstViolation() const {
  const auto whole = [](const char* name, int value, int least) {
    return std::string(name) + " = " + std::to_string(value) + ", want >= " + std::to_string(least);
  };
  if (frames < 2) return whole("frames", frames, 2);
  if (auxiliary < 2) return whole("auxiliary", auxiliary, 2);
  if (dimension < 1) return whole("dimension", dimension, 1);
  return geodesic.firstViolation();
}

Solved<BezierCurve> bezierCurve(const ShellStructurePtr& structure, double bending,
                                const std::vector<Vertices>& controls, const BezierOptions& options,
                                const ProgressSink& progress) {
  if (const auto violation = options.firstViolation()) throw InvalidInput("options", *violation);
  requireOneComponent(structure->topology(), "topology");
  requireCurve(structure->topology(), {controls, false}, "controls");
  return BezierRun(structure, bending, controls, options, progress).run();
}

}  // namespace shaped
