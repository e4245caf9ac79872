#pragma once

#include <optional>
#include <span>
#include <stop_token>
#include <string>
#include <vector>

#include "core/clothing/extremities.h"
#include "core/mesh/scan.h"
#include "core/numerics/progress.h"
#include "core/registration/limb_search.h"
#include "core/registration/scan_registration.h"

namespace shaped {

/// How strongly each term of (10.1) in [Wuh18] counts, in one pass.
struct ClothingWeights {
  double landmarks;  ///< omega_lnd, >= 0
  double data;       ///< omega_data: of points inside the scan, >= 0
  double cloth;      ///< omega_cloth: of points outside it, beside what they have as data, >= 0
};

/// For people in motion, whose joints stand far from rest.
ScanRegistrationOptions clothedRegistration();

struct ClothingOptions {
  int fitted_alone = 16;     ///< frames, spread over the sequence, that are registered by themselves, >= 1
  double good_share = 0.96;  ///< of the best first fit's score: what fits worse is tried again from others, 0 to 1
  int retries = 2;           ///< good frames nearby whose poses are tried in first fits, and limb by limb, >= 1
  int first_modes = 20;  ///< of the model in first fits, which take cloth for body: more would follow its folds, >= 1
  ClothingWeights first = {1, 1, 1};    ///< of the first pass; each pass goes by the same factor towards the last
  ClothingWeights last = {0.5, 1, 30};  ///< of the last pass
  double first_loss_scale = 0.08;       ///< of the robust loss of points inside, for the identity, m, > 0
  double last_loss_scale = 0.015;       ///< in the last pass: by then only skin and tight cloth lie near, m, > 0
  double posture_loss_scale = 0.08;     ///< of points inside, for postures: cloth hangs loose, m, > 0
  double outside_scale = 0.03;    ///< of points outside: what stands far out is a missed limb or a stray point, m, > 0
  double tight_spread = 0.0025;   ///< gaps that vary less over the frames are skin or tight cloth, m, > 0
  double sigma = 0.003;           ///< BodyFitOptions, m, > 0
  double observations = 300;      ///< BodyFitOptions, for one step's frames together, > 0
  double max_distance = 0.15;     ///< gate, m, > 0
  double max_normal_angle = 75;   ///< gate, degrees, (0, 180]
  double thickest = 0.1;          ///< no cloth hangs further from the skin, m, > 0
  double scan_noise = 0.0015;     ///< standard deviation of the scan's points: twice that is not yet outside, m, >= 0
  double explained_share = 0.99;  ///< of the best frame's `explained`: a frame that has less is not trusted, 0 to 1
  int points = 3000;              ///< of the model that take part, >= 50
  int rounds = 8;                 ///< closest points are renewed at most so often in a step, >= 1
  int together = 8;               ///< frames whose postures move with the identity; effort grows with its cube, >= 1
  int passes = 6;                 ///< identity and postures in turn, >= 1
  double tolerance = 2e-4;        ///< of a round: root mean square motion of the surface, m, > 0
  ScanRegistrationOptions registration = clothedRegistration();  ///< of first fits
  LimbSearchOptions limbs;                                       ///< of first fits
  ExtremityOptions extremities;                                  ///< of hands and feet, at last
  std::stop_token stop = {};
  ProgressSink progress = {};

  std::optional<std::string> firstViolation() const;  ///< "points = 3, want >= 50"
};

/// How the body lies in one scan.
struct ClothedFrame {
  Pose pose;
  Outcome outcome;    ///< of the posture
  double seen = 0;    ///< share of the vertices with a scan point nearby that faces their way
  double inside = 0;  ///< of those: share that lies inside the scan, or outside by at most twice its noise
  double inside_strictly =
      0;                 ///< share that lies inside; half of the naked skin, which the noise leaves on either side
  double mean_gap = 0;   ///< how far they lie below the scan on the mean, m
  double explained = 0;  ///< share of the scan's points no further from the body than the thickest cloth
  bool trusted = false;  ///< whether it explains its scan as the best frame does; else a limb may be missed
};

struct ClothedBody {
  Eigen::VectorXd identity;  ///< one for the sequence
  std::vector<ClothedFrame> frames;
};

/// The body of a dressed person out of raw scans of a motion: one identity, a posture a frame, by minimising
///   E = sum over frames of omega_lnd E_lnd + omega_data E_data + omega_cloth E_cloth      (10.1) of [Wuh18]
/// with E_data the robust squared distance of the body's points to the scan and E_cloth that of the points outside it.
/// The identity together with the postures of some frames, and the postures with the identity held, in turn, the
/// cloth's weight rising and the data's loss narrowing from pass to pass.
///
/// Ours: first postures come from fits of each scan by itself (FirstFits), then limb by limb also from frames nearby;
/// hands and feet, which are taken to be bare, are seated by themselves (seatExtremity). And the data of a point inside
/// counts by how little its gap varies over the frames: naked skin keeps its distance, cloth comes and goes. So head,
/// hands and feet tell who it is, cloth only where the body must not be, and in between the identity prior decides.
/// That takes three frames or more; with fewer all points count alike, and the body under loose cloth comes out too
/// large.
///
/// scans: at least one, in the order of the motion; each may lie anywhere. landmarks: one list a frame, or none at all.
/// The outcome is the last identity's; a body that was cancelled has neither identity nor frames. Throws InvalidInput
/// naming the option, `scans[i]` or `landmarks[i][j]`.
Solved<ClothedBody> estimateUnderClothing(std::span<const Scan> scans, const BodyModel& model,
                                          std::span<const std::vector<Landmark>> landmarks,
                                          const ClothingOptions& options = {});

}  // namespace shaped
