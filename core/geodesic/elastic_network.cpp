#include "core/geodesic/elastic_network.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <numeric>

#include "core/geodesic/network_tree.h"
#include "core/numerics/newton.h"
#include "core/shell/energy.h"
#include "core/shell/shell_objective.h"

namespace shaped {
namespace {

using NodeVectors = std::vector<Eigen::VectorXd>;  ///< one 3V vector per free node

double dot(const NodeVectors& a, const NodeVectors& b) {
  double sum = 0;
  for (std::size_t n = 0; n < a.size(); ++n) sum += a[n].dot(b[n]);
  return sum;
}

void axpy(double scale, const NodeVectors& x, NodeVectors& y) {
  for (std::size_t n = 0; n < x.size(); ++n) y[n] += scale * x[n];
}

template <class Body>
void forEach(std::size_t count, const Body& body) {
  tbb::parallel_for(std::size_t{0}, count, body);
}

/// Newton's method on a network: the state at one iterate and the linear algebra over its tree.
class NetworkNewton {
 public:
  NetworkNewton(const ShellStructurePtr& structure, const PairEnergy& energy, ElasticNetwork network,
                std::stop_token stop)
      : structure_(structure),
        topology_(structure->topology()),
        energy_(energy),
        stop_(std::move(stop)),
        network_(std::move(network)),
        tree_(network_),
        measures_(network_.nodes.size()),
        pins_(tree_.nodes.size()),
        gradient_(tree_.nodes.size()) {
    forEach(network_.nodes.size(), [&](std::size_t n) { measure(topology_, network_.nodes[n], measures_[n]); });
    for (const auto& segment : network_.segments)
      noise_ += 1e-14 * segment.weight * measures_[static_cast<std::size_t>(segment.from)].area.sum();
    for (std::size_t n = 0; n < tree_.nodes.size(); ++n) {
      hessians_.emplace_back(structure_->pattern());
      factors_.emplace_back(structure_->analysis());
    }
    for (std::size_t n = 0; n < tree_.nodes.size(); ++n)
      couplings_.push_back(tree_.nodes[n].parent < 0 ? nullptr
                                                     : std::make_unique<GeneralBlockMatrix>(structure_->pattern()));
  }

  /// Gradients of all free nodes; the largest relative imbalance. Left unfinished when the stop token fires, as is all
  /// that follows.
  double updateGradient();
  /// Hessian, couplings and preconditioner; false when a node's block cannot be factorised, or stopped.
  bool updateHessian();
  NodeVectors findDirection(double forcing) const;
  bool step(const NodeVectors& direction);

  const ElasticNetwork& network() const { return network_; }
  ElasticNetwork takeNetwork() { return std::move(network_); }

 private:
  double nodeGradient(std::size_t n);
  void addNodeCurvature(std::size_t n, MeasureCurvature& curvature) const;
  bool factoriseNode(std::size_t n);
  void multiply(const NodeVectors& x, NodeVectors& y) const;
  void precondition(const NodeVectors& r, NodeVectors& z) const;
  void solveBlock(std::size_t n, const Eigen::VectorXd& b, Eigen::VectorXd& x) const;
  /// y += scale * (block of node row, node column) x for a tree edge between them.
  void coupleAdd(std::size_t row, std::size_t column, double scale, const Eigen::VectorXd& x, Eigen::VectorXd& y) const;
  double energy(const std::vector<ShellMeasures>& measures) const;

