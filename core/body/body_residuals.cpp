#include "core/body/body_residuals.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "core/skeleton/foremost_joint.h"

namespace shaped {

/// Writes the rows of targets for one state of the model.
class BodyResiduals::TargetRows {
 public:
  TargetRows(const BodyResiduals& residuals, const PosedSkin& skin)
      : residuals_(residuals), skin_(skin), derivatives_(skin, residuals.model_.shapeModes()) {}

  /// Fills residuals_.rowCount(target) rows, but for the columns of joints that do not move the target.
  void fill(const SurfaceTarget& target, Eigen::Ref<Rows> rows) {
    derivatives_.turnTo(target.corners, {target.barycentric.data(), 3});
    Eigen::Vector3d offset = -target.position;
    for (int c = 0; c < 3; ++c)
      offset += target.barycentric[c] * skin_.vertices().row(target.corners[std::size_t(c)]).transpose();
    const double scale = residuals_.scale_ * std::sqrt(target.weight);
    const Eigen::Index modes = residuals_.model_.modeCount(), last = rows.cols() - 1;
    for (Eigen::Index row = 0; row < rows.rows(); ++row) {
      const bool along = rows.rows() == 1;
      const Eigen::Vector3d direction = scale * (along ? target.normal : Eigen::Vector3d(Eigen::Vector3d::Unit(row)));
      derivatives_.shapeRow(direction, rows.row(row).head(modes));
      derivatives_.poseRow(direction, rows.row(row).segment(modes, last - modes));
      rows(row, last) = direction.dot(offset);
    }
  }

  /// The joints that move the target of the last fill.
  const std::vector<std::int32_t>& joints() const { return derivatives_.joints(); }

 private:
  const BodyResiduals& residuals_;
  const PosedSkin& skin_;
  PointDerivatives derivatives_;
};

/// Sums products of rows. Bodies are trees, and a target moves with the joints from its bones to the root alone: rows
/// of targets nearby come together, and the columns that are zero in all of them are left out.
class BodyResiduals::RowProducts {
 public:
  explicit RowProducts(const BodyResiduals& residuals)
      : modes_(residuals.model_.modeCount()),
        rows_(kBatch, residuals.parameters_ + 1),
        sums_(Eigen::MatrixXd::Zero(residuals.parameters_ + 1, residuals.parameters_ + 1)),
        moved_(std::size_t(residuals.model_.skeleton().jointCount())) {
    rows_.setZero();
  }

  void add(const SurfaceTarget& target, Eigen::Index count, TargetRows& writer) {
    if (filled_ + count > kBatch) flush();
    writer.fill(target, rows_.middleRows(filled_, count));
    for (const auto joint : writer.joints()) moved_[std::size_t(joint)] = true;
    filled_ += count;
  }

  /// The lower triangle alone is right.
  Eigen::MatrixXd& sums() {
    flush();
    return sums_;
  }

 private:
  static constexpr Eigen::Index kBatch = 192;  ///< rows that stay in the cache

  void flush() {
    if (filled_ == 0) return;  // Eigen divides by it
    std::vector<Eigen::Index> columns;
    for (Eigen::Index c = 0; c < modes_ + 3; ++c) columns.push_back(c);
    for (std::size_t joint = 0; joint < moved_.size(); ++joint)
      for (Eigen::Index c = 0; moved_[joint] && c < 3; ++c) columns.push_back(modes_ + 3 + 3 * Eigen::Index(joint) + c);
    columns.push_back(rows_.cols() - 1);
    const auto count = std::ssize(columns);
    const Rows dense = rows_.topRows(filled_)(Eigen::all, columns);
    Eigen::MatrixXd products = Eigen::MatrixXd::Zero(count, count);
    products.selfadjointView<Eigen::Lower>().rankUpdate(dense.transpose());
    for (Eigen::Index c = 0; c < count; ++c)
      for (Eigen::Index r = c; r < count; ++r)
        sums_(columns[std::size_t(r)], columns[std::size_t(c)]) += products(r, c);
    rows_.topRows(filled_).setZero();
    moved_.assign(moved_.size(), false);
    filled_ = 0;
  }

