#include <algorithm>
#include <optional>

#include "client/jobs.h"
#include "client/marker_fit.h"
#include "client/mesh.h"
#include "client/models.h"
#include "client/shapectl/fit_report.h"
#include "client/shapectl/frame_range.h"
#include "client/shapectl/job_run.h"
#include "client/shapectl/numbers.h"
#include "client/shapectl/output.h"
#include "client/shapectl/progress_bar.h"
#include "client/shapectl/verbs/verbs.h"
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

struct Fit {
  std::string name, trial_file, set_file, range, out, report_file;
  std::int64_t modes = 0, calibration = 3;
  double prior_weight = 0, scale = 0;
  JobFlags flags;

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
    flags.declare(arguments);
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
    const auto setup = setupOf(model, set, frames);
    if (flags.any()) return runAsJob(session, setup, frames, set);
    FitReport report(labelsOf(set));
    stream(channel, setup, frames, session, report);
    if (!report_file.empty()) report.write(report_file);
    report.print(session);
    return exitCodeOf(report.solver());
  }

 private:
  v1::FitMarkersRequest::Setup setupOf(const client::ModelMesh& model, const MarkerSet& set,
                                       const client::MarkerFrames& frames) const {
    v1::FitMarkersRequest::Setup setup;
    *setup.mutable_model() = client::pinned(model.description);
    *setup.mutable_marker_set() = client::pack(set);
    setup.set_modes(countOf("--modes", modes));
    setup.set_prior_weight(prior_weight);
    setup.set_scale(scale);
    if (scale == 0) addCalibration(frames, setup);
    // Whoever fetches a detached job's result says only then whether he wants the shapes.
    setup.set_without_shapes(out.empty() && !flags.detach);
    return setup;
  }

  ExitCode runAsJob(const Session& session, const v1::FitMarkersRequest::Setup& setup,
                    const client::MarkerFrames& frames, const MarkerSet& set) const {
    JobResultOutput output({out, report_file, {}}, labelsOf(set));
    return runBatch(session, flags, output, [&](v1::Jobs::Stub& jobs, ProgressBar& bar) {
      v1::FitMarkersJobRequest::Header header;
      *header.mutable_setup() = setup;
      const auto count = static_cast<double>(frames.numbers.size());
      return client::startMarkerFit(jobs, header, frames, session.callOptions(), [&](std::int64_t sent) {
        bar.show(static_cast<double>(sent) / count, "uploading");
      });
    });
  }

  void stream(const std::shared_ptr<grpc::Channel>& channel, const v1::FitMarkersRequest::Setup& setup,
              const client::MarkerFrames& frames, const Session& session, FitReport& report) const {
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
};

}  // namespace

Verb fitVerb() { return makeVerb<Fit>("fit", "Fit a model to a motion-capture trial"); }

}  // namespace shaped::shapectl
