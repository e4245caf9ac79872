#pragma once

#include "core/bootstrap/bootstrap.h"

namespace shaped::test {

/// A bootstrap of small creatures: `registrations` of them at rest, `examples` in a slight pose and without scans, and
/// `scans` of others.
struct CreatureBootstrap {
  BootstrapInputs inputs;
  BootstrapOptions options;
  std::vector<Vertices> truths;  ///< of the scans, in their place
};

CreatureBootstrap creatureBootstrap(int registrations, int examples, int scans);

/// The scan of a shape as it stands, by the bootstrap's scanner.
Scan scanOf(const CreatureBootstrap& set, const Vertices& shape, std::uint64_t seed);

}  // namespace shaped::test
