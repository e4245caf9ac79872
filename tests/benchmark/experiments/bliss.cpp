#include "core/sample/random.h"
#include "core/sample/virtual_scanner.h"
#include "tests/benchmark/experiments/bliss_growth.h"
#include "tests/benchmark/experiments/body_data.h"

namespace shaped::experiments {

void bliss() {
  Report report("BLiSS on bodies: 30 identities for the model, 30 for the field, 11 modes");
  const auto data = bodyData();
  std::vector<Vertices> known;
  for (std::size_t i = 0; i < 60; ++i) known.push_back(data.rest[data.others[i]]);
  // Raw scans of the 20 bodies that are left, and of 40 halfway between two of these.
  const auto scans = std::make_shared<std::vector<Scan>>();
  Random random(17);
  for (std::size_t i = 0; i < std::size_t(setting("SHAPED_UNREGISTERED", 60)); ++i) {
    const auto& one = data.rest[data.others[60 + i % 20]];
    const auto& other = data.rest[data.others[60 + std::size_t(random.below(20))]];
    VirtualScannerOptions scanner;
    scanner.seed = random.bits();
    const Vertices body = i < 20 ? one : (one + other) / 2;
    const Vertices posed = slightlyPosed(data.reference, body, random.bits());
    scans->push_back(scanVirtually(posed, data.reference.topology->faces(), scanner).scan);
  }
  std::vector<Trial> trials;
  for (auto& truth : trueScans()) trials.push_back({truth.scan, truth.body, data.rest[truth.identity]});
  grow(report, growthInputs(data.reference, known, scans), growthOptions(), trials);
}

}  // namespace shaped::experiments
