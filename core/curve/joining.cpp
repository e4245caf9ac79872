#include "core/curve/joining.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include <Eigen/Geometry>

#include "core/mesh/alignment.h"
#include "core/mesh/quality.h"
#include "core/numerics/error.h"

namespace shaped {
namespace {

constexpr double kAgree = 1e-6;    ///< of the diagonal: frames that are one and the same
constexpr int kLongest = 60;       ///< transition that nobody asked for [frames]
constexpr std::size_t kNear = 10;  ///< frames next to a seam that tell the speed there

/// The turn about `up` and the way across it that carry `source` to `target`; the height stays.
RigidMotion alignUpright(const Vertices& source, const Vertices& target, const Eigen::Vector3d& up) {
  const Eigen::Vector3d axis = up.normalized();
  const Eigen::Matrix3d flat = Eigen::Matrix3d::Identity() - axis * axis.transpose();
  const Eigen::RowVector3d from = source.colwise().mean(), to = target.colwise().mean();
  const Eigen::Matrix3d covariance = (source.rowwise() - from).transpose() * (target.rowwise() - to) * flat;
  // The turn by phi about the axis adds cos(phi) along + sin(phi) across to what is to be as large as it can.
  const double along = (flat * covariance).trace();
  const double across = axis.dot(Eigen::Vector3d(
      covariance(1, 2) - covariance(2, 1), covariance(2, 0) - covariance(0, 2), covariance(0, 1) - covariance(1, 0)));
  const Eigen::Matrix3d rotation = Eigen::AngleAxisd(std::atan2(across, along), axis).toRotationMatrix();
  const Eigen::Vector3d shift = flat * (to.transpose() - rotation * from.transpose());
  return {rotation, shift};
}

double segmentLength(const Topology& topology, double bending, const Vertices& a, const Vertices& b) {
  const Curve segment{{a, b}, false};
  return std::sqrt(segmentEnergies(topology, bending, segment, measuresOf(topology, segment)).front());
}

/// The mean length of a clip's segments at its beginning or its end; 0 where it has none.
double speed(const Topology& topology, double bending, const std::vector<Vertices>& clip, bool at_end) {
  const std::size_t count = std::min(kNear, clip.size() - 1);
  const std::size_t first = at_end ? clip.size() - 1 - count : 0;
  double length = 0;
  for (std::size_t i = first; i < first + count; ++i) length += segmentLength(topology, bending, clip[i], clip[i + 1]);
  return count == 0 ? 0 : length / static_cast<double>(count);
}

/// Frames that keep the mean speed of both sides over a way of such length.
int evenTransition(double length, double before, double after) {
  const double known = (before > 0 ? 1 : 0) + (after > 0 ? 1 : 0);
  if (known == 0) return 0;
  const double frames = std::round(length / ((before + after) / known)) - 1;
  return static_cast<int>(std::clamp(frames, 0.0, static_cast<double>(kLongest)));
}

void requireClips(const Topology& topology, const std::vector<std::vector<Vertices>>& clips) {
  if (clips.size() < 2) throw InvalidInput("clips", "has " + std::to_string(clips.size()) + ", want two or more");
  for (std::size_t k = 0; k < clips.size(); ++k) {
    const std::string name = "clips[" + std::to_string(k) + "]";
    if (clips[k].empty()) throw InvalidInput(name, "has no frames");
    for (std::size_t i = 0; i < clips[k].size(); ++i)
      requireValidShape(topology, clips[k][i], name + "[" + std::to_string(i) + "]");
  }
}

/// Frames around seams, with one that stays at either end: [first, last].
struct Surroundings {
  std::size_t first, last;
};

/// Those of seams that are near each other are one.
std::vector<Surroundings> surroundingsOf(const std::vector<std::pair<std::size_t, std::size_t>>& seams,
                                         std::size_t frames, int reach) {
  std::vector<Surroundings> result;
  const auto margin = static_cast<std::size_t>(reach) + 1;
  for (const auto& [before, after] : seams) {
    const std::size_t first = before > margin ? before - margin : 0;
    const std::size_t last = std::min(after + margin, frames - 1);
    if (!result.empty() && first < result.back().last)
      result.back().last = last;
    else
      result.push_back({first, last});
  }
  return result;
}

void measureWhole(const Topology& topology, double bending, const Curve& curve, double& energy,
                  std::vector<double>& gradient) {
  const auto measures = measuresOf(topology, curve);
  const auto segments = segmentEnergies(topology, bending, curve, measures);
  energy = std::accumulate(segments.begin(), segments.end(), 0.0);
  gradient = gradientNorms(topology, bending, curve, measures);
}

}  // namespace

std::optional<std::string> JoinOptions::firstViolation() const {
  if (transition && *transition < 0) return "transition = " + std::to_string(*transition) + ", want >= 0";
  if (reach < 0) return "reach = " + std::to_string(reach) + ", want >= 0";
  if (up && !(up->allFinite() && up->norm() > 0)) return "up is no direction";
  return geodesic.firstViolation();
}

Solved<Concatenation> concatenated(const ShellStructurePtr& structure, double bending,
                                   const std::vector<std::vector<Vertices>>& clips, const JoinOptions& options) {
  const auto& topology = structure->topology();
  if (const auto violation = options.firstViolation()) throw InvalidInput("options", *violation);
  requireOneComponent(topology, "topology");
  requireClips(topology, clips);
  Solved<Concatenation> result({Curve{clips.front(), false}, {}}, {});
  auto& frames = result.solution.curve.frames;
  const double negligible = kAgree * boundingBoxDiagonal(clips.front().front());
  for (std::size_t k = 1; k < clips.size(); ++k) {
    const auto& clip = clips[k];
    const Vertices last = frames.back();
    const auto motion = options.up ? alignUpright(clip.front(), last, *options.up) : alignRigidly(clip.front(), last);
    const Vertices first = apply(motion, clip.front());
    const std::size_t seam = frames.size() - 1;
    const bool agree = (first - last).rowwise().norm().maxCoeff() <= negligible;
    if (!agree) {
      const int between = options.transition.value_or(evenTransition(segmentLength(topology, bending, last, first),
                                                                     speed(topology, bending, clips[k - 1], true),
                                                                     speed(topology, bending, clip, false)));
      if (between > 0) {
        auto geodesic = options.geodesic;
        geodesic.frames = between + 2;
        auto way = geodesicByFlow(structure, bending, last, first, geodesic);
        result += way;
        auto& inner = way.solution.curve.frames;
        if (inner.size() > 2) frames.insert(frames.end(), inner.begin() + 1, inner.end() - 1);
        if (way.termination == Termination::kCancelled) return result;
      }
      frames.push_back(first);
    }
    result.solution.seams.emplace_back(seam, frames.size() - 1);
    for (std::size_t i = 1; i < clip.size(); ++i) frames.push_back(apply(motion, clip[i]));
  }
  return result;
}

Solved<JoinedClips> joined(const ShellStructurePtr& structure, double bending,
                           const std::vector<std::vector<Vertices>>& clips, const JoinOptions& options,
                           const ProgressSink& progress) {
  auto whole = concatenated(structure, bending, clips, options);
  Solved<JoinedClips> result;
  static_cast<Outcome&>(result) = whole;
  auto& joint = result.solution;
  joint.curve = std::move(whole.solution.curve);
  joint.seams = std::move(whole.solution.seams);
  if (whole.termination == Termination::kCancelled) return result;
  measureWhole(structure->topology(), bending, joint.curve, joint.path_energy_before, joint.gradient_before);
  auto smoothing = options.smoothing;
  smoothing.flow.restore = {};
  smoothing.flow.held = {};
  joint.steps = smoothing.steps;
  joint.stationary = true;
  const auto places = surroundingsOf(joint.seams, joint.curve.size(), options.reach);
  for (std::size_t k = 0; k < places.size(); ++k) {
    const auto begin = joint.curve.frames.begin() + static_cast<std::ptrdiff_t>(places[k].first);
    const auto end = joint.curve.frames.begin() + static_cast<std::ptrdiff_t>(places[k].last) + 1;
    const auto within = [&](const Progress& step) {
      progress({"seam " + std::to_string(k + 1) + ", " + step.stage,
                (static_cast<double>(k) + step.fraction) / static_cast<double>(places.size()), step.residual});
    };
    auto smooth = smoothed(structure, bending, {{begin, end}, false}, smoothing,
                           progress ? ProgressSink(within) : ProgressSink());
    result += smooth;
    if (result.termination == Termination::kCancelled) return result;
    std::move(smooth.solution.curve.frames.begin(), smooth.solution.curve.frames.end(), begin);
    joint.steps = std::min(joint.steps, static_cast<int>(smooth.solution.steps.size()));
    joint.stationary = joint.stationary && smooth.solution.stationary;
  }
  measureWhole(structure->topology(), bending, joint.curve, joint.path_energy_after, joint.gradient_after);
  return result;
}

}  // namespace shaped
