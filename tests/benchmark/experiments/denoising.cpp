// Row 8 of the table on [BvTH16]: noise in motions, against filters of vertex trajectories. The noisy motions are made
// by tests/benchmark/noisy_clips.py; SHAPED_NOISY names their folder (/tmp/noisy).

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <limits>

#include "core/curve/smoothing.h"
#include "core/curve/trajectory_filters.h"
#include "core/io/frames.h"
#include "core/io/npy.h"
#include "core/mesh/alignment.h"
#include "core/shell/energy.h"
#include "tests/benchmark/experiments/data.h"
#include "tests/benchmark/experiments/experiment.h"
#include "tests/benchmark/experiments/timing.h"

namespace shaped::experiments {
namespace {

constexpr double kMillimetres = 1000, kPercent = 100;

/// What a filter made of a motion, against the clean one.
struct Quality {
  double error = 0;      ///< RMS distance of vertices, each frame aligned [m]
  double elastic = 0;    ///< root of the mean energy E[frame, clean frame] [m]
  double roughness = 0;  ///< RMS second difference of vertices in time [m]
  double energy = 0;     ///< path energy (4) [m^2]
  double volume = 0;     ///< largest relative change over the frames
  double limbs = 0;      ///< largest relative change of a limb's extent over limbs and frames
  std::string how;
};

double volumeOf(const Faces& faces, const Vertices& shape) {
  double six = 0;
  for (Eigen::Index f = 0; f < faces.rows(); ++f) {
    const Eigen::Vector3d a = shape.row(faces(f, 0)), b = shape.row(faces(f, 1)), c = shape.row(faces(f, 2));
    six += a.dot(b.cross(c));
  }
  return six / 6;
}

/// RMS distance of each limb's vertices from their middle.
Eigen::VectorXd extents(const Vertices& shape, const std::vector<std::vector<Eigen::Index>>& limbs) {
  Eigen::VectorXd result(static_cast<Eigen::Index>(limbs.size()));
  for (std::size_t k = 0; k < limbs.size(); ++k) {
    const Vertices part = shape(limbs[k], Eigen::all);
    const Vertices centred = part.rowwise() - part.colwise().mean();
    result[static_cast<Eigen::Index>(k)] = std::sqrt(centred.squaredNorm() / static_cast<double>(part.rows()));
  }
  return result;
}

class Judge {
 public:
  Judge(TopologyPtr topology, std::vector<Vertices> clean)
      : topology_(std::move(topology)), clean_(std::move(clean)), bending_(defaultBending(clean_.front())) {
    constexpr std::int64_t any[] = {-1};
    const auto joints = readNpy(dataPath("posed_body/rig/dominant_joint_1k_i8.npy"), any);
    std::vector<std::vector<Eigen::Index>> parts(64);
    for (std::size_t v = 0; v < joints.values.size(); ++v)
      parts[static_cast<std::size_t>(joints.values[v])].push_back(static_cast<Eigen::Index>(v));
    for (auto& part : parts)
      if (part.size() >= 12) limbs_.push_back(std::move(part));
  }

  Quality operator()(const Curve& curve, std::string how) const {
    Quality quality;
    quality.how = std::move(how);
    double squares = 0, second = 0;
    const auto last = curve.size() - 1;
    for (std::size_t i = 1; i < last; ++i) {
      const auto &frame = curve.frames[i], &truth = clean_[i];
      squares += (apply(alignRigidly(frame, truth), frame) - truth).squaredNorm();
      second += (curve.frames[i - 1] - 2 * frame + curve.frames[i + 1]).squaredNorm();
      const double volume = volumeOf(topology_->faces(), frame) / volumeOf(topology_->faces(), truth) - 1;
      quality.volume = std::max(quality.volume, std::abs(volume));
      const Eigen::ArrayXd limbs = extents(frame, limbs_).array() / extents(truth, limbs_).array() - 1;
      quality.limbs = std::max(quality.limbs, limbs.abs().maxCoeff());
    }
    const auto measures = measuresOf(*topology_, curve), truths = measuresOf(*topology_, {clean_, false});
    for (const double energy : segmentEnergies(*topology_, bending_, curve, measures)) quality.energy += energy;
    const PairEnergy energy(bending_, EnergySymmetry::kSymmetric);
    for (std::size_t i = 1; i < last; ++i)
      quality.elastic += kBothDirections * energy.value(*topology_, measures[i], truths[i]);
    quality.elastic = std::sqrt(quality.elastic / static_cast<double>(last - 1));
    const auto count = static_cast<double>((last - 1) * static_cast<std::size_t>(clean_[0].rows()));
    quality.error = std::sqrt(squares / count);
    quality.roughness = std::sqrt(second / count);
    return quality;
  }

