#include "server/rpc/marker_session.h"

#include <utility>

#include "core/numerics/error.h"
#include "server/convert/marker.h"
#include "server/convert/mesh.h"
#include "server/convert/model.h"
#include "server/errors/errors.h"

namespace shaped::server {
namespace {

TakeOptions optionsFrom(const v1::FitMarkersRequest::Setup& setup, const ShapeModel& model, std::stop_token stop) {
  TakeOptions options;
  if (setup.prior_weight() != 0) options.prior_weight = setup.prior_weight();
  if (setup.has_robust_scale()) options.robust_scale = setup.robust_scale();
  if (setup.scale() != 0) options.scale = setup.scale();
  options.modes = countFromProto(setup.modes(), model.modes(), "setup.modes");
  options.stop = std::move(stop);
  return options;
}

MarkerSet markersIn(const v1::FitMarkersRequest::Setup& setup, const Limits& limits) {
  requireAtMost(setup.marker_set().markers_size(), limits.markers, "setup.marker_set", "markers");
  return markerSetFromProto(setup.marker_set(), setup.labels());
}

}  // namespace

MarkerSession::MarkerSession(ServedModelPtr served, const v1::FitMarkersRequest::Setup& setup, const Limits& limits,
                             std::stop_token stop)
    : served_(std::move(served)),
      marker_count_(std::ssize(markersIn(setup, limits).markers)),
      with_shapes_(!setup.without_shapes()),
      fitter_(served_->shapes->takeFitter(markersIn(setup, limits),
                                          optionsFrom(setup, *served_->shapes, std::move(stop)))) {
  requireAtMost(setup.calibration_size(), limits.calibration_frames, "setup.calibration", "frames");
  for (int i = 0; i < setup.calibration_size(); ++i)
    calibration_.push_back(
        markersFromProto(setup.calibration(i), marker_count_, "setup.calibration[" + std::to_string(i) + "]"));
}

MarkerPositions MarkerSession::positionsIn(const v1::MarkerFrame& frame) const {
  return markersFromProto(frame, marker_count_);
}

Solved<TakeFrame> MarkerSession::fit(const v1::MarkerFrame& frame, v1::FitMarkersResponse& response) {
  const auto markers = positionsIn(frame);
  const Outcome calibrated = fitter_->calibrate(std::exchange(calibration_, {}));
  if (calibrated.termination == Termination::kCancelled) throw Stopped();
  auto solved = fitter_->fit(markers);
  solved.iterations += calibrated.iterations;
  const auto& fitted = solved.solution;
  response.set_frame(frame.frame());
  if (with_shapes_) toProto(fitted.shape, served_->shapes->topology(), *response.mutable_shape());
  toProto(fitted.point, *response.mutable_coefficients());
  response.mutable_residuals()->Add(fitted.residuals.begin(), fitted.residuals.end());
  response.set_rms(fitted.rms);
  response.set_scale(fitted.scale);
  response.set_held(fitted.held);
  return solved;
}

std::int64_t MarkerSession::resume(const std::filesystem::path& path) {
  const auto frames = fitter_->resume(path);
  if (frames > 0) calibration_.clear();  // which belongs to the first frame
  return frames;
}

}  // namespace shaped::server
