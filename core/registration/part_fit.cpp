#include "core/registration/part_fit.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numeric>

#include "core/numerics/option_checks.h"
#include "core/registration/limb_search.h"
#include "core/surface/point_tree.h"

namespace shaped {
namespace {

constexpr int kRestPoints = 3000;       ///< of the rest of the body, which claim the scan points that lie on them
constexpr double kClaimed = 0.015;      ///< m: so near they claim one that faces their way
constexpr double kReach = 0.03;         ///< m further than the part is long
constexpr double kBehind = 0.02;        ///< m behind the joint, along the bone that leads to it
constexpr double kTangential = 1. / 9;  ///< of squared distances across the normal: points do not lie on points
constexpr double kDamping = 1e-3;
constexpr Eigen::Index kLeastPoints = 12;

double bounded(double squared, double scale) { return squared / (scale * scale + squared); }

/// Every few of a list, about `most`.
template <class Value>
std::vector<Value> thinned(const std::vector<Value>& all, int most) {
  const std::size_t stride = std::max<std::size_t>(1, (all.size() + std::size_t(most) - 1) / std::size_t(most));
  std::vector<Value> some;
  for (std::size_t i = 0; i < all.size(); i += stride) some.push_back(all[i]);
  return some;
}

/// Whether these joints carry a vertex for the most part, for each.
std::vector<bool> carriedBy(const std::vector<std::int32_t>& joints, const SkinWeights& weights) {
  Eigen::VectorXd mine = Eigen::VectorXd::Zero(weights.cols());
  for (const auto joint : joints) mine[joint] = 1;
  const Eigen::VectorXd shares = weights * mine;
  std::vector<bool> carried;
  for (const double share : shares) carried.push_back(share > 0.5);
  return carried;
}

/// Points of the posed body outside the part: what of the scan lies on them is not the part's.
class RestOfBody {
 public:
  RestOfBody(const Vertices& vertices, const Vertices& normals, const std::vector<std::int32_t>& chosen)
      : normals_(normals(chosen, Eigen::all)) {
    if (!chosen.empty()) tree_.emplace(Vertices(vertices(chosen, Eigen::all)));
  }

  bool claims(const Eigen::RowVector3d& point, const Eigen::RowVector3d& normal, bool oriented) const {
    if (!tree_) return false;
    const auto found = tree_->nearest(point);
    const double cosine = normals_.row(found.index).dot(normal);
    return found.squared_distance < kClaimed * kClaimed && (oriented ? cosine : std::abs(cosine)) > 0.5;
  }