 private:
  TopologyPtr topology_;
  std::vector<Vertices> clean_;
  double bending_;
  std::vector<std::vector<Eigen::Index>> limbs_;
};

std::string told(const Quality& quality) {
  return text(
      "%s: error %.2f mm, elastic %.4f m, roughness %.2f mm, path energy %.4f m^2, volume %.2f %%, limbs %.2f %%",
      quality.how.c_str(), kMillimetres * quality.error, quality.elastic, kMillimetres * quality.roughness,
      quality.energy, kPercent * quality.volume, kPercent * quality.limbs);
}

std::vector<Quality> flows(const Judge& judge, const ShellStructurePtr& structure, const Curve& noisy) {
  std::vector<Quality> results;
  const double bending = defaultBending(noisy.frames.front());
  for (const double rho : {0.02, 0.1, 0.3})
    for (const int dimension : {8, 15, 30}) {
      SmoothingOptions options;
      options.flow.restore.assign(noisy.size(), rho);
      options.reduction.dimension = dimension;
      Curve now = noisy;
      const ReducedCurve reduced(structure->topologyPtr(), bending, noisy, options.reduction);
      auto flow = reduced.flow(options.flow);
      int taken = 0;
      for (const int steps : {1, 2, 4, 8, 16}) {
        for (; taken < steps; ++taken) flow.step();
        for (std::size_t i = 1; i + 1 < noisy.size(); ++i) now.frames[i] = reduced.fine(i, flow.frame(i));
        results.push_back(judge(now, text("flow, rho %.2f, %d dimensions, %d steps", rho, dimension, steps)));
      }
    }
  return results;
}

std::vector<Quality> bilaterals(const Judge& judge, const Curve& noisy) {
  std::vector<Quality> results;
  for (double frames = 0.4; frames < 6; frames *= 1.15)
    for (const double distance : {0.02, 0.08, std::numeric_limits<double>::infinity()})
      results.push_back(judge(filteredBilaterally(noisy, frames, distance),
                              text("bilateral, %.2f frames, %.2f m", frames, distance)));
  return results;
}

using Measure = double Quality::*;

bool keepsSize(const Quality& quality) { return quality.volume <= 0.01 && quality.limbs <= 0.01; }

/// The flow that is furthest ahead of the best bilateral filter that is at least as smooth: one that keeps volume and
/// limbs, where there is one.
void compareAtEqual(Report& report, const std::string& title, const std::vector<Quality>& ours,
                    const std::vector<Quality>& theirs, Measure error, Measure smoothness) {
  const Quality *best = nullptr, *rival = nullptr;
  double ratio = 0;
  const bool any = std::any_of(ours.begin(), ours.end(), keepsSize);
  for (const auto& flow : ours) {
    if (any && !keepsSize(flow)) continue;
    const Quality* equal = nullptr;
    for (const auto& other : theirs)
      if (other.*smoothness <= flow.*smoothness && (equal == nullptr || other.*error < equal->*error)) equal = &other;
    if (equal == nullptr || equal->*error / flow.*error <= ratio) continue;
    ratio = equal->*error / flow.*error;
    best = &flow;
    rival = equal;
  }
  if (best == nullptr) return report.entry(title, "no bilateral filter is as smooth");
  report.entry(title, text("%.2f; ", ratio) + told(*best) + "; " + told(*rival), ">= 2; <= 1 %",
               ratio >= 2 && keepsSize(*best));
}

void denoise(Report& report, const std::string& clip, const std::string& kind) {
  const char* given = std::getenv("SHAPED_NOISY");
  const std::filesystem::path folder = given != nullptr ? given : "/tmp/noisy";
  if (!std::filesystem::exists(folder / (clip + "_clean.npy")))
    throw MissingData((folder / (clip + "_clean.npy")).string() + " is not there: run tests/benchmark/noisy_clips.py");
  const auto topology = bodies1k().topology;
  const Judge judge(topology, readFrames(folder / (clip + "_clean.npy")));
  const Curve noisy{readFrames(folder / (clip + "_" + kind + ".npy")), false};
  const std::string title = clip + ", " + kind;
  report.entry(title, told(judge(noisy, "as it is")));
  const auto ours = flows(judge, std::make_shared<const ShellStructure>(topology), noisy);
  const auto theirs = bilaterals(judge, noisy);
  const auto less = [](const Quality& a, const Quality& b) { return a.error < b.error; };
  report.entry(title + ", least error", told(*std::min_element(ours.begin(), ours.end(), less)) + "; " +
                                            told(*std::min_element(theirs.begin(), theirs.end(), less)));
  for (const auto& [name, measure] :
       {std::pair{"error", &Quality::error}, std::pair{"elastic error", &Quality::elastic}}) {
    compareAtEqual(report, title + ", " + name + " at equal roughness", ours, theirs, measure, &Quality::roughness);
    compareAtEqual(report, title + ", " + name + " at equal path energy", ours, theirs, measure, &Quality::energy);
  }
}

}  // namespace

void denoising() {
  Report report("Denoising");
  for (const char* clip : {"run_muscular", "walk_child", "sword_muscular"})
    for (const char* kind : {"pose", "vertex", "surface", "captured"}) denoise(report, clip, kind);
}

}  // namespace shaped::experiments