  Eigen::Index modes_, filled_ = 0;
  Rows rows_;
  Eigen::MatrixXd sums_;
  std::vector<bool> moved_;
};

BodyResiduals::BodyResiduals(const BodyModel& model, std::span<const SurfaceTarget> targets,
                             const BodyFitOptions& options, double prior_share)
    : model_(model), targets_(targets), parameters_(model.modeCount() + 3 + 3 * model.skeleton().jointCount()) {
  double weights = 0;
  for (const auto& target : targets) weights += target.weight;
  scale_ = weights > 0 ? std::sqrt(options.observations / weights) / options.sigma : 0;
  identity_prior_ = std::sqrt(options.prior * prior_share);
  joint_prior_ = std::sqrt(options.prior) / options.pose_deviation;
  std::vector<std::int32_t> bones;
  for (const auto& target : targets) bones.push_back(foremostJoint(model.parts().weights, target.corners[0]));
  by_bone_.resize(targets.size());
  std::iota(by_bone_.begin(), by_bone_.end(), std::size_t{0});
  std::ranges::stable_sort(by_bone_, {}, [&](std::size_t i) { return bones[i]; });
}

Eigen::VectorXd BodyResiduals::priorFactors() const {
  Eigen::VectorXd factors = Eigen::VectorXd::Constant(parameters_, joint_prior_);
  factors.head(model_.modeCount()).setConstant(identity_prior_);
  factors.segment<6>(model_.modeCount()).setZero();
  return factors;
}

Eigen::VectorXd BodyResiduals::priorValues(const BodyState& state) const {
  Eigen::VectorXd values(parameters_);
  values << state.identity, toVector(state.pose);
  return priorFactors().cwiseProduct(values);
}

double BodyResiduals::energy(const BodyState& state, const PosedSkin& skin) const {
  double sum = priorValues(state).squaredNorm();
  for (const auto& target : targets_) {
    Eigen::Vector3d offset = -target.position;
    for (int c = 0; c < 3; ++c)
      offset += target.barycentric[c] * skin.vertices().row(target.corners[std::size_t(c)]).transpose();
    const double squared = rowCount(target) == 1 ? std::pow(target.normal.dot(offset), 2) : offset.squaredNorm();
    sum += scale_ * scale_ * target.weight * squared;
  }
  return sum;
}

BodyResiduals::Rows BodyResiduals::rows(const BodyState& state, const PosedSkin& skin) const {
  Eigen::Index count = parameters_;
  for (const auto& target : targets_) count += rowCount(target);
  Rows all = Rows::Zero(count, parameters_ + 1);
  TargetRows writer(*this, skin);
  Eigen::Index row = 0;
  for (const auto& target : targets_) {
    writer.fill(target, all.middleRows(row, rowCount(target)));
    row += rowCount(target);
  }
  all.bottomRows(parameters_) << Eigen::MatrixXd(priorFactors().asDiagonal()), priorValues(state);
  return all;
}

Eigen::MatrixXd BodyResiduals::squares(const BodyState& state, const PosedSkin& skin) const {
  TargetRows writer(*this, skin);
  RowProducts products(*this);
  for (const auto i : by_bone_) products.add(targets_[i], rowCount(targets_[i]), writer);
  Eigen::MatrixXd& sums = products.sums();
  const Eigen::VectorXd factors = priorFactors(), values = priorValues(state);
  sums.diagonal().head(parameters_) += factors.cwiseAbs2();
  sums.row(parameters_).head(parameters_) += factors.cwiseProduct(values).transpose();
  sums(parameters_, parameters_) += values.squaredNorm();
  return sums.selfadjointView<Eigen::Lower>();
}

}  // namespace shaped
