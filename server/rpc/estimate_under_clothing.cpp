#include "server/rpc/estimate_under_clothing.h"

#include <optional>

#include "core/mesh/quality.h"
#include "core/numerics/error.h"
#include "core/registration/scan_checks.h"
#include "server/convert/clothing.h"
#include "server/convert/mesh.h"
#include "server/convert/model.h"
#include "server/convert/scan.h"
#include "server/jobs/arena.h"
#include "server/models/kind.h"
#include "server/rpc/answer.h"

namespace shaped::server {
namespace {

constexpr auto kMethod = "Registration.EstimateUnderClothing";

using Request = v1::EstimateUnderClothingRequest;
using Response = v1::EstimateUnderClothingResponse;

class ClothedStream final : public StreamHandler<Request, Response> {
 public:
  ClothedStream(ModelStore& store, const Limits& limits, int threads)
      : store_(store), limits_(limits), threads_(threads) {}

  bool message(const Request& request, Response&, Call& call) override {
    if (request.has_setup())
      begin(request.setup(), call);
    else if (request.has_frame())
      append(request.frame());
    else
      throw InvalidInput("part", "is neither setup nor frame");
    return false;
  }

  bool end(Response& response, Call& call) override {
    if (!served_) throw InvalidInput("setup", "is missing: the stream was empty");
    if (numbers_.empty()) throw InvalidInput("frames", "are missing: want one scan or more after the setup");
    if (!found_) {
      estimate(call);
      fill(call, *response.mutable_body());
      return true;
    }
    if (answered_ == found_->solution.frames.size()) return false;
    fill(answered_++, *response.mutable_frame());
    return true;
  }

 private:
  const BodyShapes& body() const { return bodyFor(kMethod, *served_); }

  void begin(const Request::Setup& setup, Call& call) {
    if (served_) throw InvalidInput("setup", "came a second time");
    auto served = pinModel(store_, setup, call);
    const auto& body = bodyFor(kMethod, *served);
    options_ = clothingOptionsFromProto(setup.options(), call.stopToken());
    extent_ = robustExtent(body.mean());
    with_shapes_ = !setup.options().without_shapes();
    served_ = std::move(served);
  }

  /// Checks the scan as it comes, so that its sender learns at once what is wrong with it.
  void append(const Request::Frame& frame) {
    if (!served_) throw InvalidInput("setup", "is missing: the first message must be it");
    const auto field = "frames[" + std::to_string(numbers_.size()) + "]";
    requireClothingFits(std::ssize(numbers_) + 1, bytes_ + scanBytes(frame.scan()), limits_, field);
    auto scan = scanFromProto(frame.scan(), limits_, field + ".scan");
    requireUsableScan(scan, field + ".scan");
    const double unit_factor = options_.registration.unit_factor;
    auto landmarks =
        landmarksFromProto(frame.landmarks(), body().topology(), unit_factor, limits_, field + ".landmarks");
    scan.points *= unit_factor;
    suspected_.push_back(suspectedUnitFactor(scan, extent_));
    bytes_ += scanBytes(scan);
    scans_.push_back(std::move(scan));
    landmarks_.push_back(std::move(landmarks));
    numbers_.push_back(frame.frame());
  }

  void estimate(Call& call) {
    Solved<ClothedBody> found;
    runInBackground(threads_, [&] { found = estimateUnderClothing(scans_, *body().model(), landmarks_, options_); });
    if (found.termination == Termination::kCancelled) throw Stopped();
    call.throwIfStopped();
    found_ = std::move(found);
    best_explained_ = bestExplained(found_->solution);
    scans_ = {};  // the answers need them no more
    landmarks_ = {};
  }

  void fill(Call& call, Response::Body& message) const {
    const auto& model = *body().model();
    const BodyState state{found_->solution.identity, restPose(model.skeleton())};
    const Vertices rest = model.rest(state.identity);
    setAnswer(*served_, *found_, smallestAreaRatio(body().topology().faces(), body().mean(), rest), call, message);
    toProto(coefficientsOf(state, body().modes()), *message.mutable_coefficients());
    if (with_shapes_) toProto(rest, body().topology(), *message.mutable_rest());
    for (const auto& warning : warningsOf(found_->solution)) message.add_warnings(warning);
  }

  void fill(std::size_t index, Response::Frame& message) const {
    const auto& frame = found_->solution.frames[index];
    const BodyState state{found_->solution.identity, frame.pose};
    const Vertices surface = body().model()->posed(state).vertices();
    message.set_frame(numbers_[index]);
    toProto(frame.outcome, 0, *message.mutable_report());
    message.set_smallest_area_ratio(smallestAreaRatio(body().topology().faces(), body().mean(), surface));
    toProto(coefficientsOf(state, body().modes()), *message.mutable_coefficients());
    if (with_shapes_) toProto(surface, body().topology(), *message.mutable_shape());
    toProto(frame, best_explained_, message);
    if (suspected_[index]) message.add_warnings(unitWarning(*suspected_[index]));
  }

  static std::string unitWarning(double factor) {
    return "the scan is about " + std::to_string(1 / factor) +
           " times the model's size: its unit may be another; nothing was scaled";
  }

  ModelStore& store_;
  const Limits& limits_;
  const int threads_;
  ServedModelPtr served_;
  ClothingOptions options_;
  double extent_ = 0;  ///< of the model [m]
  bool with_shapes_ = true;
  std::vector<std::uint32_t> numbers_;  ///< of the frames, as the client has them
  std::vector<Scan> scans_;             ///< until they have been worked on
  std::vector<std::vector<Landmark>> landmarks_;
  std::vector<std::optional<double>> suspected_;  ///< unit factors
  std::int64_t bytes_ = 0;                        ///< of the scans
  std::optional<Solved<ClothedBody>> found_;
  double best_explained_ = 0;
  std::size_t answered_ = 0;  ///< frames
};

}  // namespace

std::unique_ptr<StreamHandler<Request, Response>> makeClothedStream(ModelStore& store, const Limits& limits,
                                                                    int threads) {
  return std::make_unique<ClothedStream>(store, limits, threads);
}

}  // namespace shaped::server
