#pragma once

#include "core/mesh/topology.h"
#include "core/skeleton/joint_regressor.h"
#include "core/skeleton/skinning.h"

namespace shaped {

/// How the posture is taken out of a registered body before identities are learned [Wuh18, chapter 9].
enum class PostureNormalisation {
  kNone,      ///< it stays in
  kSkeleton,  ///< bones are turned back, the surface follows by Laplacian deformation [NH13]
  kLocal,     ///< Laplacian coordinates in local frames, which are turned to the template's [WSX12]; needs no rig
};

/// A template in the rest pose, and the rig in it: what registered bodies are normalised to.
struct PostureTemplate {
  TopologyPtr topology;
  Vertices rest;  ///< V x 3, m
  Rig rig;
  JointRegressor regressor;  ///< J x V
};

/// The pose of a body in correspondence with the template: its joints by the regressor, the turn of each bone as the
/// rotation that carries the template's vertices, weighted by what the bone has in them, nearest to the body's. Bones
/// that carry next to nothing keep to their parent. Closed form; exact for a posed template.
/// shape: V x 3. Throws InvalidInput when the counts differ.
Pose estimatePose(const PostureTemplate& reference, const Vertices& shape);

/// The body in the template's posture, V x 3: details and lengths are the body's own. With kSkeleton every edge is
/// turned by the inverse of what the pose (estimatePose) turned it by; with kLocal by the rotation that carries its
/// neighbourhood (a heat kernel of `reach` metres) nearest to the template's. The edges then seldom close, and least
/// squares with cotangent weights spreads what is left over (turnedEdges). Stands where the template stands: the mean
/// vertex stays where aligning the body rigidly with the template brings it, which is all that kNone does.
/// Throws InvalidInput when the counts differ, or a triangle has no area.
Vertices normalisedPosture(const PostureTemplate& reference, const Vertices& shape, PostureNormalisation how,
                           double reach = 0.1);

}  // namespace shaped
