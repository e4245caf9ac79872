#pragma once

#include <deque>

#include "core/clothing/clothing_pairs.h"

namespace shaped {

/// The poses of some frames.
std::vector<Pose> posesOf(const BodySequence& state, const std::vector<std::size_t>& frames);

/// The frames of a dressed person, and the steps that minimise (10.1) over them.
class ClothedSequence {
 public:
  /// All must outlive it. landmarks: one list a scan, or none at all.
  ClothedSequence(const std::deque<ScanSurface>& scans, const BodyModel& model,
                  std::span<const std::vector<Landmark>> landmarks, const ClothingOptions& options);

  std::size_t size() const { return frames_.size(); }

  /// The identity on some frames together with the postures of at most options.together of them, spread evenly: how
  /// long a leg is and how far a knee bends under cloth hang together, and in turn each would wait for the other. Then
  /// the identity on all of them with the postures held, which ends sooner: its outcome.
  Outcome settleIdentity(BodySequence& state, const std::vector<std::size_t>& frames, const ClothingTerms& terms,
                         const Eigen::VectorXd& tightness) const;
  /// The posture of one frame, the identity held.
  Outcome settlePosture(BodySequence& state, std::size_t frame, const ClothingTerms& terms,
                        const Eigen::VectorXd& tightness) const;
  /// Tries limbs of one frame in other ways (otherLimbPoses, with those of `others`) and keeps what lies better.
  void reseatLimbs(BodySequence& state, std::size_t frame, std::span<const Pose> others, const ClothingTerms& terms,
                   const Eigen::VectorXd& tightness) const;
  /// The same with the limbs as a search over all their turns seats them: all at once, then one by one, as it may find
  /// an arm and lose a leg.
  void searchLimbs(BodySequence& state, std::size_t frame, const ClothingTerms& terms,
                   const Eigen::VectorXd& tightness) const;
  /// Seats hands and feet of one frame by themselves (seatExtremity), drawn to how they stand in `neighbours`.
  void seatExtremities(BodySequence& state, std::size_t frame, const std::vector<std::size_t>& neighbours) const;

  /// How much each vertex that takes part may be believed to be skin, or cloth drawn tight: by how little its gap
  /// varies over some frames, (s^2 / (s^2 + variance))^2 with s the option tight_spread, relative to the tightest
  /// tenth; 0 where fewer than three see it. Empty (all alike) for fewer than three frames.
  Eigen::VectorXd tightness(const BodySequence& state, const std::vector<std::size_t>& frames) const;

  ClothedFrame measured(const BodySequence& state, std::size_t frame, const Outcome& outcome) const;

 private:
  struct Moving {
    bool identity, pose;
  };
  /// Closest points and steps in turn, until the surfaces stand still. One pose in `state` for each of `frames`.
  Solved<BodySequence> settled(BodySequence state, const std::vector<std::size_t>& frames, const ClothingTerms& terms,
                               const Eigen::VectorXd& tightness, Moving moving, int rounds) const;
  /// Settles one frame from each of some poses, and keeps the one that lies best, if better than the present one.
  void keepBest(BodySequence& state, std::size_t frame, std::span<const Pose> starts, const ClothingTerms& terms,
                const Eigen::VectorXd& tightness) const;
  Vertices surfaceOf(const Eigen::VectorXd& identity, const Pose& pose) const;
  BodyFitOptions fitOptions(const std::vector<std::vector<SurfaceTarget>>& targets, Moving moving) const;

  const std::deque<ScanSurface>& scans_;
  const BodyModel& model_;
  const ClothingOptions& options_;
  std::vector<Limb> limbs_;
  std::deque<ClothingPairs> frames_;
};

}  // namespace shaped
