#pragma once

#include <functional>
#include <optional>

#include "core/curve/curve.h"
#include "core/curve/elastic_average.h"
#include "core/numerics/solved.h"

namespace shaped {

struct SmoothingFlowOptions {
  double tau = 0.5;     ///< largest step, in (0, 1]
  bool control = true;  ///< halve a step until the functional falls (Lemma 2); else each step is `tau` long
  bool place = true;    ///< average the frames' positions in space too; else each one stays where its average is found
  /// Let the segments keep the ratios of their lengths (section 4) instead of becoming equal.
  bool keep_speed = false;
  /// rho_i in [0, 1] of each frame, at a step of `tau`: how strongly the frame it was at the beginning pulls; 1 holds
  /// it. Empty: none.
  std::vector<double> restore = {};
  /// 0: frames are pulled by their energy from what they were, E, as in the paper. Else by the distance of their
  /// vertices [m], A mean_v |x_v - x^0_v|^2 / restore_scale^2 with A the surface's area, ours: deformations of patterns
  /// much finer than the scale cost more energy than that and are smoothed as if nothing pulled; coarser ones, such as
  /// a limb's swing, stay.
  double restore_scale = 0;
  std::vector<bool> held = {};    ///< frames to leave alone; empty: none but the ends of an open curve
  double shape_tolerance = 1e-8;  ///< of every frame's solve, > 0
  std::stop_token stop = {};

  /// "tau = 1.5, want in (0, 1]"; empty when all is well for so many frames.
  std::optional<std::string> firstViolation(std::size_t frames) const;
};

/// What one step did.
struct SmoothingStep {
  double tau = 0;           ///< that was taken; 0: none lowered the functional
  int halvings = 0;         ///< tried in vain before
  double path_energy = 0;   ///< (4) after the step [m^2]
  double before = 0;        ///< the functional before the step [m^2]
  double after = 0;         ///< and after it
  bool stationary = false;  ///< no frame had anything to gain: each one is its own average to its solve's tolerance
};

/// A frame of a flow.
struct FlowFrame {
  Vertices shape;
  Eigen::VectorXd coordinates = {};  ///< in the frame's subspace, where it is confined to one
};

/// What a frame's average is made of.
struct FrameTerms {
  std::vector<AverageTerm> shapes;
  double pull = 0;  ///< weight of FrameRules::pull
};

/// How frames move; called for different ones at once.
struct FrameRules {
  /// The average of these terms that takes the place of frame i, started from the frame as it is; in no particular
  /// position.
  std::function<Solved<FlowFrame>(std::size_t i, const FrameTerms& terms, const FlowFrame& now)> average;
  /// How far frame i is from where it was at the beginning, as SmoothingFlowOptions::restore_scale has it [m^2]; empty
  /// where that is 0.
  std::function<double(std::size_t i, const FlowFrame& frame)> pull = {};
};

/// A / (V scale^2) of a shape of V vertices: what a pull weighs the square of each one's distance by. 0 for scale 0.
double pullStiffness(const Topology& topology, const Vertices& shape, double scale);
/// What E is made of in an average by this energy: (10) has half of the terms of (1), so a pull counts half, too.
double pullShare(EnergySymmetry symmetry);

/// The curve smoothing flow of [BvTH16] (2): each step replaces every free frame by the elastic average of itself and
/// its neighbours, and of what it was at the beginning where a restoring force acts.
///
/// With E[a, b] = W[a, b] + W[b, a], a step of length tau is one of descent for
///   F = sum over segments of s_k E[x_k, x_k+1] + sum over frames of r_i E[x_i, x_i^0],
/// as in Lemma 2 (with the pull's distance for the last E where options.restore_scale says so), when it weighs the
/// neighbours of frame i by s_i-1 m and s_i m, the frame by 1 - tau and its beginning by r_i m, with m = tau / (s_i-1 +
/// s_i). The paper's weights are these up to a common factor:
/// - s = 1 gives tau/2 to each neighbour, and F without restoring forces is (4);
/// - s_k = 1 / length of segment k keeps the segments' ratios, since on a straight line it leaves every point where it
///   is. (The two weights of section 4 are so each other's: as printed they would make the segments equal faster.) F
///   then bounds the curve's length from above, and touches it before the step;
/// - r_i = c_i (s_i-1 + s_i) with c_i = rho_i / ((1 - rho_i) options.tau) gives rho_i at tau = options.tau, and shrinks
///   with tau, so that stationary curves do not depend on the length of the steps.
///
/// A frame's position in space, of which the energy knows nothing, is averaged by the same weights: the new shape is
/// aligned rigidly to the weighted mean of their vertices. Positions go on where no shape has anything to gain.
class SmoothingFlow {
 public:
  /// energy: whether frames are averaged by (1) or (10), and the bending weight; F is symmetric either way.
  /// Throws InvalidInput naming "frames", "frames[i]", "topology" (several components) or "options".
  SmoothingFlow(const ShellStructurePtr& structure, const PairEnergy& energy, const Curve& curve,
                const SmoothingFlowOptions& options);

  /// By other rules, such as averages within a subspace per frame. coordinates: of the frames in theirs.
  SmoothingFlow(TopologyPtr topology, double bending, Curve curve, std::vector<Eigen::VectorXd> coordinates,
                FrameRules rules, SmoothingFlowOptions options);

  /// Takes a step. Converged: the step was taken. Stalled: no frame's average differs from it beyond the tolerance of
  /// its solve, or no step of a reasonable length lowers F; so it is at a stationary curve, which stays as it was. The
  /// residual is the largest of the frames' solves. Runs a parallel loop over the frames in the current TBB arena.
  Solved<SmoothingStep> step();

  const Curve& curve() const { return now_.curve; }
  /// May the frame move?
  bool free(std::size_t i) const;
  FlowFrame frame(std::size_t i) const { return {now_.curve.frames[i], now_.coordinates[i]}; }
  double pathEnergy() const;  ///< (4) [m^2]
  /// As gradientNorms() of the curve as it stands.
  std::vector<double> gradientNorms() const;

 private:
  /// s_k and r_i of one step.
  struct Coefficients {
    std::vector<double> segments, restoring;
    double noise = 0;  ///< rounding error of F [m^2]: a fall below it is none
  };
  /// A curve and all that follows from it.
  struct State {
    Curve curve;
    std::vector<Eigen::VectorXd> coordinates;
    std::vector<ShellMeasures> measures;
    std::vector<double> segments,
        restoring;  ///< E of each segment; of each frame and its beginning, where it is pulled

    double functional(const Coefficients& coefficients) const;
  };

  /// Has any frame moved in space?
  bool differs(const State& other) const;
  Coefficients coefficients() const;
  Solved<FlowFrame> average(std::size_t i, double tau, const Coefficients& coefficients) const;
  Solved<State> moved(double tau, const Coefficients& coefficients) const;
  void evaluate(State& state) const;

  TopologyPtr topology_;
  double bending_;
  FrameRules rules_;
  SmoothingFlowOptions options_;
  State beginning_, now_;
  std::vector<double> pull_;  ///< c_i
  double tau_;                ///< of the last step
};

}  // namespace shaped
