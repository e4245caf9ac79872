#include <algorithm>
#include <cstdlib>

#include "core/io/frames.h"
#include "core/io/marker_file.h"
#include "core/io/marker_set_file.h"
#include "core/model/marker_fitter.h"
#include "tests/benchmark/experiments/calibration.h"
#include "tests/benchmark/experiments/experiment.h"
#include "tests/benchmark/experiments/models.h"
#include "tests/benchmark/experiments/timing.h"

namespace shaped::experiments {
namespace {

/// The frames of one trial as they were fitted.
struct Record {
  std::vector<double> rms, seconds, area, reach;  ///< reach: largest |y_j| in deviations of its mode
  std::vector<std::size_t> failed;
  std::vector<double> marker_squares, marker_counts;
  double scale = 1;
};

void take(Record& record, const MarkerFit& fit, const ShellPgaModel& model, double area) {
  record.rms.push_back(fit.rms);
  record.area.push_back(area);
  record.scale = fit.scale;
  if (fit.point.alpha.size() > 0) {
    const Eigen::VectorXd y = model.submanifold().tangentCoordinates(fit.point);
    record.reach.push_back(y.cwiseAbs().cwiseQuotient(model.pga().eigenvalues.head(y.size()).cwiseSqrt()).maxCoeff());
  }
  record.marker_squares.resize(static_cast<std::size_t>(fit.residuals.size()));
  record.marker_counts.resize(record.marker_squares.size());
  for (std::size_t l = 0; l < record.marker_squares.size(); ++l) {
    const double residual = fit.residuals[static_cast<Eigen::Index>(l)];
    if (!std::isfinite(residual)) continue;
    record.marker_squares[l] += residual * residual;
    record.marker_counts[l] += 1;
  }
}

double mean(const std::vector<double>& values) {
  double sum = 0;
  for (const double value : values) sum += value / static_cast<double>(values.size());
  return sum;
}

std::string worstMarkers(const Record& record, const MarkerSet& set) {
  std::vector<std::pair<double, std::string>> markers;
  for (std::size_t l = 0; l < set.markers.size(); ++l)
    markers.emplace_back(std::sqrt(record.marker_squares[l] / std::max(1.0, record.marker_counts[l])),
                         set.markers[l].label);
  std::sort(markers.rbegin(), markers.rend());
  std::string result;
  for (std::size_t l = 0; l < std::min<std::size_t>(5, markers.size()); ++l)
    result += text("%s%s %.1f", l ? ", " : "", markers[l].second.c_str(), 1e3 * markers[l].first);
  return result + text("; least: %s %.1f", markers.back().second.c_str(), 1e3 * markers.back().first);
}

void tell(Report& report, const Record& record, const MarkerSet& set, std::size_t frames) {
  std::string failed;
  for (std::size_t i = 0; i < std::min<std::size_t>(record.failed.size(), 20); ++i)
    failed += text("%s%zu", i ? " " : "; not: ", record.failed[i]);
  report.entry("frames fitted, converged", text("%zu of %zu", frames - record.failed.size(), frames) + failed, "all",
               record.failed.empty());
  const double rms = 1e3 * mean(record.rms);
  report.entry("RMS over markers, mean and largest frame",
               text("%.1f and %.1f mm", rms, 1e3 * *std::max_element(record.rms.begin(), record.rms.end())),
               "<= 15 to 23 mm (skeleton with offsets)",
               1e-3 * rms <= 0.023 && *std::max_element(record.rms.begin(), record.rms.end()) <= 0.023);
  report.entry("RMS of a marker over the frames, the five worst", worstMarkers(record, set) + " mm");
  report.entry("CPU s a frame at full resolution: mean, median, largest; first frame",
               text("%.2f, %.2f, %.2f; %.2f", mean(record.seconds), median(record.seconds),
                    *std::max_element(record.seconds.begin() + 1, record.seconds.end()), record.seconds.front()),
               "<= 0.5", mean(record.seconds) <= 0.5);
  report.entry("smallest area ratio: least, median",
               text("%.3f, %.3f", *std::min_element(record.area.begin(), record.area.end()), median(record.area)));
  report.entry("largest coordinate in deviations of its mode: largest, median; scale of the subject",
               text("%.1f, %.1f; %.3f", *std::max_element(record.reach.begin(), record.reach.end()),
                    median(record.reach), record.scale));
}

}  // namespace

/// SHAPED_ROW8_FRAMES=first:last:step chooses frames, SHAPED_ROW8_OUT a .npy file for the fitted meshes.
void row8RealTrial() {
  const auto set = bodies();
  const auto model = keptOrTrained(kAllBodies, set, 20);
  const auto markers = readMarkerSet(dataPath("marker_trials/marker_sets/cmu41.json"), set.topology->vertexCount(),
                                     static_cast<std::int32_t>(set.topology->faces().rows()));
  auto trial = readMarkers(dataPath("cmu_mocap/c3d/85_02.c3d"));
  turnZUpToYUp(trial);
  const auto rows = matchLabels(markers, trial.labels);
  std::size_t first = 0, last = trial.frames.size(), step = 1;
  if (const char* range = std::getenv("SHAPED_ROW8_FRAMES")) std::sscanf(range, "%zu:%zu:%zu", &first, &last, &step);
  Report report(text("Row 8: the real trial 85_02.c3d, frames %zu to %zu by %zu", first, last - 1, step));
  const OneThread one_thread;
  MarkerFitter fitter(model, markers, {});
  std::vector<Vertices> frames;
  for (std::size_t frame = first; frame < std::min(last, trial.frames.size()); frame += step)
    frames.push_back(trial.frames[frame](rows, Eigen::all));
  const Stopwatch calibration;
  fitter.calibrate(calibrationFrames(frames));
  report.entry("CPU s to estimate the size from 3 frames", text("%.1f", calibration.cpu()));
  std::optional<FrameWriter> out;
  if (const char* path = std::getenv("SHAPED_ROW8_OUT")) out.emplace(path);
  Record record;
  for (std::size_t i = 0; i < frames.size(); ++i) {
    const std::size_t frame = first + i * step;
    const Stopwatch watch;
    const auto fitted = fitter.fit(frames[i]);
    record.seconds.push_back(watch.cpu());
    if (!fitted.converged()) record.failed.push_back(frame);
    take(record, fitted.solution.fit, *model, fitted.solution.smallest_area_ratio);
    if (std::getenv("SHAPED_ROW8_TRACE"))
      std::fprintf(stderr, "%zu %s %.4f %.3f %.3f %.2f %.4g\n", frame, name(fitted.termination).data(),
                   record.rms.back(), record.area.back(), record.seconds.back(), record.reach.back(),
                   fitted.solution.fit.prior_energy);
    if (out) out->append(fitted.solution.shape);
  }
  if (out) out->close();
  tell(report, record, markers, frames.size());
}

}  // namespace shaped::experiments
