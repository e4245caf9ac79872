#include "core/io/marker_file.h"

#include <algorithm>

#include "core/io/c3d.h"
#include "core/io/file.h"
#include "core/io/frames.h"
#include "core/io/marker_csv.h"
#include "core/io/text_scanner.h"
#include "core/io/trc.h"
#include "core/numerics/error.h"

namespace shaped {
namespace {

MarkerTrial readNpyMarkers(const std::filesystem::path& path, std::span<const std::string> labels) {
  const FrameReader reader(path);
  if (reader.vertexCount() != static_cast<std::int64_t>(labels.size()))
    throw InvalidInput(path.string(), "has " + std::to_string(reader.vertexCount()) + " markers a frame, but " +
                                          std::to_string(labels.size()) +
                                          " labels are given; name them with a marker set in the array's order");
  MarkerTrial trial{{labels.begin(), labels.end()}, 0, {}};
  for (std::int64_t f = 0; f < reader.frameCount(); ++f) {
    auto& frame = trial.frames.emplace_back(reader.frame(f, true));
    for (Eigen::Index m = 0; m < frame.rows(); ++m)
      if (!frame.row(m).allFinite()) frame.row(m).setConstant(std::numeric_limits<double>::quiet_NaN());
  }
  return trial;
}

/// Would a text format give the label back as it is? Readers drop white space at its ends.
bool survivesText(const std::string& label) {
  const auto control = [](unsigned char c) { return c < 0x20 || c == 0x7f; };
  return !label.empty() && label.front() != ' ' && label.back() != ' ' &&
         label.find_first_of(",\"#") == std::string::npos && std::none_of(label.begin(), label.end(), control);
}

void requireWritable(const std::filesystem::path& path, const MarkerTrial& trial, bool with_labels) {
  if (trial.frames.empty() || trial.labels.empty()) throw InvalidInput(path.string(), "no markers to write");
  for (std::size_t f = 0; f < trial.frames.size(); ++f)
    if (trial.frames[f].rows() != static_cast<Eigen::Index>(trial.labels.size()))
      throw InvalidInput(
          "frames[" + std::to_string(f) + "]",
          "has " + std::to_string(trial.frames[f].rows()) + " markers, want " + std::to_string(trial.labels.size()));
  for (const auto& label : trial.labels)
    if (with_labels && !survivesText(label))
      throw InvalidInput(path.string(), "cannot hold the label " + quotedWord(label));
}

}  // namespace

MarkerTrial readMarkers(const std::filesystem::path& path, std::span<const std::string> npy_labels) {
  const auto extension = extensionOf(path);
  if (extension == ".npy") return readNpyMarkers(path, npy_labels);
  if (extension == ".c3d") return readC3d(path);
  if (extension == ".trc") return parseTrc(path.string(), readFile(path));
  if (extension == ".csv") return parseMarkerCsv(path.string(), readFile(path));
  throw InvalidInput(path.string(),
                     "holds no markers by its extension '" + extension + "'; want .c3d, .trc, .csv or .npy");
}

void writeMarkers(const std::filesystem::path& path, const MarkerTrial& trial) {
  const auto extension = extensionOf(path);
  if (extension != ".npy" && extension != ".trc" && extension != ".csv")
    throw InvalidInput(path.string(), "cannot be written as '" + extension + "'; want .trc, .csv or .npy");
  requireWritable(path, trial, extension != ".npy");
  if (extension == ".npy") return writeFrames(path, trial.frames);
  writeFile(path, extension == ".trc" ? formatTrc(trial) : formatMarkerCsv(trial));
}

void turnZUpToYUp(MarkerTrial& trial) {
  for (auto& frame : trial.frames) {
    const Eigen::VectorXd y = frame.col(1);
    frame.col(1) = frame.col(2);
    frame.col(2) = -y;
  }
}

}  // namespace shaped
