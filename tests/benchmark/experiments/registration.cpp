#include <algorithm>
#include <cstdlib>
#include <functional>

#include "core/mesh/alignment.h"
#include "core/mesh/quality.h"
#include "core/registration/scan_registration.h"
#include "core/sample/virtual_scanner.h"
#include "core/surface/closest_point.h"
#include "tests/benchmark/experiments/body_data.h"
#include "tests/benchmark/experiments/experiment.h"
#include "tests/benchmark/experiments/timing.h"

namespace shaped::experiments {
namespace {

/// What a way of registering comes to over all scans.
struct Errors {
  std::vector<double> vertex, rest, surface, seconds, scores;  ///< m; CPU s
  int converged = 0;
};

double mean(const std::vector<double>& values) {
  double sum = 0;
  for (const double value : values) sum += value;
  return sum / double(values.size());
}

using Method = std::function<Solved<ScanRegistration>(const Scan&)>;

Errors errorsOf(const BodyModel& model, const BodyData& data, const std::vector<TrueScan>& scans,
                const Method& method) {
  Errors errors;
  const auto& faces = model.topology()->faces();
  for (const auto& truth : scans) {
    const Stopwatch watch;
    const auto result = method(truth.scan);
    errors.seconds.push_back(watch.cpu());
    const auto& solution = result.solution;
    errors.vertex.push_back(meanVertexDistance(solution.vertices, truth.body));
    errors.surface.push_back(distancesToSurface(solution.vertices, truth.body, faces).mean());
    const Vertices rest = model.rest(solution.state.identity), &person = data.rest[truth.identity];
    errors.rest.push_back(meanVertexDistance(apply(alignRigidly(rest, person), rest), person));
    errors.scores.push_back(solution.score);
    errors.converged += result.converged();
    if (std::getenv("SHAPED_EACH"))
      std::printf("%zu: v2v %.2f rest %.2f mm, score %.3f, start margin %.2f%s, %s after %d, %.2f s\n",
                  errors.vertex.size() - 1, 1000 * errors.vertex.back(), 1000 * errors.rest.back(), solution.score,
                  solution.start_margin, solution.took_runner_up ? " (runner-up)" : "", name(result.termination).data(),
                  result.iterations, errors.seconds.back());
  }
  return errors;
}

void tell(Report& report, const std::string& what, const Errors& errors) {
  report.entry(what + ": v2v posed, mean (worst); v2v at rest; to the true surface",
               text("%.2f (%.2f); %.2f; %.2f mm", 1000 * mean(errors.vertex),
                    1000 * *std::max_element(errors.vertex.begin(), errors.vertex.end()), 1000 * mean(errors.rest),
                    1000 * mean(errors.surface)));
  report.entry(what + ": converged; least score; CPU s, median",
               text("%d of %zu; %.3f; %.2f", errors.converged, errors.vertex.size(),
                    *std::min_element(errors.scores.begin(), errors.scores.end()), median(errors.seconds)));
}

/// The bodies scanned anew, under other conditions.
std::vector<TrueScan> scannedAgain(const std::vector<TrueScan>& scans, const Faces& faces,
                                   VirtualScannerOptions options) {
  std::vector<TrueScan> again;
  for (const auto& truth : scans) {
    ++options.seed;
    // Upright again: the scanner stands around a standing body.
    const Vertices centred = truth.body.rowwise() - truth.body.colwise().mean();
    const auto scanned = scanVirtually(centred, faces, options);
    again.push_back({scanned.scan, apply(scanned.motion, centred), truth.identity});
  }
  return again;
}

struct Condition {
  const char* name;
  VirtualScannerOptions options;
};

std::vector<Condition> conditions() {
  const auto condition = [](const char* name, auto change) {
    VirtualScannerOptions options;
    change(options);
    return Condition{name, options};
  };
  return {condition("as the data, scanned by our scanner", [](auto&) {}),
          condition("noise 2 mm", [](auto& o) { o.noise = 0.002; }),
          condition("noise 5 mm", [](auto& o) { o.noise = 0.005; }),
          condition("noise 10 mm", [](auto& o) { o.noise = 0.010; }),
          condition("10 % missing", [](auto& o) { o.holes = 0.1; }),
          condition("30 % missing", [](auto& o) { o.holes = 0.3; }),
          condition("50 % missing", [](auto& o) { o.holes = 0.5; }),
          condition("30 % cut off", [](auto& o) { o.cut = 0.3; }),
          condition("5 % outliers", [](auto& o) { o.outliers = 0.05; }),
          condition("any rotation", [](auto& o) { o.any_rotation = true; }),
          condition("5 mm, 30 % missing, 5 % outliers, any rotation", [](auto& o) {
            o.noise = 0.005;
            o.holes = 0.3;
            o.outliers = 0.05;
            o.any_rotation = true;
          })};
}

}  // namespace

void robustness() {
  Report report("Registration under noise, gaps, outliers and any rotation");
  const auto data = bodyData();
  const BodyModel model = modelOf(data, 30, 11);
  auto scans = trueScans();
  // The scanner wants bodies upright.
  for (auto& scan : scans) scan.body = apply(alignRigidly(scan.body, data.reference.rest), scan.body);
  for (const auto& condition : conditions())
    tell(report, condition.name,
         errorsOf(model, data, scannedAgain(scans, model.topology()->faces(), condition.options),
                  [&](const Scan& scan) { return registerScan(scan, model, {}); }));
}

void registration() {
  Report report("Registration of raw scans by a model of 30 identities and 11 modes");
  const OneThread one_thread;
  const auto data = bodyData();
  const BodyModel model = modelOf(data, 30, 11);
  const auto scans = trueScans();
  tell(report, "model alone",
       errorsOf(model, data, scans, [&](const Scan& scan) { return registerScan(scan, model, {}); }));
  for (const auto& [what, method] : {std::pair{"model and affine fitting", FittingMethod::kAffine},
                                     {"model and small displacements", FittingMethod::kDisplacement},
                                     {"model and kept edge lengths", FittingMethod::kEdgeLengths}}) {
    ScanRegistrationOptions options;
    options.refine = true;
    options.refinement.method = method;
    tell(report, what,
         errorsOf(model, data, scans, [&](const Scan& scan) { return registerScan(scan, model, {}, options); }));
  }
}

}  // namespace shaped::experiments
