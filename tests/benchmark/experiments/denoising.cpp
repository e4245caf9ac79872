// Row 8 of the table on [BvTH16]: noise in motions, against filters of vertex trajectories. The noisy motions are made
// by tests/benchmark/noisy_clips.py; SHAPED_NOISY names their folder (/tmp/noisy).

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <limits>
#include <map>

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
constexpr std::string_view kClean = "_clean.npy";

/// What a filter made of a motion, against the clean one.
struct Quality {
  double error = 0;      ///< RMS distance of vertices, each frame aligned [m]
  double elastic = 0;    ///< root of the mean energy E[frame, clean frame] [m]
  double roughness = 0;  ///< RMS second difference of vertices in time [m]
  double energy = 0;     ///< path energy (4) [m^2]
  double volume = 0;     ///< largest relative change over the frames
  double limbs = 0;      ///< largest relative change of a limb's mean length over the frames
  double limb = 0;       ///< largest relative change of a limb's length over limbs and frames
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

/// Where a limb ends: the edges between its vertices and those of its neighbour, by the joints that move them most.
using Ring = std::vector<std::array<std::int32_t, 2>>;
/// A part of the body between two joints, such as a thigh.
using Limb = std::pair<Ring, Ring>;

double lengthOf(const Limb& limb, const Vertices& shape) {
  const auto middle = [&](const Ring& ring) {
    Eigen::RowVector3d sum = Eigen::RowVector3d::Zero();
    for (const auto& edge : ring) sum += 0.5 * (shape.row(edge[0]) + shape.row(edge[1]));
    return Eigen::RowVector3d(sum / static_cast<double>(ring.size()));
  };
  return (middle(limb.first) - middle(limb.second)).norm();
}

/// All limbs of 15 cm or more: thighs, shanks, upper arms, forearms.
std::vector<Limb> limbsOf(const Topology& topology, const std::vector<int>& joints, const Vertices& shape) {
  constexpr std::size_t least = 6;  // edges around a joint
  std::map<int, std::map<int, Ring>> rings;
  for (const auto& edge : topology.edges()) {
    const int a = joints[static_cast<std::size_t>(edge[0])], b = joints[static_cast<std::size_t>(edge[1])];
    if (a == b) continue;
    rings[a][b].push_back(edge);
    rings[b][a].push_back(edge);
  }
  std::vector<Limb> limbs;
  for (const auto& [joint, around] : rings) {
    std::vector<Ring> ends;
    for (const auto& [other, ring] : around)
      if (ring.size() >= least) ends.push_back(ring);
    if (ends.size() == 2 && lengthOf({ends[0], ends[1]}, shape) >= 0.15) limbs.emplace_back(ends[0], ends[1]);
  }
  return limbs;
}

class Judge {
 public:
  Judge(TopologyPtr topology, std::vector<Vertices> clean)
      : topology_(std::move(topology)), clean_(std::move(clean)), bending_(defaultBending(clean_.front())) {
    constexpr std::int64_t any[] = {-1};
    const auto joints = readNpy(dataPath("posed_body/rig/dominant_joint_1k_i8.npy"), any);
    limbs_ = limbsOf(*topology_, {joints.values.begin(), joints.values.end()}, clean_.front());
  }

