#include "core/registration/pose_refit.h"

#include <utility>

namespace shaped {

PosedBody refitPose(const BodyModel& model, const Vertices& rest, const Pose& near, const ScanSurface& scan,
                    const ModelFitOptions& options, PoseRefit how) {
  BodyParts parts = model.parts();
  parts.modes = parts.modes.leftCols(1).eval();
  parts.deviations = parts.deviations.head(1).eval();
  parts.mean = rest;
  BodyModel body(std::move(parts));
  ModelFitOptions fit = options;
  fit.identity = false;
  const std::size_t kept = how == PoseRefit::kFine ? 1 : 2;
  while (fit.levels.size() > kept) fit.levels.erase(fit.levels.begin());
  if (how == PoseRefit::kRough && fit.levels.size() > 1) fit.levels.pop_back();
  auto state = fitStateToScan(scan, body, {Eigen::VectorXd::Zero(1), near}, {}, fit).solution;
  return {std::move(body), std::move(state)};
}

}  // namespace shaped