  ShellStructurePtr structure_;
  const Topology& topology_;
  PairEnergy energy_;
  std::stop_token stop_;
  ElasticNetwork network_;
  NetworkTree tree_;
  std::vector<ShellMeasures> measures_;
  std::vector<Pins> pins_;
  NodeVectors gradient_;
  std::vector<SymmetricBlockMatrix> hessians_;
  std::vector<std::unique_ptr<GeneralBlockMatrix>> couplings_;  ///< of each free node with its parent, rows = from
  std::vector<CholeskyFactor> factors_;
  double noise_ = 0;
};

double NetworkNewton::nodeGradient(std::size_t n) {
  const auto& node = tree_.nodes[n];
  const auto self = static_cast<std::size_t>(node.index);
  Vertices total = Vertices::Zero(network_.nodes[self].rows(), 3), force(total.rows(), 3);
  MeasureGradient measures(topology_);
  const double floor = forceFloor(topology_, network_.nodes[self], measures_[self], energy_.bending());
  double scale = 0;
  for (const auto s : node.segments) {
    const auto& segment = network_.segments[static_cast<std::size_t>(s)];
    measures.setZero();
    force.setZero();
    const auto &from = measures_[static_cast<std::size_t>(segment.from)],
               &to = measures_[static_cast<std::size_t>(segment.to)];
    if (segment.from == node.index)
      energy_.addFirstGradient(topology_, from, to, segment.weight, measures);
    else
      energy_.addSecondGradient(topology_, from, to, segment.weight, measures);
    pullBackGradient(topology_, network_.nodes[self], measures, force);
    total += force;
    scale += force.norm() + segment.weight * floor;
  }
  gradient_[n] = flatten(total);
  pins_[n] = gaugePins(network_.nodes[self]);
  pins_[n].clear(gradient_[n].data());
  return gradient_[n].norm() / scale;
}

double NetworkNewton::updateGradient() {
  std::vector<double> imbalance(tree_.nodes.size());
  forEach(tree_.nodes.size(), [&](std::size_t n) {
    if (!stop_.stop_requested()) imbalance[n] = nodeGradient(n);
  });
  double worst = 0;
  for (const double value : imbalance) worst = std::isnan(value) ? value : std::max(worst, value);
  return worst;
}

void NetworkNewton::addNodeCurvature(std::size_t n, MeasureCurvature& curvature) const {
  const auto& node = tree_.nodes[n];
  for (const auto s : node.segments) {
    const auto& segment = network_.segments[static_cast<std::size_t>(s)];
    const auto &from = measures_[static_cast<std::size_t>(segment.from)],
               &to = measures_[static_cast<std::size_t>(segment.to)];
    if (segment.from == node.index)
      energy_.addFirstCurvature(topology_, from, to, segment.weight, curvature);
    else
      energy_.addSecondCurvature(topology_, from, to, segment.weight, curvature);
  }
}

bool NetworkNewton::factoriseNode(std::size_t n) {
  const auto& shape = network_.nodes[static_cast<std::size_t>(tree_.nodes[n].index)];
  MeasureCurvature curvature(topology_, HessianKind::kExact);
  addNodeCurvature(n, curvature);
  hessians_[n].setZero();
  pullBackHessian(*structure_, shape, curvature, hessians_[n]);
  if (factors_[n].factorise(hessians_[n], pins_[n], stop_)) return true;
  if (stop_.stop_requested()) return false;
  curvature.reset(HessianKind::kProjected);
  addNodeCurvature(n, curvature);
  SymmetricBlockMatrix projected(structure_->pattern());
  pullBackHessian(*structure_, shape, curvature, projected);
  return factors_[n].factorise(projected, pins_[n], stop_);
}

bool NetworkNewton::updateHessian() {
  std::vector<char> done(tree_.nodes.size(), 1);
  forEach(tree_.nodes.size(), [&](std::size_t n) {
    if (stop_.stop_requested()) return;
    done[n] = factoriseNode(n);
    if (!couplings_[n] || stop_.stop_requested()) return;
    const auto& segment = network_.segments[static_cast<std::size_t>(tree_.nodes[n].parent_segment)];
    const auto from = static_cast<std::size_t>(segment.from), to = static_cast<std::size_t>(segment.to);
    couplings_[n]->setZero();
    energy_.addMixedHessian(*structure_, network_.nodes[from], measures_[from], network_.nodes[to], measures_[to],
                            segment.weight, *couplings_[n]);
  });
  return std::all_of(done.begin(), done.end(), [](char d) { return d != 0; });
}

void NetworkNewton::coupleAdd(std::size_t row, std::size_t column, double scale, const Eigen::VectorXd& x,
                              Eigen::VectorXd& y) const {
  const std::size_t child = tree_.nodes[row].parent == static_cast<std::int32_t>(column) ? row : column;
  const auto& segment = network_.segments[static_cast<std::size_t>(tree_.nodes[child].parent_segment)];
  if (segment.from == tree_.nodes[row].index)
    couplings_[child]->multiplyAdd(scale, x.data(), y.data());
  else
    couplings_[child]->multiplyTransposedAdd(scale, x.data(), y.data());
}

void NetworkNewton::multiply(const NodeVectors& x, NodeVectors& y) const {
  forEach(x.size(), [&](std::size_t n) {
    y[n].setZero(x[n].size());
    if (stop_.stop_requested()) return;
    hessians_[n].multiplyAdd(x[n].data(), y[n].data());
    if (tree_.nodes[n].parent >= 0)
      coupleAdd(n, static_cast<std::size_t>(tree_.nodes[n].parent), 1,
                x[static_cast<std::size_t>(tree_.nodes[n].parent)], y[n]);
    for (const auto child : tree_.nodes[n].children)
      coupleAdd(n, static_cast<std::size_t>(child), 1, x[static_cast<std::size_t>(child)], y[n]);
    pins_[n].clear(y[n].data());
  });
}

void NetworkNewton::solveBlock(std::size_t n, const Eigen::VectorXd& b, Eigen::VectorXd& x) const {
  if (stop_.stop_requested()) {
    x.setZero(b.size());
    return;
  }
  x.resize(b.size());
  factors_[n].solve(b.data(), x.data());
  x /= tree_.nodes[n].pivot_ratio;
}

void NetworkNewton::precondition(const NodeVectors& r, NodeVectors& z) const {
  // Leaves to roots: z_n = S_n^-1 (r_n - sum over children of B_nc z_c), with S_n the scaled block.
  for (auto level = tree_.levels.rbegin(); level != tree_.levels.rend(); ++level)
    forEach(level->size(), [&](std::size_t i) {
      const auto n = static_cast<std::size_t>((*level)[i]);
      Eigen::VectorXd rhs = r[n];
      for (const auto child : tree_.nodes[n].children)
        coupleAdd(n, static_cast<std::size_t>(child), -1, z[static_cast<std::size_t>(child)], rhs);
      pins_[n].clear(rhs.data());
      solveBlock(n, rhs, z[n]);
    });
  // Roots to leaves: z_n -= S_n^-1 B_np z_p.
  for (std::size_t depth = 1; depth < tree_.levels.size(); ++depth)
    forEach(tree_.levels[depth].size(), [&](std::size_t i) {
      const auto n = static_cast<std::size_t>(tree_.levels[depth][i]);
      const auto parent = static_cast<std::size_t>(tree_.nodes[n].parent);
      Eigen::VectorXd rhs = Eigen::VectorXd::Zero(z[n].size()), correction;
      coupleAdd(n, parent, 1, z[parent], rhs);
      pins_[n].clear(rhs.data());
      solveBlock(n, rhs, correction);
      z[n] -= correction;
    });
}

NodeVectors NetworkNewton::findDirection(double forcing) const {
  constexpr int kLimit = 200;
  const std::size_t count = gradient_.size();
  NodeVectors x(count), r = gradient_, z(count), p, ap(count);
  for (std::size_t n = 0; n < count; ++n) x[n].setZero(gradient_[n].size());
  for (auto& v : r) v = -v;
  precondition(r, z);
  p = z;
  double rz = dot(r, z);
  const double goal = forcing * forcing * rz;
  for (int k = 0; k < kLimit && rz > goal && !stop_.stop_requested(); ++k) {
    multiply(p, ap);
    const double curvature = dot(p, ap);
    if (!(curvature > 0)) return k == 0 ? p : x;
    const double alpha = rz / curvature;
    axpy(alpha, p, x);
    axpy(-alpha, ap, r);
    precondition(r, z);
    const double next = dot(r, z);
    const double beta = next / rz;
    for (std::size_t n = 0; n < count; ++n) p[n] = z[n] + beta * p[n];
    rz = next;
  }
  return x;
}

double NetworkNewton::energy(const std::vector<ShellMeasures>& measures) const {
  std::vector<double> parts(network_.segments.size());
  forEach(parts.size(), [&](std::size_t s) {
    const auto& segment = network_.segments[s];
    parts[s] = segment.weight * energy_.value(topology_, measures[static_cast<std::size_t>(segment.from)],
                                              measures[static_cast<std::size_t>(segment.to)]);
  });
  return std::accumulate(parts.begin(), parts.end(), 0.0);
}

bool NetworkNewton::step(const NodeVectors& direction) {
  auto nodes = network_.nodes;
  auto measures = measures_;
  const auto moveTo = [&](double t) {
    forEach(direction.size(), [&](std::size_t n) {
      if (stop_.stop_requested()) return;
      const auto index = static_cast<std::size_t>(tree_.nodes[n].index);
      nodes[index] =
          network_.nodes[index] + t * Eigen::Map<const Vertices>(direction[n].data(), nodes[index].rows(), 3);
      measure(topology_, nodes[index], measures[index]);
    });
    return stop_.stop_requested() ? std::numeric_limits<double>::infinity() : energy(measures);
  };
  const double slope = dot(direction, gradient_);
  const double length = slope < 0 ? backtrack(moveTo, energy(measures_), slope, noise_) : 0;
  if (length == 0) return false;
  network_.nodes = std::move(nodes);
  measures_ = std::move(measures);
  return true;
}

}  // namespace

Solved<ElasticNetwork> relax(const ShellStructurePtr& structure, const PairEnergy& energy, ElasticNetwork network,
                             const NetworkOptions& options) {
  const auto start = network.nodes;
  NetworkNewton run(structure, energy, std::move(network), options.stop);
  Outcome outcome{Termination::kConverged, 0, 1};
  for (outcome.iterations = 0;; ++outcome.iterations) {
    const double imbalance = run.updateGradient();
    outcome.termination = Termination::kCancelled;
    if (options.stop.stop_requested()) break;
    outcome.residual = imbalance;
    if (options.on_iteration) options.on_iteration(outcome.iterations, outcome.residual);
    outcome.termination = Termination::kNumericalFailure;
    if (!std::isfinite(outcome.residual)) break;
    if (options.on_iterate) options.on_iterate(outcome, run.network());
    outcome.termination = Termination::kConverged;
    if (outcome.residual <= options.tolerance) break;
    outcome.termination = Termination::kIterationLimit;
    if (outcome.iterations >= options.max_iterations) break;
    const bool usable = run.updateHessian();
    outcome.termination = Termination::kCancelled;
    if (options.stop.stop_requested()) break;
    outcome.termination = Termination::kNumericalFailure;
    if (!usable) break;
    outcome.termination = Termination::kCancelled;
    const double forcing = std::clamp(std::sqrt(outcome.residual), 1e-4, 0.1);
    const auto direction = run.findDirection(forcing);
    if (options.stop.stop_requested()) break;
    if (!run.step(direction)) {
      outcome.termination = options.stop.stop_requested() ? Termination::kCancelled : Termination::kStalled;
      break;
    }
  }
  // A step that the stop token interrupted was not taken.
  if (outcome.termination == Termination::kCancelled && options.on_iterate) options.on_iterate(outcome, run.network());
  auto result = run.takeNetwork();
  if (outcome.termination == Termination::kNumericalFailure) result.nodes = start;
  return {std::move(result), outcome};
}

std::vector<double> segmentEnergies(const Topology& topology, const PairEnergy& energy, const ElasticNetwork& network) {
  std::vector<ShellMeasures> measures(network.nodes.size());
  for (std::size_t n = 0; n < measures.size(); ++n) measure(topology, network.nodes[n], measures[n]);
  std::vector<double> result;
  for (const auto& segment : network.segments)
    result.push_back(energy.value(topology, measures[static_cast<std::size_t>(segment.from)],
                                  measures[static_cast<std::size_t>(segment.to)]));
  return result;
}

}  // namespace shaped
