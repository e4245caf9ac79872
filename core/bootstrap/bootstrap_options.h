#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "core/body/posture.h"
#include "core/registration/scan_registration.h"
#include "core/sample/virtual_scanner.h"

namespace shaped {

struct BootstrapOptions {
  int rounds = 5;         ///< at most, >= 1
  int modes = 11;         ///< k of each round's model, >= 1; fewer where the registrations have fewer
  int least_joined = 10;  ///< a round in which fewer join is the last, >= 1
  int sample = 0;         ///< scans that a round tries, drawn from those left, >= 0; 0: all
  double acceptance = 1;  ///< standard deviations above the smallest distance up to which a registration joins, >= 0
  /// After the first round every registration, those that joined among them, serves both, model and field, as line 3 of
  /// Algorithm 2 draws both from all that is registered. Else the two stay apart and what joins serves the model alone,
  /// as in the experiments of [Mur25].
  bool share_registrations = true;
  PostureNormalisation posture = PostureNormalisation::kSkeleton;
  double reach = 0.1;                    ///< of PostureNormalisation::kLocal, m, > 0
  ScanRegistrationOptions registration;  ///< its field, stop and `refine` are not looked at
  int virtual_scans = 2;                 ///< of each registration without a scan, each in a posture of its own, >= 1
  double virtual_turns = 0.06;    ///< standard deviation of the joints' axis-angle components in these, rad, >= 0
  VirtualScannerOptions scanner;  ///< of those; its seed is not looked at
  std::uint64_t seed = 1;         ///< of virtual scans and samples

  std::optional<std::string> firstViolation() const;  ///< "rounds = 0, want >= 1"
};

}  // namespace shaped
