#pragma once

#include "core/body/body_model.h"

namespace shaped {

/// A body as it stands, with what fits of its parts (PartFit) have in common. Immutable; the model must outlive it.
class StandingBody {
 public:
  /// Throws InvalidInput naming what does not fit the model.
  StandingBody(const BodyModel& model, const BodyState& state);

  const BodyModel& model() const { return model_; }
  const Pose& pose() const { return pose_; }

  /// V x 3, in the rest pose, m.
  const Vertices& rest() const { return rest_; }
  const Vertices& restNormals() const { return rest_normals_; }
  /// J x 3, in the rest pose, m.
  const Vertices& restJoints() const { return rest_joints_; }

  /// V x 3, as it stands, m.
  const Vertices& vertices() const { return skin_.vertices(); }
  const Vertices& normals() const { return normals_; }
  /// J x 3, as it stands, m.
  const Vertices& joints() const { return skin_.skeleton().joints; }
  /// V shares of the surface as it stands; sum 1.
  const Eigen::VectorXd& areas() const { return areas_; }

 private:
  const BodyModel& model_;
  Pose pose_;
  Vertices rest_, rest_normals_, rest_joints_;
  PosedSkin skin_;
  Vertices normals_;
  Eigen::VectorXd areas_;
};

}  // namespace shaped
