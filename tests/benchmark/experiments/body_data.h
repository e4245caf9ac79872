#pragma once

#include <cstdint>
#include <nlohmann/json.hpp>

#include "core/body/body_training.h"
#include "core/mesh/alignment.h"
#include "core/mesh/scan.h"
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

/// How an entry of scans.json places its body: `R`, a 3 x 3 rotation, and `t`, m.
RigidMotion motionOf(const nlohmann::json& entry);

/// A raw scan with what it was made from.
struct TrueScan {
  Scan scan;
  Vertices body;         ///< in the scan's place
  std::size_t identity;  ///< which body of BodyData::rest it is of
};

/// The first of the 40 scans of body_scans, as many as SHAPED_SCANS says (default: all).
std::vector<TrueScan> trueScans();

/// A model of the first of `others`, registered in the canonical pose as in [Mur25].
BodyModel modelOf(const BodyData& data, std::size_t identities, int modes);

/// A body slightly posed, as those of the data are: every joint that the data turns by a random vector, of 2.5 degrees
/// a component, arms twice that.
Vertices slightlyPosed(const PostureTemplate& reference, const Vertices& rest, std::uint64_t seed);

}  // namespace shaped::experiments
