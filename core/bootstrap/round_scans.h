#pragma once

#include <optional>
#include <vector>

#include "core/bootstrap/bootstrap.h"

namespace shaped {

/// A scan that is registered, and what it takes to do so.
struct RoundScans {
  const ScanSource& scans;
  const BodyModel& model;
  ScanRegistrationOptions registration;  ///< with the field and the stop token

  /// Registers a scan and says how that went. Nothing once the stop token has fired.
  std::optional<FittedScan> fit(std::size_t scan, int round) const;
  /// X' at rest of a scan that was fitted, V x 3, the same bits as when it was. Throws InvalidInput when the scan is
  /// not what it was.
  Vertices restSurface(const FittedScan& fitted) const;
};

/// The scans that a round tries, ascending: those that have neither joined nor turned out to be unusable in the rounds
/// before; with options.sample > 0 as many of them drawn at random.
std::vector<std::size_t> scansToTry(std::size_t count, const std::vector<BootstrapRound>& rounds,
                                    const BootstrapOptions& options);

}  // namespace shaped
