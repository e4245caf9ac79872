#include "core/scene/clip_conversion.h"

#include <Eigen/SVD>
#include <cmath>

#include "core/io/text_scanner.h"
#include "core/numerics/error.h"
#include "core/skeleton/rotation.h"

namespace shaped {
namespace {

/// The rotation nearest to a matrix that is one within `tolerance`.
std::optional<Eigen::Matrix3d> nearRotation(const Eigen::Matrix3d& matrix, double tolerance) {
  if (!matrix.allFinite()) return std::nullopt;
  const Eigen::JacobiSVD<Eigen::Matrix3d> svd(matrix, Eigen::ComputeFullU | Eigen::ComputeFullV);
  if (!((svd.singularValues().array() - 1).abs() < tolerance).all() || matrix.determinant() < 0) return std::nullopt;
  return svd.matrixU() * svd.matrixV().transpose();
}

std::size_t frameCount(double duration, double rate_hz, std::size_t joints) {
  constexpr double most = 1 << 24;
  const double count = std::floor(duration * rate_hz + 1e-6) + 1;
  if (!(count >= 1) || count * static_cast<double>(joints) > most)
    throw InvalidInput("", "lasts " + shortest(duration) + " s; want at most " + std::to_string(1 << 24) +
                               " joints in all its frames");
  return static_cast<std::size_t>(count);
}

/// The joints of one frame as the file places them.
struct FrameOfFile {
  std::vector<Eigen::Matrix3d> rotations;
  Vertices joints;
};

class FrameConverter {
 public:
  FrameConverter(const ClipConverter& rig, const NodeMotion& motion) : rig_(rig), motion_(motion) {
    unstand_ = rig.bound.stand.linear().inverse() * rig.metres_per_unit;
  }

  Pose pose(std::size_t frame) {
    const auto placed = place(frame);
    Pose pose{placed.joints.row(0).transpose() - rig_.bound.rest_joints.row(0).transpose(),
              Vertices(placed.joints.rows(), 3)};
    for (std::size_t j = 0; j < placed.rotations.size(); ++j) {
      const auto parent = rig_.joints[j].parent;
      const Eigen::Matrix3d turn =
          parent < 0
              ? placed.rotations[j]
              : Eigen::Matrix3d(placed.rotations[static_cast<std::size_t>(parent)].transpose() * placed.rotations[j]);
      pose.rotations.row(static_cast<Eigen::Index>(j)) = axisAngle(turn).transpose();
    }
    requireFit(placed, pose, frame);
    return pose;
  }

  double largestMisfit() const { return largest_misfit_; }

 private:
  [[noreturn]] void fail(std::size_t joint, std::size_t frame, const std::string& problem) const {
    throw InvalidInput("", "joint " + quotedWord(rig_.joints[joint].node->mName.C_Str()) + " " + problem +
                               " in frame " + std::to_string(frame) + ", which no pose of a rig can say");
  }

  FrameOfFile place(std::size_t frame) const {
    const auto count = rig_.joints.size();
    FrameOfFile placed{{}, Vertices(count, 3)};
    const double seconds = static_cast<double>(frame) / rig_.rate_hz;
    for (std::size_t j = 0; j < count; ++j) {
      const Eigen::Affine3d world = motion_.world(*rig_.joints[j].node, seconds);
      const auto turn = nearRotation((world * rig_.bound.inverse_bind[j]).linear() * unstand_, 1e-3);
      if (!turn) fail(j, frame, "changes its scale");
      placed.rotations.push_back(*turn);
      const Eigen::RowVector3d position = rig_.metres_per_unit * world.translation().transpose();
      if (!position.allFinite()) fail(j, frame, "stands nowhere");
      placed.joints.row(static_cast<Eigen::Index>(j)) = position;
    }
    return placed;
  }

  void requireFit(const FrameOfFile& placed, const Pose& pose, std::size_t frame) {
    const auto ours = poseSkeleton(rig_.skeleton, rig_.bound.rest_joints, pose).joints;
    for (std::size_t j = 0; j < rig_.joints.size(); ++j) {
      if (!rig_.joints[j].matters) continue;
      const auto row = static_cast<Eigen::Index>(j);
      const double misfit = (ours.row(row) - placed.joints.row(row)).norm();
      largest_misfit_ = std::max(largest_misfit_, misfit);
      if (!(misfit <= rig_.largest_misfit))
        fail(j, frame,
             "stands " + std::to_string(misfit) + " m off where bones of fixed lengths hold it (tolerance " +
                 std::to_string(rig_.largest_misfit) + " m)");
    }
  }

  const ClipConverter& rig_;
  const NodeMotion& motion_;
  Eigen::Matrix3d unstand_;  ///< of the linear part of M, in the file's unit
  double largest_misfit_ = 0;
};

}  // namespace

ConvertedClip ClipConverter::convert(const aiAnimation& animation) const {
  if (animation.mNumMorphMeshChannels > 0 || animation.mNumMeshChannels > 0)
    throw InvalidInput("", "morphs the mesh, which no pose of a rig can say");
  const NodeMotion motion(scene, &animation);
  FrameConverter frames(*this, motion);
  ConvertedClip converted{{skeleton, bound.rest_joints, rate_hz, {}}, 0};
  const auto count = frameCount(motion.duration(), rate_hz, joints.size());
  for (std::size_t f = 0; f < count; ++f) converted.clip.frames.push_back(frames.pose(f));
  converted.largest_misfit = frames.largestMisfit();
  return converted;
}

}  // namespace shaped
