#include <nlohmann/json.hpp>

#include "core/io/file.h"
#include "core/io/mesh_file.h"
#include "core/io/scan_file.h"
#include "core/mesh/alignment.h"
#include "core/mesh/quality.h"
#include "core/registration/rigid_start.h"
#include "core/registration/rotation_cover.h"
#include "core/registration/scan_to_model.h"
#include "tests/benchmark/experiments/body_data.h"
#include "tests/benchmark/experiments/experiment.h"
#include "tests/benchmark/experiments/timing.h"

namespace shaped::experiments {
namespace {

/// A raw scan of the data with what it was made from.
struct TrueScan {
  Scan scan;
  Vertices body;  ///< in the scan's place
  std::size_t identity;
};

TrueScan trueScan(int index, const nlohmann::json& truth) {
  const auto& entry = truth.at("scans").at(std::size_t(index));
  RigidMotion motion;
  for (int r = 0; r < 3; ++r) {
    motion.translation[r] = entry.at("t").at(std::size_t(r));
    for (int c = 0; c < 3; ++c) motion.rotation(r, c) = entry.at("R").at(std::size_t(r)).at(std::size_t(c));
  }
  const auto file = text("body_scans/scan_%02d.ply", index), body = text("body_scans/gt/scan_%02d_gt.ply", index);
  return {readScan(dataPath(file)), apply(motion, readMesh(dataPath(body)).vertices), entry.at("identity")};
}

std::vector<TrueScan> trueScans(int count) {
  const auto truth = nlohmann::json::parse(readFile(dataPath("body_scans/scans.json")));
  std::vector<TrueScan> scans;
  for (int i = 0; i < count; ++i) scans.push_back(trueScan(i, truth));
  return scans;
}

}  // namespace

void registration() {
  Report report("Registration of the 40 raw scans by a model of 30 identities and 11 modes");
  const OneThread one_thread;
  const auto data = bodyData();
  std::vector<Vertices> training;
  for (std::size_t i = 0; i < 30; ++i) training.push_back(slightlyPosed(data.reference, data.rest[data.others[i]], i));
  BodyTrainingOptions options;
  options.modes = 11;
  const auto trained = trainBody(data.reference, training, options);
  const BodyModel& model = trained->model;
  std::vector<double> errors, times, surfaces;
  const auto scans = trueScans(40);
  for (std::size_t i = 0; i < scans.size(); ++i) {
    const auto& truth = scans[i];
    const Stopwatch watch;
    const ScanSurface surface(truth.scan);
    const double prepared = watch.cpu();
    const auto start = startRigidly(surface, model.parts().mean, model.topology()->faces());
    const double started = watch.cpu();
    const auto fit = fitModelToScan(surface, model, placedState(model, start.solution.motion), {});
    times.push_back(watch.cpu());
    const Vertices fitted = model.posed(fit.solution.state).vertices();
    const RigidMotion true_motion = alignRigidly(model.parts().mean, truth.body);
    errors.push_back(meanVertexDistance(fitted, truth.body));
    surfaces.push_back(fit.solution.report.scan_mean);
    std::printf(
        "scan %2zu: start %.0f deg, margin %.2f; v2v %.2f mm, chamfer %.2f mm, explained %.3f, %s after %d; s %.2f + "
        "%.2f + %.2f; |w| %.2f\n",
        i, angleBetween(start.solution.motion.rotation, true_motion.rotation) * 57.3, start.solution.margin,
        1000 * errors.back(), 1000 * fit.solution.report.chamfer, fit.solution.report.explained,
        name(fit.termination).data(), fit.iterations, prepared, started - prepared, times.back() - started,
        fit.solution.state.identity.norm());
    std::fflush(stdout);
  }
  double sum = 0;
  for (const double e : errors) sum += e;
  report.entry("PCA only: v2v, mean", text("%.2f mm", 1000 * sum / double(errors.size())));
  report.entry("CPU s a scan, median", text("%.2f", median(times)));
}

}  // namespace shaped::experiments
