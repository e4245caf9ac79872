#pragma once

#include "tests/benchmark/experiments/body_data.h"

namespace shaped::experiments {

/// Scans of one dressed person in motion, with what is under the cloth.
struct ClothedData {
  std::vector<Scan> scans;
  std::vector<Vertices> bodies;   ///< under the cloth, in the scan's place
  std::vector<double> thickness;  ///< of the cloth over trunk and legs, median, m
  Vertices rest;                  ///< of that person, V x 3, m
};

/// The 8 frames of a walk in body_scans.
ClothedData clothedWalk();

/// A second sequence. No number was chosen on it, but steps were: that identity and postures move together, and how
/// missed limbs are searched. A woman of body_identities that no model may have seen (one of
/// those with a posed variant), 8 frames of a run of body_sequences a sixth of a second apart, and cloth of 1 to 6 cm
/// on trunk, upper arms and legs that varies smoothly and swings from frame to frame. Head, forearms, hands and feet
/// are bare. Scanned by scanVirtually, each frame in a place of its own.
ClothedData clothedRun(const BodyData& data);

}  // namespace shaped::experiments
