#include "core/registration/limb_search.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>

#include "core/mesh/quality.h"
#include "core/numerics/error.h"
#include "core/numerics/option_checks.h"
#include "core/registration/bone_turns.h"
#include "core/registration/deformation.h"
#include "core/registration/surface_samples.h"
#include "core/skeleton/foremost_joint.h"
#include "core/skeleton/rotation.h"
#include "core/surface/point_tree.h"

namespace shaped {
namespace {

constexpr int kDensity = 4;          ///< both sides are sampled so much denser than the rest of the body is read
constexpr int kLimbPoints = 60;      ///< of each of a limb's two parts: small parts tell as much as large ones
constexpr int kScanPoints = 120;     ///< of the scan that a limb has to explain
constexpr double kExplained = 0.02;  ///< cost below which a scan point asks for nothing more

/// Points with normals, as columns.
struct Points {
  Eigen::Matrix3Xd positions, normals;

  explicit Points(Eigen::Index count) : positions(3, count), normals(3, count) {}
  Eigen::Index size() const { return positions.cols(); }
  Points turned(const Eigen::Matrix3d& rotation, const Eigen::Vector3d& about) const {
    Points result(size());
    result.positions = (rotation * (positions.colwise() - about)).colwise() + about;
    result.normals = rotation * normals;
    return result;
  }
};

/// The tree of joints as the search sees it: who carries what.
class Limbs {
 public:
  Limbs(const BodyModel& model, const LimbSearchOptions& options) : model_(model) {
    const auto& skeleton = model.skeleton();
    const Vertices joints = model.restJoints(model.meanState().identity);
    carried_ = carriedShares();
    const double shortest = options.shortest_bone * boundingBoxDiagonal(model.parts().mean);
    for (std::int32_t upper = 1; upper < skeleton.jointCount(); ++upper) {
      if (carried_[std::size_t(upper)] > options.largest_share) continue;
      std::optional<std::int32_t> lower;
      for (std::int32_t j = upper + 1; j < skeleton.jointCount(); ++j)
        if (skeleton.parent(j) == upper && (joints.row(j) - joints.row(upper)).norm() >= shortest &&
            (!lower || carried_[std::size_t(j)] > carried_[std::size_t(*lower)]))
          lower = j;
      if (lower) all_.push_back({upper, *lower});
    }
  }

  const std::vector<Limb>& all() const { return all_; }
  /// Share of the surface that the joint and those below it carry.
  double share(std::int32_t joint) const { return carried_[std::size_t(joint)]; }

  bool below(std::int32_t joint, std::int32_t ancestor) const { return hangsBelow(model_.skeleton(), joint, ancestor); }

  std::int32_t foremostJoint(Eigen::Index vertex) const {
    return shaped::foremostJoint(model_.parts().weights, vertex);
  }

 private:
  /// Share of the surface that each joint and those below it carry.
  std::vector<double> carriedShares() const {
    const Eigen::VectorXd areas = areaShares(model_.topology()->faces(), model_.parts().mean);
    std::vector<double> shares(std::size_t(model_.skeleton().jointCount()));
    for (Eigen::Index v = 0; v < areas.size(); ++v) shares[std::size_t(foremostJoint(v))] += areas[v];
    for (std::int32_t j = model_.skeleton().jointCount() - 1; j > 0; --j)
      shares[std::size_t(model_.skeleton().parent(j))] += shares[std::size_t(j)];
    return shares;
  }

  const BodyModel& model_;
  std::vector<double> carried_;
  std::vector<Limb> all_;
};

/// The scan's side of the cost. All costs lie in [0, 1].
class ScanSide {
 public:
  ScanSide(const ScanSurface& scan, const LimbSearchOptions& options)
      : oriented_(scan.hasOrientedNormals()),
        square_(options.loss_scale * options.loss_scale),
        samples_(everyFew(scan.points(), scan.normals(), kDensity * options.samples)),
        tree_(samples_.points) {}

  const SurfaceSamples& samples() const { return samples_; }

  /// The mean over the body's points of their costs against the scan.
  double costOf(const Points& body) const {
    double sum = 0;
    for (Eigen::Index i = 0; i < body.size(); ++i) {
      const NearPoint found = tree_.nearest(body.positions.col(i).transpose());
      const double cosine = samples_.normals.row(found.index).dot(body.normals.col(i));
      sum += facing(cosine) ? loss(found.squared_distance) : 1;
    }
    return sum / double(std::max<Eigen::Index>(1, body.size()));
  }

