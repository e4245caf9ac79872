#include "core/curve/smoothing_flow.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <numeric>

#include "core/mesh/alignment.h"
#include "core/mesh/quality.h"
#include "core/numerics/error.h"

namespace shaped {
namespace {

constexpr double kShortestStep = 1e-4;    ///< of options.tau; shorter ones change nothing that anybody sees
constexpr double kShortestLength = 1e-3;  ///< of a segment, relative to the mean, where weights are one over lengths

Vertices alignedTo(const Vertices& target, const Vertices& shape) { return apply(alignRigidly(shape, target), shape); }

}  // namespace

double pullStiffness(const Topology& topology, const Vertices& shape, double scale) {
  if (scale == 0) return 0;
  return measure(topology, shape).area.sum() / static_cast<double>(shape.rows()) / (scale * scale);
}

double pullShare(EnergySymmetry symmetry) { return symmetry == EnergySymmetry::kSymmetric ? 1 : 0.5; }

namespace {

/// In the space of all shapes, by Newton's method.
FrameRules fullRules(const ShellStructurePtr& structure, const PairEnergy& energy, const Curve& curve,
                     const SmoothingFlowOptions& options) {
  requireCurve(structure->topology(), curve, "frames");
  const auto beginning = std::make_shared<const std::vector<Vertices>>(curve.frames);
  const double stiffness = pullStiffness(structure->topology(), beginning->front(), options.restore_scale);
  const NewtonOptions newton{60, options.shape_tolerance, options.stop};
  const auto average = [=](std::size_t i, const FrameTerms& terms, const FlowFrame& now) {
    const auto& target = (*beginning)[i];
    const Vertices start = terms.pull > 0 ? alignedTo(target, now.shape) : now.shape;
    const PointPull pull{&target, pullShare(energy.symmetry()) * terms.pull * stiffness};
    auto solved = elasticAverage(structure, energy, terms.shapes, start, newton, pull);
    return Solved<FlowFrame>({std::move(solved.solution)}, solved);
  };
  const auto pull = [=](std::size_t i, const FlowFrame& frame) {
    const auto& target = (*beginning)[i];
    return stiffness * (alignedTo(target, frame.shape) - target).squaredNorm();
  };
  return {average, pull};
}

}  // namespace

std::optional<std::string> SmoothingFlowOptions::firstViolation(std::size_t frames) const {
  if (!(tau > 0 && tau <= 1)) return "tau = " + std::to_string(tau) + ", want in (0, 1]";
  if (!(shape_tolerance > 0)) return "shape_tolerance = " + std::to_string(shape_tolerance) + ", want > 0";
  if (!(restore_scale >= 0 && std::isfinite(restore_scale)))
    return "restore_scale = " + std::to_string(restore_scale) + ", want >= 0 and finite";
  if (!restore.empty() && restore.size() != frames)
    return "restore has " + std::to_string(restore.size()) + " entries, want one for each of " +
           std::to_string(frames) + " frames";
  for (std::size_t i = 0; i < restore.size(); ++i)
    if (!(restore[i] >= 0 && restore[i] <= 1))
      return "restore[" + std::to_string(i) + "] = " + std::to_string(restore[i]) + ", want in [0, 1]";
  if (!held.empty() && held.size() != frames)
    return "held has " + std::to_string(held.size()) + " entries, want one for each of " + std::to_string(frames) +
           " frames";
  return std::nullopt;
}

double SmoothingFlow::State::functional(const Coefficients& coefficients) const {
  return std::inner_product(segments.begin(), segments.end(), coefficients.segments.begin(), 0.0) +
         std::inner_product(restoring.begin(), restoring.end(), coefficients.restoring.begin(), 0.0);
}

SmoothingFlow::SmoothingFlow(const ShellStructurePtr& structure, const PairEnergy& energy, const Curve& curve,
                             const SmoothingFlowOptions& options)
    : SmoothingFlow(structure->topologyPtr(), energy.bending(), curve, {}, fullRules(structure, energy, curve, options),
                    options) {}

SmoothingFlow::SmoothingFlow(TopologyPtr topology, double bending, Curve curve,
                             std::vector<Eigen::VectorXd> coordinates, FrameRules rules, SmoothingFlowOptions options)
    : topology_(std::move(topology)),
      bending_(bending),
      rules_(std::move(rules)),
      options_(std::move(options)),
      tau_(options_.tau) {
  requireOneComponent(*topology_, "topology");
  requireCurve(*topology_, curve, "frames");
  if (const auto violation = options_.firstViolation(curve.size())) throw InvalidInput("options", *violation);
  pull_.assign(curve.size(), 0);
  for (std::size_t i = 0; i < options_.restore.size(); ++i)
    if (const double rho = options_.restore[i]; rho < 1) pull_[i] = rho / ((1 - rho) * options_.tau);
  coordinates.resize(curve.size());
  beginning_.measures = measuresOf(*topology_, curve);
  beginning_.curve = std::move(curve);
  beginning_.coordinates = std::move(coordinates);
  now_ = beginning_;
  evaluate(now_);
}

bool SmoothingFlow::free(std::size_t i) const {
  const auto& curve = beginning_.curve;
  if (!curve.closed && (i == 0 || i + 1 == curve.size())) return false;
  if (!options_.held.empty() && options_.held[i]) return false;
  return options_.restore.empty() || options_.restore[i] < 1;
}

bool SmoothingFlow::differs(const State& other) const {
  const double negligible = 1e-9 * boundingBoxDiagonal(now_.curve.frames.front());
  for (std::size_t i = 0; i < now_.curve.size(); ++i)
    if ((other.curve.frames[i] - now_.curve.frames[i]).cwiseAbs().maxCoeff() > negligible) return true;
  return false;
}

SmoothingFlow::Coefficients SmoothingFlow::coefficients() const {
  Coefficients result{std::vector<double>(now_.segments.size(), 1), std::vector<double>(now_.curve.size(), 0), 0};
  std::vector<double> lengths;
  for (const double energy : now_.segments) lengths.push_back(std::sqrt(std::max(energy, 0.0)));
  const double mean = std::accumulate(lengths.begin(), lengths.end(), 0.0) / static_cast<double>(lengths.size());
  if (options_.keep_speed && mean > 0)
    for (std::size_t k = 0; k < lengths.size(); ++k)
      result.segments[k] = mean / std::max(lengths[k], kShortestLength * mean);
  for (std::size_t i = 0; i < pull_.size(); ++i)
    if (free(i)) result.restoring[i] = pull_[i] * (result.segments[now_.curve.previous(i)] + result.segments[i]);
  const auto sum = [](const std::vector<double>& values) { return std::accumulate(values.begin(), values.end(), 0.0); };
  result.noise = 2e-14 * now_.measures.front().area.sum() * (sum(result.segments) + sum(result.restoring));
  return result;
}

Solved<FlowFrame> SmoothingFlow::average(std::size_t i, double tau, const Coefficients& coefficients) const {
  const auto& curve = now_.curve;
  const auto previous = curve.previous(i), next = curve.next(i);
  const double before = coefficients.segments[previous], after = coefficients.segments[i];
  const double share = tau / (before + after);
  const double weights[] = {share * before, 1 - tau, share * after, share * coefficients.restoring[i]};
  FrameTerms terms{
      {{&now_.measures[previous], weights[0]}, {&now_.measures[i], weights[1]}, {&now_.measures[next], weights[2]}}};
  if (options_.restore_scale > 0)
    terms.pull = weights[3];
  else
    terms.shapes.push_back({&beginning_.measures[i], weights[3]});
  auto solved = rules_.average(i, terms, {curve.frames[i], now_.coordinates[i]});
  if (!options_.place) return solved;
  const Vertices place = (weights[0] * curve.frames[previous] + weights[1] * curve.frames[i] +
                          weights[2] * curve.frames[next] + weights[3] * beginning_.curve.frames[i]) /
                         (weights[0] + weights[1] + weights[2] + weights[3]);
  auto& shape = solved.solution.shape;
  shape = apply(alignRigidly(shape, place), shape);
  return solved;
}

Solved<SmoothingFlow::State> SmoothingFlow::moved(double tau, const Coefficients& coefficients) const {
  Solved<State> result(now_, {});
  auto& state = result.solution;
  std::vector<Outcome> outcomes(state.curve.size());
  tbb::parallel_for(std::size_t{0}, state.curve.size(), [&](std::size_t i) {
    if (!free(i)) return;
    auto solved = average(i, tau, coefficients);
    outcomes[i] = solved;
    state.curve.frames[i] = std::move(solved.solution.shape);
    state.coordinates[i] = std::move(solved.solution.coordinates);
    measure(*topology_, state.curve.frames[i], state.measures[i]);
  });
  for (const auto& outcome : outcomes) result += outcome;
  if (result.converged()) evaluate(state);
  return result;
}

void SmoothingFlow::evaluate(State& state) const {
  state.segments = segmentEnergies(*topology_, bending_, state.curve, state.measures);
  state.restoring.assign(state.curve.size(), 0);
  tbb::parallel_for(std::size_t{0}, pull_.size(), [&](std::size_t i) {
    if (!(pull_[i] > 0)) return;
    const auto &from = beginning_.measures[i], &to = state.measures[i];
    if (options_.restore_scale > 0)
      state.restoring[i] = rules_.pull(i, {state.curve.frames[i], state.coordinates[i]});
    else
      state.restoring[i] = shellEnergy(*topology_, from, to, bending_) + shellEnergy(*topology_, to, from, bending_);
  });
}

Solved<SmoothingStep> SmoothingFlow::step() {
  const auto weights = coefficients();
  const double before = now_.functional(weights);
  SmoothingStep taken{0, 0, pathEnergy(), before, before, false};
  Outcome total;
  double tau = options_.control ? std::min(options_.tau, 2 * tau_) : options_.tau;
  for (;; tau /= 2, ++taken.halvings) {
    auto next = moved(tau, weights);
    total = {next.termination, total.iterations + next.iterations, next.residual};
    if (total.termination == Termination::kCancelled) break;
    const bool shapes_stay = total.converged() && next.iterations == 0;
    taken.stationary = shapes_stay && !differs(next.solution);
    if (taken.stationary) {
      total.termination = Termination::kStalled;
      break;
    }
    const double after = total.converged() ? next.solution.functional(weights) : before;
    if (total.converged() && (shapes_stay || after < before - weights.noise || !options_.control)) {
      now_ = std::move(next.solution);
      tau_ = tau;
      return {{tau, taken.halvings, pathEnergy(), before, after, false}, total};
    }
    if (options_.control && tau >= 2 * kShortestStep * options_.tau) continue;
    if (total.converged()) total.termination = Termination::kStalled;
    break;
  }
  return {taken, total};
}

double SmoothingFlow::pathEnergy() const { return std::accumulate(now_.segments.begin(), now_.segments.end(), 0.0); }

std::vector<double> SmoothingFlow::gradientNorms() const {
  return shaped::gradientNorms(*topology_, bending_, now_.curve, now_.measures);
}

}  // namespace shaped
