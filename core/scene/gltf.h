#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "core/skeleton/motion_clip.h"
#include "core/skeleton/rig.h"

namespace shaped {

struct GltfOptions {
  double metres_per_unit = 1;  ///< of the file's lengths, > 0; the format says metres, and not every file keeps to it
  double rate_hz = 30;         ///< at which animations are sampled, > 0
  double tolerance = 5e-3;  ///< how far a joint of a motion may stand from the file's, in diagonals of the body, >= 0
  std::optional<std::string> firstViolation() const;
};

/// An animation of the file as poses of the rig.
struct GltfAnimation {
  std::string name;
  MotionClip clip;
  double
      largest_misfit;  ///< m: how far a joint stands from the file's, at most; 0 up to rounding where no bone stretches
};

/// An animation that poses of the rig cannot say.
struct GltfRefusal {
  std::string name, reason;
};

/// A skinned character: its mesh at rest, its rig and its animations.
struct GltfRig {
  Vertices vertices;  ///< m
  Faces faces;
  Rig rig;
  double largest_weight_change;  ///< the largest |sum of a vertex's weights - 1| in the file
  std::vector<GltfAnimation> animations;
  std::vector<GltfRefusal> refused;   ///< animations that change scales, stretch bones or morph the mesh
  std::vector<std::string> left_out;  ///< meshes without a skin
};

/// Reads the skinned mesh, the rig and the animations of a glTF 2.0 file (.glb, .gltf) by way of assimp.
///
/// Mesh: all skinned meshes, one after the other, as they were bound, standing where the root joint's node puts them
/// without animation. Vertices split at seams become one where bind position and weights are exactly equal; vertices
/// that no face uses and faces that this makes degenerate are left out.
/// Skeleton: the nodes that carry the mesh and those between them, depth first; what is above the root joint is folded
/// into it, and so are joints at the top that carry no vertex and have a single child: files like to move the hips
/// within a root that stays. Their axes are made to be the world's at rest by the inverse bind matrices: with W_j(t)
/// the node's world transform, M_j = W_j(t) B_j^-1 carries the bound mesh, and G_j = M_j M^-1 turns ours, M being the
/// root's without animation. Skinning by poses of the rig is then that of the file wherever no bone stretches.
/// Animations are sampled every 1 / rate_hz s from 0 on, linearly between keys (turns by slerp), which is also what
/// assimp 5.2 leaves of STEP and CUBICSPLINE.
///
/// Throws InvalidInput naming an option out of range, or the file when it cannot be opened or is no glTF that assimp
/// reads, has no skinned mesh, meshes bound differently to the same joints, faces that are no triangles, an index out
/// of range, a number that is not finite, a vertex without weight, two nodes of a joint's name, or a bind transform
/// that mirrors, shears or scales axes differently.
GltfRig readGltfRig(const std::filesystem::path& path, const GltfOptions& options = {});

}  // namespace shaped
