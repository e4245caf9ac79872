#pragma once

#include <deque>
#include <optional>
#include <set>
#include <span>
#include <vector>

#include "core/clothing/under_clothing.h"

namespace shaped {

/// A frame registered as if it were naked: not who is in it, but how they stand.
struct FirstFit {
  BodyState state;
  double score = -1;  ///< ScanRegistration::score
};

/// First fits of all frames. A descent from rest misses limbs that swing (arms above all, which it draws to the trunk),
/// so limbs are seated by searchLimbs; and a frame that still fits badly is tried again from the poses of those that
/// fit well, the nearest in time first.
class FirstFits {
 public:
  /// All must outlive it; scans: their normals outwards. landmarks: one list a scan, or none at all.
  FirstFits(const std::deque<ScanSurface>& scans, const BodyModel& model,
            std::span<const std::vector<Landmark>> landmarks, const ClothingOptions& options);

  /// One a frame; those that were not reached when options.stop fired have a score below 0.
  const std::vector<FirstFit>& run();

  /// The frame that fitted best.
  std::size_t best() const;

 private:
  bool stopped() const { return options_.stop.stop_requested(); }
  bool good(std::size_t frame) const { return fits_[frame].score >= options_.good_share * fits_[best()].score; }
  std::vector<Landmark> landmarksOf(std::size_t frame) const;

  void fitAlone(std::size_t frame);
  void retry(std::size_t frame);
  /// Descends from a start, and keeps the result if it is better.
  void descend(std::size_t frame, const BodyState& start);
  BodyState seated(std::size_t frame, const BodyState& start, bool backwards = false) const;

  std::vector<std::size_t> goodFramesNear(std::size_t frame) const;
  std::optional<std::size_t> badFrameNearGood() const;

  const std::deque<ScanSurface>& scans_;
  const BodyModel& model_;
  std::span<const std::vector<Landmark>> landmarks_;
  const ClothingOptions& options_;
  std::vector<FirstFit> fits_;
  std::set<std::size_t> tried_;  ///< frames that were tried again
};

}  // namespace shaped
