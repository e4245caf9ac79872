#include <algorithm>
#include <cmath>
#include <limits>

#include "core/body/body_fit.h"
#include "core/io/frames.h"
#include "core/io/npy.h"
#include "core/mesh/alignment.h"
#include "core/mesh/quality.h"
#include "core/sample/random.h"
#include "tests/benchmark/experiments/body_data.h"
#include "tests/benchmark/experiments/experiment.h"
#include "tests/benchmark/experiments/timing.h"

namespace shaped::experiments {
namespace {

constexpr std::array kModes{1, 3, 5, 11, 20, 30};

const char* nameOf(PostureNormalisation how) {
  switch (how) {
    case PostureNormalisation::kNone:
      return "none";
    case PostureNormalisation::kSkeleton:
      return "skeleton";
    case PostureNormalisation::kLocal:
      return "local";
  }
  return "?";
}

/// Our skinning against the posed bodies of the data, which another program made.
void reportSkinning(Report& report, const BodyData& data) {
  const auto poses = readFrames(dataPath("posed_body/full/poses_f32.npy"));
  const auto rotations = readNpy(dataPath("posed_body/full/local_rotvec_f32.npy"));
  const auto joints = data.reference.rig.skeleton.jointCount();
  double worst = 0;
  for (std::size_t i = 0; i < poses.size(); ++i) {
    Pose pose = restPose(data.reference.rig.skeleton);
    pose.rotations = Eigen::Map<const Vertices>(&rotations.values[i * std::size_t(3 * joints)], joints, 3);
    const Vertices ours = skinned(data.reference.rig, data.reference.rest, pose);
    worst = std::max(worst, maxVertexDistance(ours.rowwise() + (poses[i] - ours).colwise().mean(), poses[i]));
  }
  report.entry("skinning of the 72 poses of posed_body, largest distance, up to a translation", text("%.2g m", worst),
               "1e-5 m, the data's rounding", worst < 1e-5);
}

/// Mean distance of the nearest training shape to samples of the model.
double specificity(const TrainedBody& trained, Eigen::Index modes, int samples) {
  const BodyModel model = trained.model.truncated(modes);
  Random random(7);
  double sum = 0;
  for (int s = 0; s < samples; ++s) {
    Eigen::VectorXd identity(modes);
    for (auto& number : identity) number = random.normal();
    const Vertices shape = model.rest(identity);
    double nearest = std::numeric_limits<double>::infinity();
    for (const auto& seen : trained.normalised)
      nearest = std::min(nearest, meanVertexDistance(apply(alignRigidly(seen, shape), seen), shape));
    sum += nearest;
  }
  return sum / samples;
}

/// Mean vertex distance of the best fit of identity and pose to each unseen body.
double generalisation(const BodyModel& model, const std::vector<Vertices>& unseen) {
  BodyFitOptions options;
  options.sigma = 0.001;
  options.prior = 0.1;
  double sum = 0;
  for (const auto& shape : unseen) {
    const auto fit = fitBody(model, model.meanState(), vertexTargets(shape), options);
    sum += meanVertexDistance(model.posed(fit.solution).vertices(), shape);
  }
  return sum / double(unseen.size());
}

}  // namespace

void bodyModels() {
  Report report("S-SCAPE: 80 identities learned, 40 unseen, all slightly posed");
  const auto data = bodyData();
  reportSkinning(report, data);
  std::vector<Vertices> training;
  for (const std::size_t i : data.others) training.push_back(slightlyPosed(data.reference, data.rest[i], i));
  std::vector<double> unnormalised;
  for (const auto how : {PostureNormalisation::kNone, PostureNormalisation::kSkeleton, PostureNormalisation::kLocal}) {
    BodyTrainingOptions options;
    options.posture = how;
    options.modes = 40;
    const Stopwatch watch;
    const auto trained = trainBody(data.reference, training, options);
    report.entry(text("normalisation: %s; training, CPU s", nameOf(how)), text("%.1f", watch.cpu()));
    for (std::size_t m = 0; m < kModes.size(); ++m) {
      const BodyModel model = trained->model.truncated(kModes[m]);
      const double error = generalisation(model, data.posed);
      const double held = trained->variances.head(kModes[m]).sum() / trained->variances.sum();
      const auto what = text("%s, %d modes: variance held; generalisation; specificity", nameOf(how), kModes[m]);
      const auto numbers =
          text("%.1f %%; %.2f mm; %.1f mm", 100 * held, 1000 * error, 1000 * specificity(*trained, kModes[m], 100));
      if (how == PostureNormalisation::kNone) {
        unnormalised.push_back(error);
        report.entry(what, numbers);
      } else {
        report.entry(what, numbers, text("generalisation < %.2f mm", 1000 * unnormalised[m]), error < unnormalised[m]);
      }
    }
  }
}

}  // namespace shaped::experiments
