#pragma once

#include <memory>
#include <stop_token>
#include <vector>

#include "core/model/take_fitter.h"
#include "server/convert/limits.h"
#include "server/models/model_store.h"
#include "shaped/v1/shapes.pb.h"

namespace shaped::server {

/// One take of markers as its setup describes it: a fitter that goes from frame to frame.
class MarkerSession {
 public:
  /// Throws InvalidInput naming setup's field.
  MarkerSession(ServedModelPtr served, const v1::FitMarkersRequest::Setup& setup, const Limits& limits,
                std::stop_token stop);

  const ServedModel& served() const { return *served_; }
  Eigen::Index markerCount() const { return marker_count_; }
  /// L x 3. Throws InvalidInput naming the frame's field.
  MarkerPositions positionsIn(const v1::MarkerFrame& frame) const;

  /// Fits the next frame; the first answer reports the calibration's iterations too. Fills what is particular to the
  /// frame into the response. Throws Stopped when the token fired during the calibration; InvalidInput naming the
  /// frame's field, or setup.calibration.
  Solved<TakeFrame> fit(const v1::MarkerFrame& frame, v1::FitMarkersResponse& response);

  /// As TakeFitter::state.
  TakeFitter::Keep state() const { return fitter_->state(); }
  /// Goes on behind the frames that a session of the same setup has fitted, and returns their number:
  /// TakeFitter::resume.
  std::int64_t resume(const std::filesystem::path& path);

 private:
  const ServedModelPtr served_;
  const Eigen::Index marker_count_;
  const bool with_shapes_;
  const std::unique_ptr<TakeFitter> fitter_;
  std::vector<MarkerPositions> calibration_;  ///< frames that are still to tell the subject's size
};

}  // namespace shaped::server
