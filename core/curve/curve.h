#pragma once

#include <string>
#include <vector>

#include "core/shell/pair_energy.h"
#include "core/shell/structure.h"

namespace shaped {

/// A discrete curve in shape space: frames of one topology, V x 3 each. An open one has fixed ends; in a closed one the
/// first frame follows the last.
struct Curve {
  std::vector<Vertices> frames;
  bool closed = false;

  std::size_t size() const { return frames.size(); }
  /// Pairs of neighbours.
  std::size_t segments() const { return closed ? frames.size() : frames.size() - 1; }
  std::size_t next(std::size_t i) const { return i + 1 == frames.size() ? 0 : i + 1; }
  std::size_t previous(std::size_t i) const { return i == 0 ? frames.size() - 1 : i - 1; }
};

/// Throws InvalidInput naming `field` or field[i]: fewer than two frames (three for a closed curve), a frame of another
/// vertex count, with a coordinate that is not finite, or a triangle without area.
void requireCurve(const Topology& topology, const Curve& curve, const std::string& field);

/// The measures of every frame. Runs a parallel loop in the current TBB arena.
std::vector<ShellMeasures> measuresOf(const Topology& topology, const Curve& curve);

/// The energy W[a, b] + W[b, a] of each segment [m^2], summed in [BvTH16] (4).
std::vector<double> segmentEnergies(const Topology& topology, double bending, const Curve& curve,
                                    const std::vector<ShellMeasures>& measures);

/// E[a, b] = W[a, b] + W[b, a] is so many times what PairEnergy has, which is the mean of both directions.
inline constexpr double kBothDirections = 2;

/// The part of the gradient of (4) that belongs to a frame between two others, at `shape`, V x 3 [m]. energy:
/// symmetric.
Vertices curveGradient(const Topology& topology, const PairEnergy& energy, const Vertices& shape,
                       const ShellMeasures& before, const ShellMeasures& here, const ShellMeasures& after);

/// The norm of each frame's part of the gradient of (4), the left-hand side of (3) [m]; 0 at the ends of an open curve.
/// Large where the motion has a corner.
std::vector<double> gradientNorms(const Topology& topology, double bending, const Curve& curve,
                                  const std::vector<ShellMeasures>& measures);

}  // namespace shaped
