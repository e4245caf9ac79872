#pragma once

#include <memory>
#include <stop_token>

#include "core/geodesic/length_angle.h"
#include "core/numerics/solved.h"
#include "core/shell/pair_energy.h"
#include "core/shell/structure.h"

namespace shaped {

/// A discrete path: K + 1 shapes, V x 3 each.
using Path = std::vector<Vertices>;

struct GeodesicOptions {
  int max_iterations = 100;  ///< of each Newton solve, >= 1
  double tolerance = 1e-8;   ///< relative gradient norm, > 0
  std::stop_token stop;
};

/// Discrete geodesic calculus on the space of shells, [HZRS18] sections 3 and 8, over one topology with one component.
/// Const and safe to share between threads; symbolic work is done once.
class GeodesicCalculus {
 public:
  GeodesicCalculus(ShellStructurePtr structure, const PairEnergy& energy);

  const ShellStructurePtr& structure() const { return structure_; }
  const Topology& topology() const { return structure_->topology(); }
  /// What stands for W in the comments below.
  const PairEnergy& energy() const { return energy_; }
  double bending() const { return energy_.bending(); }
  const LengthAngleReconstruction& reconstruction() const { return *reconstruction_; }

  /// The discrete K-geodesic from a to b, the minimiser of the path energy (7): K + 1 shapes, the ends as given, K
  /// >= 1. warm: a path with the same number of shapes whose inner ones start the iteration, or empty. Throws
  /// InvalidInput when K < 1 or a shape does not fit the topology.
  Solved<Path> interpolate(const Vertices& a, const Vertices& b, int steps, const GeodesicOptions& options,
                           const Path& warm = {}) const;

  /// The shape after `current` on the discrete geodesic that runs through `previous`: W,2[previous, current] +
  /// W,1[current, next] = 0, equation (23).
  Solved<Vertices> extrapolate(const Vertices& previous, const Vertices& current, const GeodesicOptions& options) const;

  /// The shape before `current` where `next` follows: W,2[previous, current] + W,1[current, next] = 0.
  Solved<Vertices> extrapolateBackwards(const Vertices& current, const Vertices& next,
                                        const GeodesicOptions& options) const;

  /// I(a, b, t) for a K-geodesic from a to b and any real t: nodes at multiples of 1/K, (23) beyond the ends, (24)
  /// between nodes. t = -1 reflects b about a.
  Solved<Vertices> at(const Path& path, double t, const GeodesicOptions& options) const;

  /// The shape between two neighbours that minimises (1 - t) W[a, s] + t W[s, b], equation (24); t in [0, 1].
  Solved<Vertices> between(const Vertices& a, const Vertices& b, double t, const GeodesicOptions& options) const;

  /// The inverse of (24): the shape b of which between(a, b, t) is `inner`, (1 - t) W,2[a, inner] + t W,1[inner, b] =
  /// 0; t in (0, 1].
  Solved<Vertices> through(const Vertices& a, const Vertices& inner, double t, const GeodesicOptions& options) const;

  /// K sum_k W[s_{k-1}, s_k], the squared distance of the ends when the path is a geodesic [m^2].
  double pathEnergy(const Path& path) const;
  /// W[s_{k-1}, s_k] per segment.
  std::vector<double> segmentEnergies(const Path& path) const;
  /// Square root of the path energy [m].
  double distance(const Path& geodesic) const;

  /// Carries a small variation along a path by Schild's ladder ([HRS14]): displaced is the variation's end near the
  /// path's first shape; the answer lies near the path's last shape.
  Solved<Vertices> transport(const Path& path, const Vertices& displaced, const GeodesicOptions& options) const;

 private:
  Path startPath(const Vertices& a, const Vertices& b, int steps, const std::stop_token& stop) const;
  Solved<Path> cascade(const Vertices& a, const Vertices& b, int steps, const GeodesicOptions& options) const;
  Solved<Path> relaxPath(Path path, const GeodesicOptions& options) const;
  /// Where the way from `previous` to `current` leads when it goes on `length` times as far again.
  Vertices predict(const Vertices& previous, const Vertices& current, double length, const std::stop_token& stop) const;

  ShellStructurePtr structure_;
  PairEnergy energy_;
  std::shared_ptr<const LengthAngleReconstruction> reconstruction_;
};

}  // namespace shaped
