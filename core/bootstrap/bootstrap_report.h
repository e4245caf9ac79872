#pragma once

#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

#include "core/numerics/solved.h"

namespace shaped {

/// What became of a scan in a round.
enum class ScanVerdict {
  kPending,   ///< registered; whether it joins is seen at the round's end
  kJoined,    ///< its registration is one of those that the model is learned from
  kTooFar,    ///< it lies farther from its registration than the round accepts; it stays for the next round
  kDoubtful,  ///< its score is below what is trusted; it stays
  kFailed,    ///< the fit did not end well, or the field could not deform it; it stays
  kUnusable   ///< it cannot be registered at all, and is not tried again
};

constexpr std::string_view name(ScanVerdict verdict) {
  switch (verdict) {
    case ScanVerdict::kPending:
      return "pending";
    case ScanVerdict::kJoined:
      return "joined";
    case ScanVerdict::kTooFar:
      return "too_far";
    case ScanVerdict::kDoubtful:
      return "doubtful";
    case ScanVerdict::kFailed:
      return "failed";
    case ScanVerdict::kUnusable:
      return "unusable";
  }
  return "unknown";
}

/// How the registration of a scan went in a round.
struct BootstrapScan {
  std::size_t scan = 0;  ///< of the unregistered ones
  std::string name;
  int round = 0;             ///< from 1
  Outcome outcome;           ///< of the model's fit
  double model_chamfer = 0;  ///< both ways, of the model's surface and the scan, m
  double chamfer = 0;        ///< the same of the surface that the field made of it; the model's where it made none
  double score = 0;          ///< ScanRegistration::score
  ScanVerdict verdict = ScanVerdict::kPending;
  std::string why;  ///< a sentence, unless it joined or is pending
};

/// A round that has ended.
struct BootstrapRound {
  int round = 0;                     ///< from 1
  std::size_t registrations = 0;     ///< that the round's model was learned from
  double smallest = 0, largest = 0;  ///< chamfer distance of the registrations that were compared, m; 0 with none
  double accepted_below = 0;         ///< smallest + acceptance * standard deviation, m
  std::size_t examples = 0;          ///< that taught its field; all fits of the others failed or were doubtful
  std::size_t joined = 0;
  std::vector<BootstrapScan> scans;  ///< that were tried, ascending
};

/// Why there was no further round.
enum class BootstrapEnd {
  kRoundsDone,  ///< all that were asked for
  kFewJoined,   ///< fewer than least_joined joined
  kNoneLeft     ///< no scan was left
};

constexpr std::string_view name(BootstrapEnd end) {
  switch (end) {
    case BootstrapEnd::kRoundsDone:
      return "rounds_done";
    case BootstrapEnd::kFewJoined:
      return "few_joined";
    case BootstrapEnd::kNoneLeft:
      return "none_left";
  }
  return "unknown";
}

}  // namespace shaped