  /// Of each of some of the scan's points: its cost against the body's points, at most what it has already.
  void lower(const Points& body, const Points& scan, Eigen::VectorXd& costs) const {
    for (Eigen::Index s = 0; s < costs.size(); ++s) {
      if (costs[s] < kExplained) continue;
      double least = std::numeric_limits<double>::infinity();
      for (Eigen::Index i = 0; i < body.size(); ++i) {
        const double squared = (body.positions.col(i) - scan.positions.col(s)).squaredNorm();
        if (squared < least && facing(body.normals.col(i).dot(scan.normals.col(s)))) least = squared;
      }
      costs[s] = std::min(costs[s], loss(least));
    }
  }

 private:
  bool facing(double cosine) const { return (oriented_ ? cosine : std::abs(cosine)) >= 0.3; }
  double loss(double squared) const { return std::isinf(squared) ? 1 : squared / (square_ + squared); }

  bool oriented_;
  double square_;
  SurfaceSamples samples_;
  PointTree tree_;
};

/// Turns one limb after the other.
class Search {
 public:
  Search(const ScanSurface& scan, const BodyModel& model, const LimbSearchOptions& options, const std::stop_token& stop)
      : model_(model),
        options_(options),
        stop_(stop),
        limbs_(model, options),
        scan_(scan, options),
        chosen_(verticesByArea(model.topology()->faces(), model.parts().mean, kDensity * options.samples)) {
    for (const auto v : chosen_) joints_.push_back(limbs_.foremostJoint(v));
  }

  LimbSearch run(const BodyState& start) const {
    LimbSearch result{start};
    auto order = limbs_.all();
    if (options_.backwards) std::reverse(order.begin(), order.end());
    for (const auto& limb : order) {
      if (stop_.stop_requested()) break;
      result.turned += turn(limb, result.state);
    }
    return result;
  }

 private:
  /// About `most` samples of the posed body among those that `wanted` says yes to, by their foremost joint.
  template <class Wanted>
  Points part(const PosedSkin& skin, const Vertices& normals, int most, const Wanted& wanted) const {
    std::vector<std::int32_t> taken;
    for (std::size_t i = 0; i < chosen_.size(); ++i)
      if (wanted(joints_[i])) taken.push_back(chosen_[i]);
    const std::size_t stride = std::max<std::size_t>(1, taken.size() / std::size_t(most));
    Points points(Eigen::Index((taken.size() + stride - 1) / stride));
    for (Eigen::Index i = 0; i < points.size(); ++i) {
      const auto vertex = taken[std::size_t(i) * stride];
      points.positions.col(i) = skin.vertices().row(vertex).transpose();
      points.normals.col(i) = normals.row(vertex).transpose();
    }
    return points;
  }

  /// A limb, cut from the rest.
  struct Cut {
    Points upper, lower;          ///< the parts that the two joints carry, both joints at rest
    Eigen::Vector3d shoulder;     ///< where the upper joint stands
    Eigen::Vector3d bone;         ///< from it to the lower one, upper joint at rest
    Eigen::Matrix3d above;        ///< how the upper joint's parent stands in the world
    Points open;                  ///< points of the scan within reach that the rest of the body does not explain
    Eigen::VectorXd unexplained;  ///< their costs by the rest of the body
    double scan_weight;           ///< of one of them, so that a limb's own share of the scan would weigh 1
  };

  Cut cutOff(const Limb& limb, const BodyState& state) const {
    BodyState straight = state;
    straight.pose.rotations.row(limb.upper).setZero();
    straight.pose.rotations.row(limb.lower).setZero();
    const PosedSkin skin = model_.posed(straight);
    const Vertices normals = vertexNormals(model_.topology()->faces(), skin.vertices());
    const auto part = [&](int most, const auto& wanted) { return this->part(skin, normals, most, wanted); };
    const auto& bones = skin.skeleton();
    Cut cut{
        part(kLimbPoints, [&](std::int32_t j) { return limbs_.below(j, limb.upper) && !limbs_.below(j, limb.lower); }),
        part(kLimbPoints, [&](std::int32_t j) { return limbs_.below(j, limb.lower); }),
        bones.joints.row(limb.upper).transpose(),
        (bones.joints.row(limb.lower) - bones.joints.row(limb.upper)).transpose(),
        bones.rotations[std::size_t(model_.skeleton().parent(limb.upper))],
        Points(0),
        {},
        0};
    leaveOpen(part(options_.samples, [&](std::int32_t j) { return !limbs_.below(j, limb.upper); }), limb, cut);
    return cut;
  }

