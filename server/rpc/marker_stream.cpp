#include "server/rpc/marker_stream.h"

#include <optional>
#include <utility>

#include "core/model/marker_fitter.h"
#include "core/numerics/error.h"
#include "server/convert/marker.h"
#include "server/convert/mesh.h"
#include "server/convert/model.h"
#include "server/rpc/answer.h"

namespace shaped::server {
namespace {

class MarkerStream final : public StreamHandler<v1::FitMarkersRequest, v1::FitMarkersResponse> {
 public:
  MarkerStream(ModelStore& store, const Limits& limits) : store_(store), limits_(limits) {}

  bool message(const v1::FitMarkersRequest& request, v1::FitMarkersResponse& response, Call& call) override {
    if (request.has_setup()) {
      setUp(request.setup(), call);
      return false;
    }
    if (!request.has_frame()) throw InvalidInput("part", "is neither setup nor frame");
    if (!fitter_) throw InvalidInput("setup", "is missing: the first message must be it");
    fit(request.frame(), response, call);
    return true;
  }

  void end(v1::FitMarkersResponse&, Call&) override {
    if (!fitter_) throw InvalidInput("setup", "is missing: the stream was empty");
  }

 private:
  void setUp(const v1::FitMarkersRequest::Setup& setup, Call& call) {
    if (fitter_) throw InvalidInput("setup", "came a second time");
    served_ = pinModel(store_, setup, call);
    const auto& model = *served_->shell_pga;
    requireAtMost(setup.marker_set().markers_size(), limits_.markers, "setup.marker_set", "markers");
    const auto markers = markerSetFromProto(setup.marker_set(), setup.labels());
    MarkerTrackerOptions options;
    if (setup.prior_weight() != 0) options.prior_weight = setup.prior_weight();
    if (setup.has_robust_scale()) options.robust_scale = setup.robust_scale();
    if (setup.scale() != 0) options.scale = setup.scale();
    options.submanifold.modes = countFromProto(setup.modes(), model.modes(), "setup.modes");
    options.submanifold.stop = call.stopToken();
    marker_count_ = std::ssize(markers.markers);
    with_shapes_ = !setup.without_shapes();
    fitter_.emplace(served_->shell_pga, markers, options);
    takeCalibration(setup);
  }

  void takeCalibration(const v1::FitMarkersRequest::Setup& setup) {
    requireAtMost(setup.calibration_size(), limits_.calibration_frames, "setup.calibration", "frames");
    for (int i = 0; i < setup.calibration_size(); ++i)
      calibration_.push_back(
          markersFromProto(setup.calibration(i), marker_count_, "setup.calibration[" + std::to_string(i) + "]"));
  }

  void fit(const v1::MarkerFrame& frame, v1::FitMarkersResponse& response, Call& call) {
    const auto markers = markersFromProto(frame, marker_count_);
    // part of the first frame, whose answer reports its time and iterations
    const Outcome calibrated = fitter_->calibrate(std::exchange(calibration_, {}));
    if (calibrated.termination == Termination::kCancelled) throw Stopped();
    auto solved = fitter_->fit(markers);
    solved.iterations += calibrated.iterations;
    const auto& fitted = solved.solution;
    setAnswer(*served_, solved, fitted.smallest_area_ratio, call, response);
    response.set_frame(frame.frame());
    if (with_shapes_) toProto(fitted.shape, served_->shell_pga->topology(), *response.mutable_shape());
    toProto(fitted.fit.point, *response.mutable_coefficients());
    response.mutable_residuals()->Add(fitted.fit.residuals.begin(), fitted.fit.residuals.end());
    response.set_rms(fitted.fit.rms);
    response.set_scale(fitted.fit.scale);
    response.set_held(fitted.fit.held);
  }

  ModelStore& store_;
  const Limits& limits_;
  ServedModelPtr served_;
  std::optional<MarkerFitter> fitter_;
  std::vector<MarkerPositions> calibration_;  ///< frames that are still to tell the subject's size
  Eigen::Index marker_count_ = 0;
  bool with_shapes_ = true;
};

}  // namespace

std::unique_ptr<StreamHandler<v1::FitMarkersRequest, v1::FitMarkersResponse>> makeMarkerStream(ModelStore& store,
                                                                                               const Limits& limits) {
  return std::make_unique<MarkerStream>(store, limits);
}

}  // namespace shaped::server
