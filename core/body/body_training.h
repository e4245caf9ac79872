#pragma once

#include <stop_token>

#include "core/body/body_model.h"
#include "core/body/posture.h"
#include "core/numerics/progress.h"

namespace shaped {

struct BodyTrainingOptions {
  PostureNormalisation posture = PostureNormalisation::kSkeleton;
  double reach = 0.1;       ///< of kLocal's neighbourhoods, m, > 0
  int modes = 0;            ///< kept, >= 0 and less than the registrations; 0: as many as `explained` asks for
  double explained = 0.99;  ///< share of the variance that the modes must hold, > 0, <= 1
  std::stop_token stop = {};
  ProgressSink progress = {};

  std::optional<std::string> firstViolation() const;  ///< "modes = -1, want >= 0"
};

struct TrainedBody {
  BodyModel model;
  Eigen::VectorXd variances;         ///< of all modes of the training set, falling [m^2]
  std::vector<Vertices> normalised;  ///< the registrations in the rest pose, where PCA saw them
};

/// Learns an S-SCAPE model [Wuh18, chapter 9]: takes the posture out of each registration, aligns them (generalised
/// Procrustes), and keeps the principal components. The mean stands upright where the template stands; skin weights,
/// limits and regressor are the template's.
///
/// registrations: n >= 2 shapes, V x 3. Nothing when the stop token fired. Throws InvalidInput naming the option, the
/// registration that does not fit the template or holds a triangle without area, or saying that they are all alike.
std::optional<TrainedBody> trainBody(const PostureTemplate& reference, const std::vector<Vertices>& registrations,
                                     const BodyTrainingOptions& options = {});

/// The template of a rig; throws what Rig::requireValid and requireValidShape throw.
PostureTemplate makePostureTemplate(TopologyPtr topology, const Vertices& rest, Rig rig);

/// The rig of a mesh without one: a single joint at its mean vertex that carries everything. With it, faces and hands
/// go the way of bodies, and their pose is a rigid motion.
Rig rigidRig(const Vertices& rest);

}  // namespace shaped
