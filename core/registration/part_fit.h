#pragma once

#include <optional>
#include <stop_token>
#include <string>
#include <vector>

#include "core/registration/scan_surface.h"
#include "core/registration/standing_body.h"

namespace shaped {

/// How a bare part of the body is laid into the scan.
struct PartFitOptions {
  int points = 500;             ///< of either side that take part, >= 20
  double loss_scale = 0.007;    ///< a point so far away counts half of one that has no partner, m, > 0
  double normal_scale = 0.02;   ///< a partner whose normal is off by one radian counts as this much further, m, >= 0
  double sigma = 0.003;         ///< distance of all points that costs as much as a standard deviation, m, > 0
  double observations = 100;    ///< what all pairs count for together: neighbours err alike, > 0
  double pose_deviation = 0.3;  ///< of a joint's axis-angle components about what is likely, rad, > 0
  double parent_deviation =
      0.03;            ///< of the joint above, about where it stands: the part may sit a little off, rad, > 0
  double prior = 0.1;  ///< what a joint turned by one radian from there costs; a missed part costs 2, >= 0
  int rounds = 12;     ///< in which partners are found anew, >= 1
  std::optional<std::string> firstViolation() const;  ///< "points = 3, want >= 20"
};

/// A part of the body that hangs below one joint, against the scan near it; the rest of the body holds still, but that
/// the joint above may give way by a little. For bare skin: points on either side count alike. Partners are nearest in
/// place and normal together, both ways, from the part to the scan and back, so that neither a finger in the air nor
/// one that the body lacks goes unseen, and the two sides of a hand are told apart.
class PartFit {
 public:
  /// The body's model and the options must outlive it. body: where the rest of it stands; likely: what the part's
  /// joints are drawn to where the scan says little. Scan points that the rest of the body lies on, or that lie behind
  /// `joint`, take no part.
  PartFit(const ScanSurface& scan, const StandingBody& body, std::int32_t joint, const Pose& likely,
          const PartFitOptions& options);

  /// `joint` and those below it; not the one above, which the descent moves too.
  const std::vector<std::int32_t>& joints() const { return joints_; }
  /// Whether both sides have points enough to say anything.
  bool tells() const;

  /// Mean robust cost both ways and that of the joints' turns; 0 to 2 and the latter.
  double cost(const Pose& pose) const;

  /// The pose after descending in the part's joints and, by a little, the one above: damped Gauss-Newton steps on the
  /// distances along the scan's normals under a loss that narrows (Geman and McClure), partners found anew before each;
  /// the best by cost() of all it came by, within the joints' limits. Where none has a finite cost: the start.
  Pose descended(const Pose& start) const;

 private:
  /// Positions from the joint, and normals, as columns of six numbers.
  using Points = Eigen::Matrix<double, 6, Eigen::Dynamic>;
  struct Pair {
    Eigen::Index vertex, scan;
    double squared;  ///< m^2
  };
  struct Pairs {
    std::vector<Pair> outward, back;  ///< of each of the part's points, and of each of the scan's
  };

  void chooseVertices(const StandingBody& body, const std::vector<bool>& mine);
  void chooseScanPoints(const ScanSurface& scan, const StandingBody& body, const std::vector<bool>& mine);
  /// share: of the body's surface that is the part's.
  void keepScanPoints(const ScanSurface& scan, const std::vector<Eigen::Index>& open, double share);
  PosedSkin skinOf(const Pose& pose) const;
  Points pointsOf(const PosedSkin& skin) const;
  Pairs pairsOf(const Points& part) const;
  Pair pairOf(const Points& part, Eigen::Index vertex, Eigen::Index scan) const;
  double cost(const Pairs& pairs, const Pose& pose) const;
  /// From what is likely, in standard deviations, squared.
  double turned(const Pose& pose) const;
  /// How a pair's height follows the joints that move.
  Eigen::RowVectorXd rowOf(const Pair& pair, PointDerivatives& derivatives) const;
  void step(const PosedSkin& skin, const Points& part, const Pairs& pairs, double scale, Pose& pose) const;
  /// Adds the prior to normal equations, and takes the step.
  void turn(Eigen::MatrixXd normal, Eigen::VectorXd right, Pose& pose) const;
  void keepLimits(Pose& pose) const;

  const BodyModel& model_;
  const PartFitOptions& options_;
  bool oriented_;
  Pose likely_;
  std::vector<std::int32_t> joints_, vertices_;
  std::vector<std::int32_t> moving_;  ///< the joint above, then joints_
  std::vector<double> deviations_;    ///< of moving_
  Eigen::RowVector3d centre_;
  Vertices rest_, rest_joints_, rest_normals_;
  SkinWeights weights_;
  Points scan_;
  double scan_share_ = 0;  ///< of one scan point, so that as many as the part should have count 1
};

}  // namespace shaped
