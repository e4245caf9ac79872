#include <algorithm>
#include <cmath>
#include <optional>

#include "client/marker_fit.h"
#include "client/mesh.h"
#include "client/models.h"
#include "client/shapectl/frame_range.h"
#include "client/shapectl/numbers.h"
#include "client/shapectl/output.h"
#include "client/shapectl/progress_bar.h"
#include "client/shapectl/verbs/verbs.h"
#include "core/io/file.h"
#include "core/io/frames.h"
#include "core/io/marker_file.h"
#include "core/io/marker_set_file.h"

namespace shaped::shapectl {
namespace {

std::vector<std::string> labelsOf(const MarkerSet& set) {
  std::vector<std::string> labels;
  for (const auto& marker : set.markers) labels.push_back(marker.label);
  return labels;
}

/// Gathers the frames' answers into the report.
class Report {
 public:
  explicit Report(std::vector<std::string> labels)
      : labels_(std::move(labels)), sums_(labels_.size()), counts_(labels_.size()) {}

  void add(const v1::FitMarkersResponse& response) {
    model_ = response.model();
    nlohmann::json frame{
        {"frame", response.frame()}, {"rms", response.rms()}, {"smallest_area_ratio", response.smallest_area_ratio()}};
    addReport(frame, response.report());
    auto& residuals = frame["residuals"] = nlohmann::json::object();
    for (std::size_t i = 0; i < labels_.size(); ++i) addResidual(residuals, i, response.residuals(static_cast<int>(i)));
    frames_.push_back(std::move(frame));
    const auto& solver = response.report();
    if (solver.termination() != v1::TERMINATION_CONVERGED && worst_.termination() == v1::TERMINATION_CONVERGED)
      worst_.set_termination(solver.termination());
    worst_.set_iterations(worst_.iterations() + solver.iterations());
    worst_.set_residual(std::max(worst_.residual(), solver.residual()));
    worst_.set_seconds(worst_.seconds() + solver.seconds());
    smallest_area_ratio_ = std::min(smallest_area_ratio_, response.smallest_area_ratio());
  }

  /// Of all frames: iterations and seconds add up, the first that did not converge names the termination.
  const v1::SolverReport& solver() const { return worst_; }

  /// Everything; without the frames for the terminal.
  nlohmann::json document(bool with_frames) const {
    nlohmann::json document{{"frame_count", frames_.size()}, {"smallest_area_ratio", smallest_area_ratio_}};
    addModel(document, model_);
    addReport(document, worst_);
    auto& markers = document["marker_rms"] = nlohmann::json::object();
    for (std::size_t i = 0; i < labels_.size(); ++i)
      markers[labels_[i]] = counts_[i] > 0 ? std::sqrt(sums_[i] / counts_[i]) : std::nan("");
    document["rms"] = rms();
    if (with_frames) document["frames"] = frames_;
    return document;
  }

  double rms() const {
    double sum = 0, count = 0;
    for (std::size_t i = 0; i < labels_.size(); ++i) sum += sums_[i], count += counts_[i];
    return count > 0 ? std::sqrt(sum / count) : std::nan("");
  }

 private:
  void addResidual(nlohmann::json& residuals, std::size_t marker, double residual) {
    residuals[labels_[marker]] = residual;  // NaN, a marker not seen, becomes null
    if (!std::isfinite(residual)) return;
    sums_[marker] += residual * residual;
    counts_[marker] += 1;
  }

  static v1::SolverReport converged() {
    v1::SolverReport report;
    report.set_termination(v1::TERMINATION_CONVERGED);
    return report;
  }

  const std::vector<std::string> labels_;
  std::vector<double> sums_, counts_;  // squared residuals per marker
  v1::ModelVersion model_;
  v1::SolverReport worst_ = converged();
  double smallest_area_ratio_ = 1;
  nlohmann::json frames_ = nlohmann::json::array();
};

struct Fit {
  std::string name, trial_file, set_file, range, out, report_file;
  std::int64_t modes = 0, calibration = 3;
  double prior_weight = 0, scale = 0;

