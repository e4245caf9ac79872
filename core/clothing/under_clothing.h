#pragma once

#include <optional>
#include <span>
#include <stop_token>
#include <string>
#include <vector>

#include "core/mesh/scan.h"
#include "core/numerics/progress.h"
#include "core/registration/limb_search.h"
#include "core/registration/scan_registration.h"

namespace shaped {

/// How strongly each term of (10.1) in [Wuh18] counts, in one step of its schedule.
struct ClothingWeights {
  double landmarks;  ///< omega_lnd, >= 0
  double data;       ///< omega_data: of points inside the scan, >= 0
  double cloth;      ///< omega_cloth: of points outside it, beside what they have as data, >= 0
};

/// For people in motion, whose joints stand far from rest.
ScanRegistrationOptions clothedRegistration();

struct ClothingOptions {
  int fitted_alone = 16;      ///< frames, spread over the sequence, that are registered by themselves, >= 1
  double good_share = 0.975;  ///< of the best frame's score: what fits worse is tried again from other frames, 0 to 1
  int retries = 3;            ///< poses of other frames that are tried, >= 1
  int first_frames = 3;       ///< that the first identity is solved on, >= 1
  ClothingWeights first = {1, 1, 1};        ///< identity and posture of the first frames
  ClothingWeights postures = {0.5, 1, 10};  ///< posture after posture, the identity held
  ClothingWeights refined = {0, 1, 30};     ///< identity of all frames, the postures held
  double loss_scale = 0.15;                 ///< of the robust loss of points inside: cloth hangs loose, m, > 0
  double outside_scale = 0.03;   ///< of points outside: what stands far out is a missed limb or a stray point, m, > 0
  double max_distance = 0.15;    ///< gate, m, > 0
  double max_normal_angle = 75;  ///< gate, degrees, (0, 180]
  int points = 4000;             ///< of the model that take part, >= 50
  int rounds = 12;               ///< closest points are renewed at most so often in a step, >= 1
  int passes = 2;                ///< postures and identity in turn, >= 1
  double tolerance = 2e-4;       ///< of a round: root mean square motion of the surface, m, > 0
  ScanRegistrationOptions registration = clothedRegistration();  ///< of first fits
  LimbSearchOptions limbs;                                       ///< of first fits
  std::stop_token stop = {};
  ProgressSink progress = {};

  std::optional<std::string> firstViolation() const;  ///< "points = 3, want >= 50"
};

/// How the body lies in one scan.
struct ClothedFrame {
  Pose pose;
  Outcome outcome;  ///< of the posture
  double inside;    ///< share of the vertices with a scan point nearby that lie inside it
  double mean_gap;  ///< of those: how far they lie below the scan on the mean, m
  double score;     ///< of its first fit (ScanRegistration::score)
  bool trusted;     ///< whether it fitted well enough to speak of the identity; else its posture may be missed
};

struct ClothedBody {
  Eigen::VectorXd identity;  ///< one for the sequence
  std::vector<ClothedFrame> frames;
};

/// The body of a dressed person out of raw scans of a motion: one identity, a posture a frame, by minimising
///   E = sum over frames of omega_lnd E_lnd + omega_data E_data + omega_cloth E_cloth      (10.1) of [Wuh18]
/// with E_data the robust squared distance of the body's points to the scan and E_cloth that of the points outside it:
/// cloth lies now here, now there on the skin, and what is inside all frames is the body. Three steps: identity and
/// postures of the first frames; the postures one by one, the identity held; the identity of all frames, the postures
/// held. The last two are repeated. Ours: every frame's posture starts from a first fit of its scan by itself, or from
/// the posture of a frame nearby that fitted better; "first" are the frames that fitted best.
///
/// scans: at least one, in the order of the motion; each may lie anywhere. landmarks: one list a frame, or none at all.
/// The outcome is the last identity's. Throws InvalidInput naming the option, `scans[i]` or `landmarks`.
Solved<ClothedBody> estimateUnderClothing(std::span<const Scan> scans, const BodyModel& model,
                                          std::span<const std::vector<Landmark>> landmarks,
                                          const ClothingOptions& options = {});

}  // namespace shaped
