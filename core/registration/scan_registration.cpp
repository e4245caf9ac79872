#include "core/registration/scan_registration.h"

#include <Eigen/Geometry>
#include <cmath>
#include <sstream>

#include "core/mesh/quality.h"
#include "core/numerics/error.h"
#include "core/registration/model_pairs.h"
#include "core/registration/scan_checks.h"

namespace shaped {
namespace {

using Result = Solved<ScanRegistration>;

/// Four digits of it: nobody reads more in a sentence.
std::string rounded(double value) {
  std::ostringstream text;
  text.precision(4);
  text << value;
  return text.str();
}

std::string percent(double share) { return std::to_string(int(std::lround(100 * share))) + " %"; }

/// The scan in metres, its normals outwards, and what is to be said of that.
Scan prepared(const Scan& scan, const BodyModel& model, const ScanRegistrationOptions& options,
              ScanRegistration& result) {
  Scan ready = preparedScan(scan, options.unit_factor);
  result.suspected_unit_factor = suspectedUnitFactor(ready, robustExtent(model.parts().mean));
  result.flipped_normals = pointsInwards(scan);
  return ready;
}

ModelFitOptions withLevels(const ScanRegistrationOptions& options, std::size_t first, std::size_t count) {
  ModelFitOptions fit = options.fit;
  fit.levels.assign(options.fit.levels.begin() + std::ptrdiff_t(first),
                    options.fit.levels.begin() + std::ptrdiff_t(first + count));
  fit.stop = options.stop;
  return fit;
}

/// Where the model lies roughly: from landmarks or from the rigid start; of two ways to lie, the one that fits better
/// once identity and pose may help.
BodyState startState(const ScanSurface& surface, const BodyModel& model, const std::vector<Landmark>& landmarks,
                     const ScanRegistrationOptions& options, ScanRegistration& result) {
  const auto& faces = model.topology()->faces();
  if (landmarks.size() >= 3)
    return placedState(model, startFromLandmarks(landmarks, model.parts().mean, faces).solution.motion);
  const auto start = startRigidly(surface, model.parts().mean, faces, options.start, options.stop).solution;
  result.start_margin = start.margin;
  const BodyState first = placedState(model, start.motion);
  if (start.margin >= options.doubtful_margin) return first;
  const auto coarse = withLevels(options, 0, std::min<std::size_t>(2, options.fit.levels.size()));
  const auto best = fitModelToScan(surface, model, first, landmarks, coarse).solution;
  const auto other = fitModelToScan(surface, model, placedState(model, start.runner_up), landmarks, coarse).solution;
  result.took_runner_up = other.report.chamfer < best.report.chamfer;
  return result.took_runner_up ? other.state : best.state;
}

void addWarnings(const ScanRegistrationOptions& options, const Outcome& outcome, ScanRegistration& result) {
  auto& warnings = result.warnings;
  if (result.score < options.least_score)
    warnings.push_back("only " + percent(result.score) +
                       " of the scan lies on the registered surface: it shows something else than the model, or the "
                       "registration failed");
  if (result.suspected_unit_factor)
    warnings.push_back("the scan is about " + rounded(1 / *result.suspected_unit_factor) +
                       " times the model's size: its unit may be another; nothing was scaled");
  if (outcome.termination == Termination::kStalled) warnings.push_back("no point of the scan came near the model");
  if (result.flipped_normals) warnings.push_back("the scan's normals pointed inwards and were turned over");
  const double unusual = result.state.identity.squaredNorm() / double(result.state.identity.size());
  if (unusual > 4)
    warnings.push_back("the identity is unusual: " + rounded(std::sqrt(unusual)) +
                       " standard deviations a mode in the mean");
  if (result.report.seen < 0.5)
    warnings.push_back("the scan shows " + percent(result.report.seen) +
                       " of the surface alone: the rest is the model's guess");
  if (options.field && !result.field)
    warnings.push_back(
        "the model's field deformed nothing: the fit failed, next to no point of the scan lies on it, or the field "
        "overflows");
  if (result.field && result.field->report.chamfer > result.report.chamfer)
    warnings.push_back("the model's field brought the surface no nearer to the scan");
}

bool usable(const Outcome& fit) { return fit.converged() || fit.termination == Termination::kIterationLimit; }

/// Seats fingers and toes; where one moved, the finest level is gone through once more.
void seatTipsOf(const ScanSurface& surface, const BodyModel& model, const std::vector<Landmark>& landmarks,
                const ScanRegistrationOptions& options, Solved<BodyState>& fit) {
  auto& [identity, pose] = fit.solution;
  if (seatTips(surface, model, identity, pose, options.tips, options.stop) == 0) return;
  const auto finest = withLevels(options, options.fit.levels.size() - 1, 1);
  const int before = fit.iterations;
  fit = fitStateToScan(surface, model, fit.solution, landmarks, finest);
  fit.iterations += before;
}

void deformByField(const ScanSurface& surface, const BodyModel& model, const ScanRegistrationOptions& options,
                   ScanRegistration& result) {
  auto fit = options.fit;
  fit.stop = options.stop;
  auto deformed = options.field->deform(model, result.state, surface, fit, options.tips);
  if (!deformed) return;
  const auto report = ModelPairs(surface, model, options.fit).report(deformed->posed, options.fit.levels.back());
  result.field = FieldRegistration{std::move(deformed->rest), std::move(deformed->pose), report};
  result.vertices = std::move(deformed->posed);
}

void refine(const ScanSurface& surface, const BodyModel& model, const std::vector<Landmark>& landmarks,
            const ScanRegistrationOptions& options, Result& result) {
  const auto fitted =
      fitTemplate(surface, *model.topology(), result.solution.vertices, landmarks, options.refinement, options.stop);
  result.solution.vertices = fitted.solution.vertices;
  result.solution.refinement = fitted.solution.report;
  static_cast<Outcome&>(result) += fitted;
}

Result registered(const ScanSurface& surface, const BodyModel& model, const BodyState& start,
                  const std::vector<Landmark>& landmarks, const ScanRegistrationOptions& options,
                  ScanRegistration begun) {
  ModelFitOptions fit_options = options.fit;
  fit_options.stop = options.stop;
  auto fit = fitStateToScan(surface, model, start, landmarks, fit_options);
  if (usable(fit)) seatTipsOf(surface, model, landmarks, options, fit);
  Result result(std::move(begun), fit);
  result.solution.state = fit.solution;
  result.solution.vertices = model.posed(fit.solution).vertices();
  if (fit.termination != Termination::kCancelled)  // the report would take long
    result.solution.report =
        ModelPairs(surface, model, options.fit).report(result.solution.vertices, options.fit.levels.back());
  if (options.field && usable(fit)) deformByField(surface, model, options, result.solution);
  if (options.refine && usable(fit)) refine(surface, model, landmarks, options, result);
  result.solution.score = registrationScore(surface, model, result.solution.vertices);
  addWarnings(options, result, result.solution);
  return result;
}

}  // namespace

FittingOptions refinementDefaults() {
  FittingOptions options;
  options.first_stiffness = 1e-2;
  options.last_stiffness = 1e-4;
  options.levels = 4;
  options.first_max_distance = 0.05;
  options.gates.max_distance = 0.03;
  return options;
}

std::optional<std::string> ScanRegistrationOptions::firstViolation() const {
  if (const auto problem = start.firstViolation()) return "start." + *problem;
  if (const auto problem = fit.firstViolation()) return "fit." + *problem;
  if (const auto problem = tips.firstViolation()) return "tips." + *problem;
  if (const auto problem = refinement.firstViolation()) return "refinement." + *problem;
  if (!(unit_factor > 0) || !std::isfinite(unit_factor))
    return "unit_factor = " + std::to_string(unit_factor) + ", want > 0";
  if (!(doubtful_margin >= 0)) return "doubtful_margin = " + std::to_string(doubtful_margin) + ", want >= 0";
  if (!(least_score >= 0 && least_score <= 1)) return "least_score = " + std::to_string(least_score) + ", want 0 to 1";
  return std::nullopt;
}

Result registerScan(const Scan& scan, const BodyModel& model, const std::vector<Landmark>& landmarks,
                    const ScanRegistrationOptions& options) {
  if (const auto problem = options.firstViolation()) throw InvalidInput("options", *problem);
  ScanRegistration begun;
  const ScanSurface surface(prepared(scan, model, options, begun));
  const BodyState start = startState(surface, model, landmarks, options, begun);
  return registered(surface, model, start, landmarks, options, std::move(begun));
}

Result registerScanFrom(const Scan& scan, const BodyModel& model, const BodyState& start,
                        const std::vector<Landmark>& landmarks, const ScanRegistrationOptions& options) {
  if (const auto problem = options.firstViolation()) throw InvalidInput("options", *problem);
  ScanRegistration begun;
  const ScanSurface surface(prepared(scan, model, options, begun));
  return registered(surface, model, start, landmarks, options, std::move(begun));
}

Scan preparedScan(const Scan& scan, double unit_factor) {
  requireUsableScan(scan, "scan");
  Scan ready = pointsInwards(scan) ? flipped(scan) : scan;
  ready.points *= unit_factor;
  return ready;
}

double registrationScore(const ScanSurface& scan, const BodyModel& model, const Vertices& surface) {
  const auto& faces = model.topology()->faces();
  const double near = 0.01 * boundingBoxDiagonal(model.parts().mean);
  const ClosestPointQuery closest(surface, faces);
  const Vertices normals = faceNormals(faces, surface);
  Eigen::Index good = 0;
  for (Eigen::Index i = 0; i < scan.points().rows(); ++i) {
    const SurfacePoint found = closest(scan.points().row(i));
    const double cosine = normals.row(found.face).dot(scan.normals().row(i));
    good += found.distance <= near && (scan.hasOrientedNormals() ? cosine : std::abs(cosine)) >= 0.5;
  }
  return double(good) / double(scan.points().rows());
}

bool pointsInwards(const Scan& scan) {
  Vertices normals = scan.normals;
  if (normals.rows() == 0 && scan.faces.rows() == 0) return false;
  if (normals.rows() == 0) normals = vertexNormals(scan.faces, scan.points);
  const Eigen::RowVector3d centre = scan.points.colwise().mean();
  const Vertices arms = scan.points.rowwise() - centre;
  return arms.cwiseProduct(normals).sum() < 0;
}

}  // namespace shaped
