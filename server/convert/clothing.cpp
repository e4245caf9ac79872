#include "server/convert/clothing.h"

#include <algorithm>
#include <cmath>

#include "core/numerics/error.h"

namespace shaped::server {
namespace {

constexpr std::int64_t kMebi = 1 << 20;
constexpr std::ptrdiff_t kFewestForTightness =
    3;  ///< frames that tell cloth from skin, as estimateUnderClothing() says

std::string percent(double share) { return std::to_string(std::lround(100 * share)) + " %"; }

std::int64_t bytesOf(std::int64_t points, std::int64_t normals, std::int64_t faces) {
  return 24 * points + 24 * normals + 12 * faces;
}

}  // namespace

ClothingOptions clothingOptionsFromProto(const v1::UnderClothingOptions& message, std::stop_token stop) {
  ClothingOptions options;
  if (message.unit_factor() != 0) options.registration.unit_factor = message.unit_factor();
  if (message.has_scan_noise()) options.scan_noise = message.scan_noise();
  if (message.has_thickest()) options.thickest = message.thickest();
  options.stop = std::move(stop);
  if (const auto violation = options.firstViolation()) throw InvalidInput("options", *violation);
  return options;
}

std::int64_t scanBytes(const v1::Scan& message) {
  return bytesOf(message.positions_size() / 3, message.normals_size() / 3, message.faces_size() / 3);
}

std::int64_t scanBytes(const Scan& scan) { return bytesOf(scan.points.rows(), scan.normals.rows(), scan.faces.rows()); }

void requireClothingFits(std::int64_t frames, std::int64_t bytes, const Limits& limits, const std::string& field) {
  if (frames > limits.clothing_frames)
    throw InvalidInput(field, "is one more than the " + std::to_string(limits.clothing_frames) +
                                  " scans that the server estimates together (Server.GetLimits): leave some out, every "
                                  "other one say");
  if (bytes > limits.clothing_bytes)
    throw InvalidInput(field,
                       "makes the scans take " + std::to_string((bytes + kMebi - 1) / kMebi) + " MiB, more than the " +
                           std::to_string(limits.clothing_bytes / kMebi) +
                           " MiB that the server holds at once (--max-clothing-megabytes): thin out their points "
                           "(10,000 a scan are plenty), or leave some scans out");
}

void toProto(const ClothedFrame& frame, double best_explained, v1::EstimateUnderClothingResponse::Frame& message) {
  message.set_seen(frame.seen);
  message.set_inside(frame.inside);
  message.set_inside_strictly(frame.inside_strictly);
  message.set_mean_gap(frame.mean_gap);
  message.set_explained(frame.explained);
  message.set_trusted(frame.trusted);
  if (frame.outcome.termination == Termination::kNumericalFailure)
    message.add_warnings("the posture's solver failed: it is the last that could be computed");
  if (!frame.trusted)
    message.add_warnings("not trusted: the body explains " + percent(frame.explained) +
                         " of this scan, and of the best one " + percent(best_explained) +
                         ": a limb may have been missed");
}

std::vector<std::string> warningsOf(const ClothedBody& body) {
  const auto& frames = body.frames;
  const auto trusted = std::count_if(frames.begin(), frames.end(), [](const auto& frame) { return frame.trusted; });
  if (trusted >= kFewestForTightness) return {};
  const std::string too_large = ": cloth cannot be told from skin, and the body under loose cloth comes out too large";
  if (std::ssize(frames) < kFewestForTightness) return {"there are fewer than three scans" + too_large};
  return {"only " + std::to_string(trusted) + " of " + std::to_string(frames.size()) + " scans are trusted" +
          too_large};
}

double bestExplained(const ClothedBody& body) {
  double best = 0;
  for (const auto& frame : body.frames) best = std::max(best, frame.explained);
  return best;
}

}  // namespace shaped::server