 private:
  Vertices normals_;
  std::optional<PointTree> tree_;
};

}  // namespace

std::optional<std::string> PartFitOptions::firstViolation() const {
  if (points < 20) return "points = " + std::to_string(points) + ", want >= 20";
  if (rounds < 1) return "rounds = " + std::to_string(rounds) + ", want >= 1";
  for (const auto& [name, value] : {std::pair{"loss_scale", loss_scale},
                                    {"sigma", sigma},
                                    {"observations", observations},
                                    {"pose_deviation", pose_deviation},
                                    {"parent_deviation", parent_deviation}})
    if (auto problem = unlessPositive(name, value)) return problem;
  for (const auto& [name, value] : {std::pair{"normal_scale", normal_scale}, {"prior", prior}})
    if (!(value >= 0) || !std::isfinite(value))
      return std::string(name) + " = " + std::to_string(value) + ", want >= 0";
  return std::nullopt;
}

PartFit::PartFit(const ScanSurface& scan, const StandingBody& body, std::int32_t joint, const Pose& likely,
                 const PartFitOptions& options)
    : model_(body.model()),
      options_(options),
      oriented_(scan.hasOrientedNormals()),
      likely_(likely),
      rest_joints_(body.restJoints()) {
  for (std::int32_t j = joint; j < model_.skeleton().jointCount(); ++j)
    if (hangsBelow(model_.skeleton(), j, joint)) joints_.push_back(j);
  moving_ = {model_.skeleton().parent(joint)};
  moving_.insert(moving_.end(), joints_.begin(), joints_.end());
  deviations_.assign(moving_.size(), options.pose_deviation);
  deviations_[0] = options.parent_deviation;
  likely_.rotations.row(moving_[0]) = body.pose().rotations.row(moving_[0]);
  const auto mine = carriedBy(joints_, model_.parts().weights);
  chooseVertices(body, mine);
  chooseScanPoints(scan, body, mine);
}

bool PartFit::tells() const { return Eigen::Index(vertices_.size()) >= kLeastPoints && scan_.cols() >= kLeastPoints; }

void PartFit::chooseVertices(const StandingBody& body, const std::vector<bool>& mine) {
  std::vector<std::int32_t> part;
  for (std::size_t v = 0; v < mine.size(); ++v)
    if (mine[v]) part.push_back(std::int32_t(v));
  vertices_ = thinned(part, options_.points);
  rest_ = body.rest()(vertices_, Eigen::all);
  rest_normals_ = body.restNormals()(vertices_, Eigen::all);
  weights_ = SkinWeights(Eigen::Index(vertices_.size()), model_.skeleton().jointCount());
  for (std::size_t i = 0; i < vertices_.size(); ++i)
    for (SkinWeights::InnerIterator entry(model_.parts().weights, vertices_[i]); entry; ++entry)
      weights_.insert(Eigen::Index(i), entry.col()) = entry.value();
  weights_.makeCompressed();
}

void PartFit::chooseScanPoints(const ScanSurface& scan, const StandingBody& body, const std::vector<bool>& mine) {
  centre_ = body.joints().row(joints_.front());
  const Eigen::RowVector3d bone = (centre_ - body.joints().row(moving_.front())).normalized();
  double share = 0, length = 0;
  std::vector<std::int32_t> others;
  for (Eigen::Index v = 0; v < body.areas().size(); ++v)
    if (mine[std::size_t(v)])
      share += body.areas()[v], length = std::max(length, (body.vertices().row(v) - centre_).norm());
    else
      others.push_back(std::int32_t(v));
  const RestOfBody rest(body.vertices(), body.normals(), thinned(others, kRestPoints));
  std::vector<Eigen::Index> open;
  for (Eigen::Index s = 0; s < scan.points().rows(); ++s) {
    const Eigen::RowVector3d away = scan.points().row(s) - centre_;
    if (away.norm() <= length + kReach && away.dot(bone) >= -kBehind &&
        !rest.claims(scan.points().row(s), scan.normals().row(s), oriented_))
      open.push_back(s);
  }
  keepScanPoints(scan, open, share);
}

void PartFit::keepScanPoints(const ScanSurface& scan, const std::vector<Eigen::Index>& open, double share) {
  const auto chosen = thinned(open, options_.points);
  scan_.resize(6, Eigen::Index(chosen.size()));
  for (std::size_t i = 0; i < chosen.size(); ++i)
    scan_.col(Eigen::Index(i)) << (scan.points().row(chosen[i]) - centre_).transpose(),
        scan.normals().row(chosen[i]).transpose();
  const double thinning = double(open.size()) / std::max(1.0, double(chosen.size()));
  scan_share_ = thinning / std::max(1.0, share * double(scan.points().rows()));
}

PosedSkin PartFit::skinOf(const Pose& pose) const {
  return PosedSkin(model_.skeleton(), weights_, rest_, rest_joints_, pose);
}

PartFit::Points PartFit::pointsOf(const PosedSkin& skin) const {
  Points points(6, rest_.rows());
  for (Eigen::Index v = 0; v < rest_.rows(); ++v)
    points.col(v) << (skin.vertices().row(v) - centre_).transpose(),
        (skin.blend(v) * rest_normals_.row(v).transpose()).normalized();
  return points;
}

PartFit::Pair PartFit::pairOf(const Points& part, Eigen::Index vertex, Eigen::Index scan) const {
  const Eigen::Vector3d away = part.col(vertex).head<3>() - scan_.col(scan).head<3>();
  const auto normal = scan_.col(scan).tail<3>(), other = part.col(vertex).tail<3>();
  const double height = normal.dot(away), scale = options_.normal_scale * options_.normal_scale;
  const double cosine = normal.dot(other), bent = 2 - 2 * (oriented_ ? cosine : std::abs(cosine));
  return {vertex, scan, height * height + kTangential * (away.squaredNorm() - height * height) + scale * bent};
}

PartFit::Pairs PartFit::pairsOf(const Points& part) const {
  // Squared distances in place and normal, all at once; the normals' part is -2 n . m up to a constant.
  const double scale = options_.normal_scale * options_.normal_scale;
  Eigen::MatrixXd normals = part.bottomRows<3>().transpose() * scan_.bottomRows<3>();
  if (!oriented_) normals = normals.cwiseAbs();
  Eigen::MatrixXd squares = -2 * (part.topRows<3>().transpose() * scan_.topRows<3>() + scale * normals);
  squares.colwise() += part.topRows<3>().colwise().squaredNorm().transpose();
  squares.rowwise() += scan_.topRows<3>().colwise().squaredNorm();
  Pairs pairs;
  std::vector<Eigen::Index> nearest(std::size_t(part.cols()), 0);
  Eigen::VectorXd least = Eigen::VectorXd::Constant(part.cols(), std::numeric_limits<double>::infinity());
  for (Eigen::Index s = 0; s < scan_.cols(); ++s) {
    Eigen::Index vertex;
    squares.col(s).minCoeff(&vertex);
    pairs.back.push_back(pairOf(part, vertex, s));
    for (Eigen::Index v = 0; v < part.cols(); ++v)
      if (squares(v, s) < least[v]) least[v] = squares(v, s), nearest[std::size_t(v)] = s;
  }
  for (Eigen::Index v = 0; v < part.cols(); ++v) pairs.outward.push_back(pairOf(part, v, nearest[std::size_t(v)]));
  return pairs;
}

double PartFit::turned(const Pose& pose) const {
  double squares = 0;
  for (std::size_t i = 0; i < moving_.size(); ++i)
    squares += (pose.rotations.row(moving_[i]) - likely_.rotations.row(moving_[i])).squaredNorm() /
               (deviations_[i] * deviations_[i]);
  return squares;
}

double PartFit::cost(const Pairs& pairs, const Pose& pose) const {
  double part = 0, scan = 0;
  for (const auto& pair : pairs.outward) part += bounded(pair.squared, options_.loss_scale);
  for (const auto& pair : pairs.back) scan += bounded(pair.squared, options_.loss_scale);
  return part / double(pairs.outward.size()) + scan * scan_share_ +
         options_.prior * options_.pose_deviation * options_.pose_deviation * turned(pose);
}

double PartFit::cost(const Pose& pose) const { return cost(pairsOf(pointsOf(skinOf(pose))), pose); }

Eigen::RowVectorXd PartFit::rowOf(const Pair& pair, PointDerivatives& derivatives) const {
  const auto vertex = std::int32_t(pair.vertex);
  const double share = 1;
  derivatives.turnTo({&vertex, 1}, {&share, 1});
  Eigen::RowVectorXd all = Eigen::RowVectorXd::Zero(3 + 3 * model_.skeleton().jointCount()),
                     mine(Eigen::Index(3 * moving_.size()));
  derivatives.poseRow(scan_.col(pair.scan).tail<3>(), all);
  for (std::size_t i = 0; i < moving_.size(); ++i)
    mine.segment<3>(Eigen::Index(3 * i)) = all.segment<3>(3 + 3 * moving_[i]);
  return mine;
}

void PartFit::step(const PosedSkin& skin, const Points& part, const Pairs& pairs, double scale, Pose& pose) const {
  const auto size = Eigen::Index(3 * moving_.size());
  Eigen::MatrixXd normal = Eigen::MatrixXd::Zero(size, size);
  Eigen::VectorXd right = Eigen::VectorXd::Zero(size);
  double count = 0;
  PointDerivatives derivatives(skin);
  for (const auto* side : {&pairs.outward, &pairs.back})
    for (const auto& pair : *side) {
      const double share = scale * scale / (scale * scale + pair.squared), weight = share * share;
      const Eigen::Vector3d direction = scan_.col(pair.scan).tail<3>();
      count += 1;
      if (weight < 1e-3 || direction.isZero(0)) continue;
      const Eigen::RowVectorXd row = rowOf(pair, derivatives);
      const double height = direction.dot(part.col(pair.vertex).head<3>() - scan_.col(pair.scan).head<3>());
      normal.noalias() += weight * row.transpose() * row;
      right.noalias() -= weight * height * row.transpose();
    }
  const double scaled = options_.observations / (options_.sigma * options_.sigma) / std::max(1.0, count);
  turn(scaled * normal, scaled * right, pose);
}

void PartFit::turn(Eigen::MatrixXd normal, Eigen::VectorXd right, Pose& pose) const {
  normal.diagonal() *= 1 + kDamping;
  for (std::size_t i = 0; i < moving_.size(); ++i) {
    const double prior = 1 / (deviations_[i] * deviations_[i]);
    normal.diagonal().segment<3>(Eigen::Index(3 * i)).array() += prior;
    right.segment<3>(Eigen::Index(3 * i)) -=
        prior * (pose.rotations.row(moving_[i]) - likely_.rotations.row(moving_[i])).transpose();
  }
  const Eigen::VectorXd turns = normal.ldlt().solve(right);
  for (std::size_t i = 0; i < moving_.size(); ++i)
    pose.rotations.row(moving_[i]) += turns.segment<3>(Eigen::Index(3 * i)).transpose();
  keepLimits(pose);
}

void PartFit::keepLimits(Pose& pose) const {
  const auto& limits = model_.parts().limits;
  if (!limits) return;
  for (const auto j : moving_)
    pose.rotations.row(j) = pose.rotations.row(j).cwiseMax(limits->low.row(j)).cwiseMin(limits->high.row(j));
}

Pose PartFit::descended(const Pose& start) const {
  Pose pose = start;
  keepLimits(pose);
  Pose best = pose;
  double least = std::numeric_limits<double>::infinity();
  for (int round = 0; round <= options_.rounds; ++round) {
    const PosedSkin skin = skinOf(pose);
    const Points part = pointsOf(skin);
    const Pairs pairs = pairsOf(part);
    const double cost = this->cost(pairs, pose);
    if (cost < least) least = cost, best = pose;
    // From three times the loss's scale down to it in the first half of the rounds.
    const double wide = std::max(0.0, 1 - 2.0 * round / options_.rounds);
    if (round < options_.rounds) step(skin, part, pairs, options_.loss_scale * (1 + 2 * wide), pose);
  }
  return best;
}

}  // namespace shaped