  /// What the limb has to explain of the scan.
  void leaveOpen(const Points& rest, const Limb& limb, Cut& cut) const {
    double reach = 0;
    for (const auto* points : {&cut.upper, &cut.lower})
      if (points->size() > 0)
        reach = std::max(reach, (points->positions.colwise() - cut.shoulder).colwise().norm().maxCoeff());
    reach += 3 * options_.loss_scale;
    const auto& samples = scan_.samples();
    std::vector<Eigen::Index> near;
    for (Eigen::Index s = 0; s < samples.points.rows(); ++s)
      if ((samples.points.row(s).transpose() - cut.shoulder).norm() <= reach) near.push_back(s);
    Points points(Eigen::Index(near.size()));
    for (std::size_t i = 0; i < near.size(); ++i) {
      points.positions.col(Eigen::Index(i)) = samples.points.row(near[i]).transpose();
      points.normals.col(Eigen::Index(i)) = samples.normals.row(near[i]).transpose();
    }
    Eigen::VectorXd costs = Eigen::VectorXd::Ones(points.size());
    scan_.lower(rest, points, costs);
    std::vector<Eigen::Index> open;
    for (Eigen::Index i = 0; i < costs.size(); ++i)
      if (costs[i] >= kExplained) open.push_back(i);
    const std::size_t stride = std::max<std::size_t>(1, open.size() / std::size_t(kScanPoints));
    cut.open = Points(Eigen::Index((open.size() + stride - 1) / stride));
    cut.unexplained.resize(cut.open.size());
    for (Eigen::Index i = 0; i < cut.open.size(); ++i) {
      const auto from = open[std::size_t(i) * stride];
      cut.open.positions.col(i) = points.positions.col(from);
      cut.open.normals.col(i) = points.normals.col(from);
      cut.unexplained[i] = costs[from];
    }
    cut.scan_weight = double(stride) / (limbs_.share(limb.upper) * double(samples.points.rows()));
  }

  /// Both joints' rotations relative to their parents.
  struct Turn {
    Eigen::Matrix3d upper, lower;
  };

  /// Tries turns of the lower joint with one of the upper.
  void tryLower(const Limb& limb, const Cut& cut, const Eigen::Matrix3d& upper,
                const std::vector<Eigen::Matrix3d>& lowers, double& least, Turn& best) const {
    if (stop_.stop_requested()) return;
    const Eigen::Matrix3d world = cut.above * upper * cut.above.transpose();
    const Points moved = cut.upper.turned(world, cut.shoulder);
    const Eigen::Vector3d elbow = cut.shoulder + world * cut.bone;
    Eigen::VectorXd explained = cut.unexplained;
    scan_.lower(moved, cut.open, explained);
    const double share = limbs_.share(limb.lower) / limbs_.share(limb.upper);
    const double small = std::max(share, 0.3);  // a hand's turn must not drown in its forearm
    const double upper_cost = (1 - small) * scan_.costOf(moved);
    for (const auto& lower : lowers) {
      if (!allowed(limb, {upper, lower})) continue;
      Points bent = cut.lower.turned(world * cut.above * lower * cut.above.transpose(), cut.shoulder);
      bent.positions.colwise() += elbow - (world * cut.above * lower * cut.above.transpose() * cut.bone + cut.shoulder);
      double cost = upper_cost + small * scan_.costOf(bent) + priorOf({upper, lower});
      if (cost >= least) continue;
      Eigen::VectorXd left = explained;
      scan_.lower(bent, cut.open, left);
      cost += cut.scan_weight * left.sum();
      if (cost < least) least = cost, best = {upper, lower};
    }
  }