  void declare(Arguments& arguments) {
    arguments.positional("NAME", name, "The model, NAME or NAME@VERSION");
    arguments.positional("TRIAL", trial_file, "Marker trial: .c3d, .trc, .csv, or .npy (n x L x 3 in the set's order)");
    arguments.option("--marker-set", set_file, "M.json", "Where the markers sit on the model");
    arguments.required();
    arguments.option("--frames", range, "a:b:step", "Frames to fit, as a Python slice (all)");
    arguments.option("-o,--out", out, "OUT.npy", "Write the shapes, n x V x 3 [m]");
    arguments.option("--report", report_file, "R.json", "Write how each frame and marker fits");
    arguments.option("--modes", modes, "J", "Principal variations to use (all)");
    arguments.option("--prior-weight", prior_weight, "G", "Weight of the model against the markers (1)");
    arguments.option("--scale", scale, "S", "Size of the subject over that of the model (estimated)");
    arguments.option("--calibration", calibration, "N",
                     "Frames, spread over the trial, that tell the size, 1 to 16 (3)");
  }

  ExitCode run(const Session& session) const {
    const auto channel = session.channel();
    const auto model = client::getModelMesh(channel, parseModel(name), session.callOptions());
    const auto set = readMarkerSet(set_file, static_cast<std::int32_t>(model.mean.rows()),
                                   static_cast<std::int32_t>(model.faces.rows()));
    const auto trial = readMarkers(trial_file, labelsOf(set));
    const auto rows = matchLabels(set, trial.labels);
    const client::MarkerFrames frames{framesOf(range, std::ssize(trial.frames)), [&](std::int64_t number) {
                                        const auto& all = trial.frames[static_cast<std::size_t>(number)];
                                        Vertices wanted(std::ssize(rows), 3);
                                        for (Eigen::Index i = 0; i < wanted.rows(); ++i)
                                          wanted.row(i) = all.row(rows[static_cast<std::size_t>(i)]);
                                        return wanted;
                                      }};
    Report report(labelsOf(set));
    stream(channel, model, set, frames, session, report);
    if (!report_file.empty())
      writeFile(report_file,
                report.document(true).dump(2, ' ', false, nlohmann::json::error_handler_t::replace) + "\n");
    print(report, session);
    return exitCodeOf(report.solver());
  }

 private:
  void stream(const std::shared_ptr<grpc::Channel>& channel, const client::ModelMesh& model, const MarkerSet& set,
              const client::MarkerFrames& frames, const Session& session, Report& report) const {
    v1::FitMarkersRequest::Setup setup;
    *setup.mutable_model() = client::pinned(model.description);
    *setup.mutable_marker_set() = client::pack(set);
    setup.set_modes(countOf("--modes", modes));
    setup.set_prior_weight(prior_weight);
    setup.set_scale(scale);
    if (scale == 0) addCalibration(frames, setup);
    setup.set_without_shapes(out.empty());
    std::optional<FrameWriter> writer;
    if (!out.empty()) writer.emplace(out);
    ProgressBar bar;
    double done = 0;
    client::fitMarkers(channel, setup, frames, session.callOptions(), [&](const v1::FitMarkersResponse& response) {
      report.add(response);
      if (writer) writer->append(client::unpack(response.shape().positions()));
      bar.show(++done / static_cast<double>(frames.numbers.size()),
               "RMS " + std::to_string(1000 * response.rms()) + " mm");
    });
    if (writer) writer->close();
  }

  /// The frames with most markers, each out of one of `calibration` equal stretches of those that are fitted.
  void addCalibration(const client::MarkerFrames& frames, v1::FitMarkersRequest::Setup& setup) const {
    if (calibration < 1 || calibration > 16)
      throw InvalidInput("--calibration", std::to_string(calibration) + ", want 1 to 16");
    const auto& numbers = frames.numbers;
    const auto stretches = std::min(static_cast<std::size_t>(calibration), numbers.size());
    for (std::size_t k = 0; k < stretches; ++k) {
      const auto begin = numbers.begin() + static_cast<std::ptrdiff_t>(k * numbers.size() / stretches);
      const auto end = numbers.begin() + static_cast<std::ptrdiff_t>((k + 1) * numbers.size() / stretches);
      const auto seen = [&](std::int64_t number) {
        return frames.positions(number).rowwise().sum().array().isFinite().count();
      };
      const auto best = std::max_element(begin, end, [&](auto a, auto b) { return seen(a) < seen(b); });
      if (seen(*best) > 3) *setup.add_calibration() = client::packFrame(frames, *best);
    }
  }

  static void print(const Report& report, const Session& session) {
    const auto document = report.document(false);
    if (session.json) return printJson(document);
    std::cout << document["frame_count"] << " frames: " << reportText(report.solver()) << "\nRMS "
              << 1000 * report.rms() << " mm, smallest area ratio " << document["smallest_area_ratio"] << "\n";
  }
};

}  // namespace

Verb fitVerb() { return makeVerb<Fit>("fit", "Fit a model to a motion-capture trial"); }

}  // namespace shaped::shapectl
