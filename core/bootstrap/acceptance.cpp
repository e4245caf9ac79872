#include "core/bootstrap/acceptance.h"

#include <Eigen/Core>
#include <cmath>
#include <iomanip>
#include <sstream>

namespace shaped {
namespace {

std::string millimetres(double metres) {
  std::ostringstream text;
  text << std::fixed << std::setprecision(2) << 1e3 * metres << " mm";
  return text.str();
}

Eigen::ArrayXd distancesOfPending(const std::vector<BootstrapScan>& scans) {
  std::vector<double> distances;
  for (const auto& scan : scans)
    if (scan.verdict == ScanVerdict::kPending) distances.push_back(scan.chamfer);
  return Eigen::Map<const Eigen::ArrayXd>(distances.data(), std::ssize(distances));
}

}  // namespace

void judge(double deviations, BootstrapRound& round) {
  const Eigen::ArrayXd distances = distancesOfPending(round.scans);
  if (distances.size() == 0) return;
  round.smallest = distances.minCoeff();
  round.largest = distances.maxCoeff();
  round.accepted_below = round.smallest + deviations * std::sqrt((distances - distances.mean()).square().mean());
  for (auto& scan : round.scans) {
    if (scan.verdict != ScanVerdict::kPending) continue;
    const bool joins = scan.chamfer <= round.accepted_below;
    scan.verdict = joins ? ScanVerdict::kJoined : ScanVerdict::kTooFar;
    round.joined += joins;
    if (!joins)
      scan.why = "lies " + millimetres(scan.chamfer) + " from its registration, and the round accepts up to " +
                 millimetres(round.accepted_below);
  }
}

}  // namespace shaped
