#pragma once

#include <cstdint>

#include "core/body/body_training.h"
#include "tests/benchmark/experiments/data.h"

namespace shaped::experiments {

/// The bodies of body_identities with the rig of posed_body. Forty identities have a posed variant; their raw scans are
/// body_scans. The eighty others are what models may see.
struct BodyData {
  PostureTemplate reference;                ///< the average adult and its rig
  std::vector<Vertices> rest;               ///< 120 bodies at rest, m
  std::vector<Vertices> posed;              ///< 40 of them, slightly posed
  std::vector<std::size_t> posed_identity;  ///< which body of `rest` each is
  std::vector<std::size_t> others;          ///< the 80 bodies that have no posed variant
};

/// Reads them. The rig file is the one that SHAPED_RIG names (default /tmp/rig/body_full.json), made by
///   tests/support/rig_from_data.py posed_body ~/.cache/shaped-data/posed_body /tmp/rig/body_full.json
BodyData bodyData();

/// A body slightly posed, as those of the data are: every joint that the data turns by a random vector, of 2.5 degrees
/// a component, arms twice that.
Vertices slightlyPosed(const PostureTemplate& reference, const Vertices& rest, std::uint64_t seed);

}  // namespace shaped::experiments