  Quality operator()(const Curve& curve, std::string how) const {
    Quality quality;
    quality.how = std::move(how);
    double squares = 0, second = 0;
    const auto last = curve.size() - 1;
    std::vector<double> changes(limbs_.size(), 0);
    for (std::size_t i = 1; i < last; ++i) {
      const auto &frame = curve.frames[i], &truth = clean_[i];
      squares += (apply(alignRigidly(frame, truth), frame) - truth).squaredNorm();
      second += (curve.frames[i - 1] - 2 * frame + curve.frames[i + 1]).squaredNorm();
      const double volume = volumeOf(topology_->faces(), frame) / volumeOf(topology_->faces(), truth) - 1;
      quality.volume = std::max(quality.volume, std::abs(volume));
      for (std::size_t k = 0; k < limbs_.size(); ++k) {
        const double change = lengthOf(limbs_[k], frame) / lengthOf(limbs_[k], truth) - 1;
        quality.limb = std::max(quality.limb, std::abs(change));
        changes[k] += change / static_cast<double>(last - 1);
      }
    }
    for (const double change : changes) quality.limbs = std::max(quality.limbs, std::abs(change));
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

  int limbs() const { return static_cast<int>(limbs_.size()); }

 private:
  TopologyPtr topology_;
  std::vector<Vertices> clean_;
  double bending_;
  std::vector<Limb> limbs_;
};

std::string told(const Quality& quality) {
  return text(
      "%s: error %.2f mm, elastic %.4f m, roughness %.2f mm, path energy %.4f m^2, volume %.2f %%, limbs %.2f %% in "
      "the mean, %.2f %% "
      "in a frame",
      quality.how.c_str(), kMillimetres * quality.error, quality.elastic, kMillimetres * quality.roughness,
      quality.energy, kPercent * quality.volume, kPercent * quality.limbs, kPercent * quality.limb);
}

/// What n steps make of a motion, for several n.
void runFlow(const Judge& judge, const ReducedCurve& reduced, const Curve& noisy, double rho, double scale,
             std::vector<Quality>& results) {
  SmoothingFlowOptions options;
  options.restore.assign(noisy.size(), rho);
  options.restore_scale = scale;
  auto flow = reduced.flow(options);
  Curve now = noisy;
  int taken = 0;
  for (const int steps : {1, 2, 4, 8, 16}) {
    for (; taken < steps; ++taken) flow.step();
    for (std::size_t i = 1; i + 1 < noisy.size(); ++i) now.frames[i] = reduced.fine(i, flow.frame(i));
    results.push_back(judge(now, text("flow, rho %.2f, scale %.2f m, %ld dimensions, %d steps", rho, scale,
                                      static_cast<long>(reduced.space().dimension()), steps)));
  }
}

/// scales: of the restoring force, 0 for the paper's.
std::vector<Quality> flows(const Judge& judge, const TopologyPtr& topology, const Curve& noisy,
                           const std::vector<double>& scales) {
  std::vector<Quality> results;
  for (const int dimension : {8, 15, 30}) {
    ReducedCurveOptions options;
    options.dimension = dimension;
    const ReducedCurve reduced(topology, defaultBending(noisy.frames.front()), noisy, options);
    for (const double scale : scales)
      for (const double rho : {0.02, 0.1, 0.3}) runFlow(judge, reduced, noisy, rho, scale, results);
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

std::filesystem::path noisyFolder() {
  const char* given = std::getenv("SHAPED_NOISY");
  return given != nullptr ? given : "/tmp/noisy";
}

void denoise(Report& report, const std::filesystem::path& folder, const std::string& clip, const std::string& kind) {
  const auto topology = bodies1k().topology;
  const Judge judge(topology, readFrames(folder / (clip + std::string(kClean))));
  const Curve noisy{readFrames(folder / (clip + "_" + kind + ".npy")), false};
  const std::string title = clip + ", " + kind;
  report.entry(title, told(judge(noisy, text("as it is, %d limbs", judge.limbs()))));
  const auto theirs = bilaterals(judge, noisy);
  const auto least = [](const std::vector<Quality>& all) {
    return told(*std::min_element(all.begin(), all.end(),
                                  [](const Quality& a, const Quality& b) { return a.error < b.error; }));
  };
  report.entry(title + ", bilateral, least error", least(theirs));
  for (const auto& [force, scales] : {std::pair{"restored by energy", std::vector<double>{0}},
                                      std::pair{"restored by distance", std::vector<double>{0.02, 0.05, 0.15, 0.5}}}) {
    const auto ours = flows(judge, topology, noisy, scales);
    const std::string of = title + ", " + force;
    report.entry(of + ", least error", least(ours));
    for (const auto& [name, measure] :
         {std::pair{"error", &Quality::error}, std::pair{"elastic error", &Quality::elastic}}) {
      compareAtEqual(report, of + ", " + name + " at equal roughness", ours, theirs, measure, &Quality::roughness);
      compareAtEqual(report, of + ", " + name + " at equal path energy", ours, theirs, measure, &Quality::energy);
    }
  }
}

}  // namespace

void denoising() {
  Report report("Denoising");
  const auto folder = noisyFolder();
  std::vector<std::string> clips;
  if (std::filesystem::exists(folder))
    for (const auto& entry : std::filesystem::directory_iterator(folder))
      if (const auto name = entry.path().filename().string(); name.ends_with(kClean))
        clips.push_back(name.substr(0, name.size() - kClean.size()));
  if (clips.empty()) throw MissingData(folder.string() + " has no clips: run tests/benchmark/noisy_clips.py");
  std::sort(clips.begin(), clips.end());
  for (const auto& clip : clips)
    for (const char* kind : {"pose", "vertex", "surface", "captured"})
      if (std::filesystem::exists(folder / (clip + "_" + kind + ".npy"))) denoise(report, folder, clip, kind);
}

}  // namespace shaped::experiments
