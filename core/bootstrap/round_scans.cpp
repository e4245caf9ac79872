#include "core/bootstrap/round_scans.h"

#include <algorithm>
#include <cmath>

#include "core/numerics/error.h"
#include "core/sample/random.h"

namespace shaped {
namespace {

std::string percent(double share) { return std::to_string(std::lround(100 * share)) + " %"; }

void refuse(ScanVerdict verdict, std::string why, BootstrapScan& report) {
  report.verdict = verdict;
  report.why = std::move(why);
}

/// A field may fold a triangle away, and what is learned from it must be a shape.
std::optional<std::string> faultOf(const Topology& topology, const Vertices& shape) {
  try {
    requireValidShape(topology, shape, "");
    return std::nullopt;
  } catch (const InvalidInput& problem) {
    return problem.what();
  }
}

/// Why a registration may not join, wherever it lies.
void doubt(const RoundScans& scans, const Solved<ScanRegistration>& solved, BootstrapScan& report) {
  const auto& field = solved.solution.field;
  if (!solved.converged() && solved.termination != Termination::kIterationLimit)
    return refuse(ScanVerdict::kFailed, "the fit of the model ended as " + std::string(name(solved.termination)),
                  report);
  if (!field)
    return refuse(ScanVerdict::kFailed,
                  "next to no point of the scan lies on the fitted model, or the field overflows on it", report);
  if (const auto fault = faultOf(*scans.model.topology(), field->rest))
    return refuse(ScanVerdict::kFailed, "the field made no shape of it: " + *fault, report);
  if (report.score < scans.registration.least_score)
    refuse(ScanVerdict::kDoubtful, "only " + percent(report.score) + " of the scan lies on the registered surface",
           report);
}

}  // namespace

std::optional<FittedScan> RoundScans::fit(std::size_t scan, int round) const {
  FittedScan fitted;
  auto& report = fitted.report;
  report.scan = scan;
  report.name = scans.name(scan);
  report.round = round;
  try {
    const auto solved = registerScan(scans.load(scan), model, {}, registration);
    if (registration.stop.stop_requested()) return std::nullopt;
    const auto& found = solved.solution;
    report.outcome = solved;
    report.score = found.score;
    report.model_chamfer = found.report.chamfer;
    report.chamfer = found.field ? found.field->report.chamfer : found.report.chamfer;
    fitted.state = found.state;
    doubt(*this, solved, report);
  } catch (const InvalidInput& problem) {
    refuse(ScanVerdict::kUnusable, problem.what(), report);
  }
  return fitted;
}

Vertices RoundScans::restSurface(const FittedScan& fitted) const {
  const auto scan = scans.load(fitted.report.scan);
  const ScanSurface ready(preparedScan(scan, registration.unit_factor));
  auto found = registration.field->atRest(model, fitted.state, ready, registration.fit);
  if (!found) throw InvalidInput("scans", "\"" + fitted.report.name + "\" is no longer the scan that was registered");
  return std::move(found->rest);
}

std::vector<std::size_t> scansToTry(std::size_t count, const std::vector<BootstrapRound>& rounds,
                                    const BootstrapOptions& options) {
  std::vector<bool> left(count, true);
  for (const auto& round : rounds)
    for (const auto& scan : round.scans)
      if (scan.verdict == ScanVerdict::kJoined || scan.verdict == ScanVerdict::kUnusable) left.at(scan.scan) = false;
  std::vector<std::size_t> chosen;
  for (std::size_t scan = 0; scan < count; ++scan)
    if (left[scan]) chosen.push_back(scan);
  const auto wanted = static_cast<std::size_t>(options.sample);
  if (wanted == 0 || wanted >= chosen.size()) return chosen;
  Random random(options.seed + rounds.size());
  for (std::size_t i = 0; i < wanted; ++i)
    std::swap(chosen[i], chosen[i + static_cast<std::size_t>(random.below(static_cast<int>(chosen.size() - i)))]);
  chosen.resize(wanted);
  std::sort(chosen.begin(), chosen.end());
  return chosen;
}

}  // namespace shaped
