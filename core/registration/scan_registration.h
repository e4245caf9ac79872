#pragma once

#include <optional>
#include <string>
#include <vector>

#include "core/registration/field_deformation.h"
#include "core/registration/rigid_start.h"
#include "core/registration/scan_to_model.h"
#include "core/registration/template_fitting.h"
#include "core/registration/tip_seating.h"

namespace shaped {

/// After the model, the surface itself: stiff enough to stay where the model saw nothing.
FittingOptions refinementDefaults();

struct ScanRegistrationOptions {
  RigidStartOptions start;
  ModelFitOptions fit;
  TipOptions tips;      ///< seated after the fit
  bool refine = false;  ///< whether the fitted surface is then deformed onto the scan (fitTemplate)
  FittingOptions refinement = refinementDefaults();
  std::shared_ptr<const FieldDeformation> field = {};  ///< of the model: then deforms the fitted surface; none: nothing
  double unit_factor = 1;         ///< the scan is multiplied by it first, > 0: 0.001 for millimetres
  double doubtful_margin = 0.35;  ///< of the rigid start: below it the runner-up is tried as well, >= 0
  double least_score = 0.85;      ///< below it the registration is called doubtful, 0 to 1
  std::stop_token stop = {};

  std::optional<std::string> firstViolation() const;  ///< "unit_factor = 0, want > 0"
};

/// What a model's field made of its surface.
struct FieldRegistration {
  Vertices rest;          ///< X', V x 3: the surface in the model's rest pose (FieldDeformation)
  Pose pose;              ///< of that surface
  ModelFitReport report;  ///< of that surface, as ScanRegistration::report of the model's
};

/// A raw scan in the model's topology.
struct ScanRegistration {
  BodyState state;
  Vertices vertices;      ///< V x 3, in the scan's place (times unit_factor): of the model, its field or the refinement
  ModelFitReport report;  ///< of the model
  std::optional<FieldRegistration> field;  ///< where a field deformed the surface
  std::optional<FittingReport> refinement;
  double start_margin = 0;  ///< RigidStart::margin
  bool took_runner_up = false;
  bool flipped_normals = false;                 ///< the scan's normals pointed inwards and were turned over
  std::optional<double> suspected_unit_factor;  ///< what unit_factor should perhaps have been
  double score = 0;  ///< share of the scan within a hundredth of the model's extent of its surface, facing the same way
  std::vector<std::string> warnings;  ///< sentences for people, the gravest first
};

/// Registers a raw scan, whatever its placement: rigid start (both ways where it is ambiguous), identity and pose
/// (fitModelToScan), fingers and toes (seatTips), the model's field where one is given, and the surface itself where
/// asked for. With three landmarks or more the start comes from them. A fit that failed is not deformed further; nor
/// does a field deform what next to no point of the scan lies on, which a warning says.
///
/// residual and termination are of the model's fit, or of the refinement where that did not converge. Throws
/// InvalidInput naming an option, `scan` (requireUsableScan) or a landmark.
Solved<ScanRegistration> registerScan(const Scan& scan, const BodyModel& model, const std::vector<Landmark>& landmarks,
                                      const ScanRegistrationOptions& options = {});

/// From a state that is roughly right, as that of the last frame of a sequence: no rigid start.
Solved<ScanRegistration> registerScanFrom(const Scan& scan, const BodyModel& model, const BodyState& start,
                                          const std::vector<Landmark>& landmarks,
                                          const ScanRegistrationOptions& options = {});

/// The scan as it is registered: times unit_factor, its normals outwards. Throws InvalidInput naming `scan`
/// (requireUsableScan).
Scan preparedScan(const Scan& scan, double unit_factor);

/// ScanRegistration::score of a surface (V x 3, of the model).
double registrationScore(const ScanSurface& scan, const BodyModel& model, const Vertices& surface);

/// Whether the normals of a scan point inwards on the whole: the mean of n . (x - centre), which for a closed surface
/// is three times its volume, is negative. False without normals.
bool pointsInwards(const Scan& scan);

}  // namespace shaped
