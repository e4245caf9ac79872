#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "core/mesh/topology.h"
#include "core/sample/anatomy.h"

namespace shaped {

struct CreatureOptions {
  int vertices = 1500;      ///< wanted count, 600 to 20000; the mesh has it to within 10 %
  Proportions proportions;  ///< of the body; the connectivity is the same for all

  std::optional<std::string> firstViolation() const;  ///< "vertices = 10, want 600 to 20000"
};

/// A closed, articulated animal: one oriented 2-manifold of one component and genus 0, about 1 m long, standing on y =
/// 0, y up, facing +z, its left at +x. A fixture and demonstration; it stands for no real species.
struct SampleCreature {
  TopologyPtr topology;
  Vertices rest;            ///< V x 3, metres: standing
  std::vector<Bone> bones;  ///< parents before children
  Eigen::MatrixXd weights;  ///< V x B, smooth, rows sum to 1
};

/// Meshes the default body once (implicit capsules, marching tetrahedra, isotropic remeshing) and fits it to the asked
/// proportions. The same options give the same numbers. Throws InvalidInput for options out of range.
SampleCreature makeCreature(const CreatureOptions& options = {});

/// The same creature, connectivity and weights, in other proportions: every bone carries its skin along with its own
/// change of length and thickness, then the skin settles on the new body's surface. Throws InvalidInput for proportions
/// out of range.
SampleCreature withProportions(const SampleCreature& creature, const Proportions& proportions);

/// Proportions of a random individual: each factor normal around 1 with deviation `spread`, kept within 0.75 to 1.3.
Proportions randomProportions(std::uint64_t seed, double spread = 0.11);

}  // namespace shaped
