#include "tests/support/bootstraps.h"

#include "core/sample/creature_rig.h"
#include "tests/support/rigs.h"

namespace shaped::test {
namespace {

const SampleCreature& smallCreature() {
  static const SampleCreature creature = makeCreature({.vertices = 600, .proportions = {}});
  return creature;
}

/// An individual about its own joints, slightly posed.
Vertices individual(const PostureTemplate& reference, unsigned seed, double angle) {
  const Vertices rest = withProportions(smallCreature(), randomProportions(seed, 0.08)).rest;
  const auto& rig = reference.rig;
  return PosedSkin(rig.skeleton, rig.weights, rest, reference.regressor * rest, randomPose(rig.skeleton, angle, seed))
      .vertices();
}

BootstrapOptions quickOptions() {
  BootstrapOptions options;
  options.rounds = 2;
  options.modes = 3;
  options.least_joined = 1;
  options.scanner.points = 2000;
  options.scanner.ring_radius = 2;
  options.scanner.noise = 0.0005;
  options.scanner.largest_shift = 0.2;
  options.registration.start.samples = 200;
  options.registration.start.fine_steps = 20;
  options.registration.start.kept = 2;
  options.registration.fit.levels = {
      {300, 0.20, 0.10, 0.030, false, 8}, {600, 0.10, 0.04, 0.010, true, 8}, {2000, 0.05, 0.02, 0.005, true, 6}};
  return options;
}

}  // namespace

Scan scanOf(const CreatureBootstrap& set, const Vertices& shape, std::uint64_t seed) {
  auto scanner = set.options.scanner;
  scanner.motion = RigidMotion{};
  scanner.seed = seed;
  return scanVirtually(shape, set.inputs.reference.topology->faces(), scanner).scan;
}

CreatureBootstrap creatureBootstrap(int registrations, int examples, int scans) {
  const auto& creature = smallCreature();
  CreatureBootstrap set{
      {makePostureTemplate(creature.topology, creature.rest, rigOf(creature)), {}, {}, {}}, quickOptions(), {}};
  unsigned seed = 1;
  for (int i = 0; i < registrations; ++i)
    set.inputs.registrations.push_back(individual(set.inputs.reference, seed++, 0));
  for (int i = 0; i < examples; ++i)
    set.inputs.examples.push_back({individual(set.inputs.reference, seed++, 0.1), std::nullopt});
  std::vector<Scan> all;
  for (int i = 0; i < scans; ++i) {
    set.truths.push_back(individual(set.inputs.reference, seed++, 0.1));
    all.push_back(scanOf(set, set.truths.back(), seed));
  }
  const auto count = all.size();
  set.inputs.scans = {count, [all = std::move(all)](std::size_t i) { return all.at(i); },
                      [](std::size_t i) { return "scan_" + std::to_string(i); }};
  return set;
}

}  // namespace shaped::test
