#include "tests/fuzz/marker_round_trip.h"

#include <cmath>
#include <vector>

#include "core/io/marker_file.h"
#include "tests/fuzz/fuzz.h"

namespace shaped::fuzz {
namespace {

const std::vector<std::string> kLabels{"A", "B", "C"};

bool same(double one, double other, double tolerance) {
  if (std::isnan(one) || std::isnan(other)) return std::isnan(one) && std::isnan(other);
  return std::abs(one - other) <= tolerance * std::abs(one) + (tolerance > 0 ? 1e-300 : 0);
}

void requireSame(const MarkerTrial& one, const MarkerTrial& other, double tolerance) {
  require(one.labels == other.labels, "labels survive");
  require(one.rate_hz == other.rate_hz, "the rate survives");
  require(one.frames.size() == other.frames.size(), "frames survive");
  for (std::size_t f = 0; f < one.frames.size(); ++f)
    for (Eigen::Index i = 0; i < one.frames[f].size(); ++i)
      require(same(one.frames[f].data()[i], other.frames[f].data()[i], tolerance), "coordinates survive");
}

}  // namespace

void requireTrial(const MarkerTrial& trial) {
  require(!trial.labels.empty() && !trial.frames.empty(), "a trial has markers and frames");
  require(std::isfinite(trial.rate_hz) && trial.rate_hz >= 0, "the rate is 0 or a positive number");
  for (const auto& frame : trial.frames) {
    require(frame.rows() == static_cast<Eigen::Index>(trial.labels.size()), "a frame has a row for every label");
    for (const auto& row : frame.rowwise())
      require(row.allFinite() || row.array().isNaN().all(), "a marker is finite or missing");
  }
}

void readAndRewriteMarkers(std::string_view bytes, const std::string& extension, const std::string& written) {
  const auto file = scratchFile("markers" + extension, bytes);
  const auto trial = accepted<InvalidInput>([&] { return readMarkers(file, kLabels); });
  if (!trial) return;
  requireTrial(*trial);
  if (written.empty()) return;
  const auto copy = scratchFolder() / ("copy" + written);
  // a label that the format cannot hold is refused, as documented
  if (!accepted<InvalidInput>([&] { return writeMarkers(copy, *trial), true; })) return;
  requireSame(*trial, readMarkers(copy, kLabels), written == ".trc" ? 1e-14 : 0);
}

}  // namespace shaped::fuzz