  bool turn(const Limb& limb, BodyState& state) const {
    const Cut cut = cutOff(limb, state);
    if (cut.lower.size() == 0) return false;
    const Eigen::Matrix3d now_upper = rotationMatrix(state.pose.rotations.row(limb.upper).transpose());
    const Eigen::Matrix3d now_lower = rotationMatrix(state.pose.rotations.row(limb.lower).transpose());
    Turn best{now_upper, now_lower};
    double least = std::numeric_limits<double>::infinity();
    tryLower(limb, cut, now_upper, {now_lower}, least, best);
    const double first = least;
    const Eigen::Vector3d bone = cut.above.transpose() * cut.bone;
    const Eigen::Vector3d forearm =
        cut.above.transpose() * (cut.lower.positions.rowwise().mean() - cut.shoulder - cut.bone);
    const auto lowers = boneTurns(forearm, {45, 90}, {0});
    for (const auto& upper : boneTurns(bone, {35, 70}, {0, -50, 50})) tryLower(limb, cut, upper, lowers, least, best);
    for (const double step : {22.0, 11.0}) refine(limb, cut, bone, forearm, step, least, best);
    if (stop_.stop_requested() || !(least < first - options_.least_gain)) return false;
    state.pose.rotations.row(limb.upper) = axisAngle(best.upper).transpose();
    state.pose.rotations.row(limb.lower) = axisAngle(best.lower).transpose();
    return true;
  }

  /// Smaller steps about the best turn.
  void refine(const Limb& limb, const Cut& cut, const Eigen::Vector3d& bone, const Eigen::Vector3d& forearm,
              double step, double& least, Turn& best) const {
    const Turn centre = best;
    std::vector<Eigen::Matrix3d> lowers;
    for (const auto& small : boneTurns(forearm, {step}, {0})) lowers.push_back(centre.lower * small);
    for (const auto& small : boneTurns(bone, {step}, {0, -step, step}))
      tryLower(limb, cut, centre.upper * small, lowers, least, best);
  }

  double priorOf(const Turn& turn) const {
    const double squares = axisAngle(turn.upper).squaredNorm() + axisAngle(turn.lower).squaredNorm();
    return options_.prior * squares;
  }

  bool allowed(const Limb& limb, const Turn& turn) const {
    const auto& limits = model_.parts().limits;
    if (!limits) return true;
    const auto within = [&](std::int32_t joint, const Eigen::Matrix3d& rotation) {
      const Eigen::Array3d angles = axisAngle(rotation).array();
      return (angles >= limits->low.row(joint).transpose().array()).all() &&
             (angles <= limits->high.row(joint).transpose().array()).all();
    };
    return within(limb.upper, turn.upper) && within(limb.lower, turn.lower);
  }

  const BodyModel& model_;
  const LimbSearchOptions& options_;
  const std::stop_token& stop_;
  Limbs limbs_;
  ScanSide scan_;
  std::vector<std::int32_t> chosen_, joints_;  ///< sampled vertices, and the joint that carries each foremost
};

}  // namespace

std::optional<std::string> LimbSearchOptions::firstViolation() const {
  if (samples < 50) return "samples = " + std::to_string(samples) + ", want >= 50";
  if (auto problem = unlessPositive("loss_scale", loss_scale)) return problem;
  if (!(largest_share > 0 && largest_share <= 1))
    return "largest_share = " + std::to_string(largest_share) + ", want (0, 1]";
  if (auto problem = unlessPositive("shortest_bone", shortest_bone)) return problem;
  if (!(prior >= 0) || !std::isfinite(prior)) return "prior = " + std::to_string(prior) + ", want >= 0";
  if (!(least_gain >= 0) || !std::isfinite(least_gain))
    return "least_gain = " + std::to_string(least_gain) + ", want >= 0";
  return std::nullopt;
}

std::vector<Limb> limbsOf(const BodyModel& model, const LimbSearchOptions& options) {
  if (const auto problem = options.firstViolation()) throw InvalidInput("limb search options", *problem);
  return Limbs(model, options).all();
}

bool hangsBelow(const Skeleton& skeleton, std::int32_t joint, std::int32_t ancestor) {
  while (joint > ancestor) joint = skeleton.parent(joint);  // parents come first
  return joint == ancestor;
}

LimbSearch searchLimbs(const ScanSurface& scan, const BodyModel& model, const BodyState& start,
                       const LimbSearchOptions& options, const std::stop_token& stop) {
  if (const auto problem = options.firstViolation()) throw InvalidInput("limb search options", *problem);
  if (stop.stop_requested()) return {start};
  return Search(scan, model, options, stop).run(start);
}

}  // namespace shaped
