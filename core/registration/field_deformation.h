#pragma once

#include <memory>
#include <optional>
#include <stop_token>

#include "core/body/body_model.h"
#include "core/neural/jacobian_field.h"
#include "core/registration/scan_surface.h"
#include "core/registration/scan_to_model.h"
#include "core/registration/tip_seating.h"

namespace shaped {

/// What of a scan is carried to the rest pose.
struct RestScanOptions {
  double max_distance = 0.02;    ///< of a point from the posed surface, relative to the mean's bounding box, > 0
  double max_normal_angle = 70;  ///< between its normal and the surface's, degrees, (0, 180]; lines if unoriented
  int points = 10000;            ///< of the scan that are looked at, evenly by index, >= 1
};

/// A scan in the rest pose of the body that was fitted to it, by inverse skinning: a point p whose nearest point of the
/// posed surface is x goes to where x is at rest, plus T^-1 (p - x) with the skinning's linear part T there. So points
/// of the posed surface come to lie on the surface at rest exactly. Left out are points that are far from the surface,
/// whose normal says that they belong to another sheet of it (an arm against the trunk), or that bones standing nearly
/// opposite to each other carry. Normals are turned along and point outwards; no faces.
///
/// state: where the model lies on the scan. May leave no point. Throws InvalidInput naming what does not fit.
Scan scanAtRest(const BodyModel& model, const BodyState& state, const ScanSurface& scan,
                const RestScanOptions& options = {});

/// smoothResidual of a surface at rest (V x 3) as a scan shows it there, V x 3.
Vertices smoothDisplacements(const FieldReference& reference, const SmoothPrior& prior, const Vertices& rest,
                             const Scan& scan);

/// A body at rest as a field makes it, and the pose in which the field saw the scan.
struct RestBody {
  Vertices rest;  ///< X' of [Mur25] Algorithm 2, V x 3, in the model's rest pose
  Pose pose;      ///< not yet fitted to X'
};

/// A body's surface as a field sees it on a scan.
struct DeformedBody {
  Vertices rest;   ///< X' of [Mur25] Algorithm 2, V x 3, in the model's rest pose
  Pose pose;       ///< of X' on the scan
  Vertices posed;  ///< V x 3, in the scan's place
};

/// A trained Jacobian field with what it needs of a model: from identity and pose that were fitted to a scan to the
/// surface beyond the model's linear space ([Mur25] 3.3.3 and 3.3.4). Immutable; usable from several threads at once.
class FieldDeformation {
 public:
  /// Of a model: Jacobians are relative to its mean at rest. Null once the stop token has fired. Throws InvalidInput as
  /// makeFieldReference and JacobianField do.
  static std::shared_ptr<const FieldDeformation> make(const BodyModel& model, JacobianFieldWeights weights,
                                                      const std::stop_token& stop = {});
  FieldDeformation(std::shared_ptr<const FieldReference> reference, JacobianFieldWeights weights);

  /// X_o = model.rest(state.identity) deformed to X' at rest. Where the field comes with a regression, that goes first:
  /// it adds to X_o what it makes of the fit's evidence, and the pose is fitted anew. Then what smoothResidual makes of
  /// the scan as it then comes to rest, where the field comes with a prior for it; then the field, of the same scan,
  /// unless it is silent. It says nothing of places: at rest each component stays centred where it was. fit: how poses
  /// are fitted.
  ///
  /// Nothing when fewer than kFewestScanPoints points of the scan come to rest, or the field's single precision
  /// overflows on what it sees. Throws InvalidInput naming `model` when its topology is not the field's reference's, or
  /// `state`.
  std::optional<RestBody> atRest(const BodyModel& model, const BodyState& state, const ScanSurface& scan,
                                 const ModelFitOptions& fit = {}) const;

  /// The same on the scan: the pose of X' is fitted to it (refitPose), as that of X_o has made up for what X_o lacked,
  /// and its tips are seated once more (seatTips), as those of X_o may have shifted on the way. tips: how; else as
  /// atRest().
  std::optional<DeformedBody> deform(const BodyModel& model, const BodyState& state, const ScanSurface& scan,
                                     const ModelFitOptions& fit = {}, const TipOptions& tips = {}) const;

  const JacobianFieldWeights& weights() const { return field_.weights(); }
  /// Memory of reference and field, about.
  std::size_t bytes() const;

 private:
  std::shared_ptr<const FieldReference> reference_;
  JacobianField field_;
  std::optional<ResidualRegression> regression_;
};

}  // namespace shaped
