#include "core/model/marker_fitter.h"

#include "core/mesh/quality.h"

namespace shaped {

MarkerFitter::MarkerFitter(ShellPgaModelPtr model, const MarkerSet& markers, const MarkerTrackerOptions& options)
    : model_(std::move(model)), tracker_(model_->submanifoldPtr(), model_->sitesOf(markers), options) {}

Solved<FittedFrame> MarkerFitter::fit(const MarkerPositions& markers) {
  auto tracked = tracker_.fit(markers);
  FittedFrame frame;
  const Vertices unscaled = model_->prolongate(tracked.solution.shape / tracked.solution.scale);
  frame.smallest_area_ratio = smallestAreaRatio(model_->topology().faces(), model_->mean(), unscaled);
  frame.shape = tracked.solution.scale * unscaled;
  frame.fit = std::move(tracked.solution);
  return {std::move(frame), tracked};
}

}  // namespace shaped
