#include "server/rpc/register_scan.h"

#include <optional>

#include "core/mesh/quality.h"
#include "core/numerics/error.h"
#include "server/convert/mesh.h"
#include "server/convert/model.h"
#include "server/convert/scan.h"
#include "server/models/kind.h"
#include "server/rpc/answer.h"

namespace shaped::server {
namespace {

constexpr std::size_t kFewestToPlace = 3;  ///< landmarks

void fill(const ServedModel& served, const BodyShapes& body, const Solved<ScanRegistration>& solved, bool with_shape,
          Call& call, v1::RegisterResponse& response) {
  const auto& found = solved.solution;
  const double ratio = solved.termination == Termination::kCancelled
                           ? 0
                           : smallestAreaRatio(body.topology().faces(), body.mean(), found.vertices);
  setAnswer(served, solved, ratio, call, response);
  if (with_shape) toProto(found.vertices, body.topology(), *response.mutable_shape());
  toProto(coefficientsOf(found.state, body.modes()), *response.mutable_coefficients());
  toProto(found.report, *response.mutable_scan_report());
  if (found.field) toProto(found.field->report, *response.mutable_field_report());
  response.set_took_runner_up(found.took_runner_up);
  response.set_flipped_normals(found.flipped_normals);
  response.set_suspected_unit_factor(found.suspected_unit_factor.value_or(0));
  response.set_score(found.score);
  response.mutable_warnings()->Add(found.warnings.begin(), found.warnings.end());
  if (found.refinement) toProto(*found.refinement, *response.mutable_refinement());
}

/// As the request wants it of this model: with its field, if it has one, unless that is to be left aside.
ScanRegistrationOptions optionsFor(const BodyShapes& body, const v1::RegistrationOptions& message, const Call& call) {
  auto options = registrationOptionsFromProto(message, call.stopToken());
  if (!message.without_field()) options.field = body.field(call.stopToken());
  return options;
}

/// Registers from nothing; says how sure the placement is where the scan alone told it.
void registerAnew(const ServedModel& served, const BodyShapes& body, const Scan& scan,
                  const std::vector<Landmark>& landmarks, const ScanRegistrationOptions& options, bool with_shape,
                  Call& call, v1::RegisterResponse& response, std::optional<ScanRegistration>* kept) {
  auto solved = registerScan(scan, *body.model(), landmarks, options);
  fill(served, body, solved, with_shape, call, response);
  if (landmarks.size() < kFewestToPlace) response.set_start_margin(solved.solution.start_margin);
  if (kept) *kept = std::move(solved.solution);
}

class ScanStream final : public StreamHandler<v1::RegisterSequenceRequest, v1::RegisterResponse> {
 public:
  ScanStream(ModelStore& store, const Limits& limits) : store_(store), limits_(limits) {}

  bool message(const v1::RegisterSequenceRequest& request, v1::RegisterResponse& response, Call& call) override {
    if (request.has_setup()) {
      begin(request.setup(), call);
      return false;
    }
    if (!request.has_frame()) throw InvalidInput("part", "is neither setup nor frame");
    if (!served_) throw InvalidInput("setup", "is missing: the first message must be it");
    answer(request.frame(), response, call);
    return true;
  }

  bool end(v1::RegisterResponse&, Call&) override {
    if (!served_) throw InvalidInput("setup", "is missing: the stream was empty");
    return false;
  }

 private:
  void begin(const v1::RegisterSequenceRequest::Setup& setup, Call& call) {
    if (served_) throw InvalidInput("setup", "came a second time");
    auto served = pinModel(store_, setup, call);
    options_ = optionsFor(bodyFor("Registration.RegisterSequence", *served), setup.options(), call);
    with_shapes_ = !setup.options().without_shapes();
    served_ = std::move(served);
  }

  void answer(const v1::RegisterSequenceRequest::Frame& frame, v1::RegisterResponse& response, Call& call) {
    const auto& body = bodyFor("Registration.RegisterSequence", *served_);
    const auto scan = scanFromProto(frame.scan(), limits_);
    const auto landmarks = landmarksFromProto(frame.landmarks(), body.topology(), options_.unit_factor, limits_);
    response.set_frame(frame.frame());
    if (!last_ || lost_) {
      registerAnew(*served_, body, scan, landmarks, options_, with_shapes_, call, response, &last_);
    } else {
      auto solved = registerScanFrom(scan, *body.model(), last_->state, landmarks, options_);
      fill(*served_, body, solved, with_shapes_, call, response);
      last_ = std::move(solved.solution);
    }
    lost_ = last_->score < options_.least_score || response.report().termination() == v1::TERMINATION_STALLED;
  }

  ModelStore& store_;
  const Limits& limits_;
  ServedModelPtr served_;
  ScanRegistrationOptions options_;
  bool with_shapes_ = true;
  std::optional<ScanRegistration> last_;  ///< what the next scan starts from
  bool lost_ = false;                     ///< that is doubtful
};

}  // namespace

void registerOne(ModelStore& store, const Limits& limits, const v1::RegisterRequest& request,
                 v1::RegisterResponse& response, Call& call) {
  const auto served = pinModel(store, request, call);
  const auto& body = bodyFor("Registration.Register", *served);
  const auto options = optionsFor(body, request.options(), call);
  const auto scan = scanFromProto(request.scan(), limits);
  const auto landmarks = landmarksFromProto(request.landmarks(), body.topology(), options.unit_factor, limits);
  registerAnew(*served, body, scan, landmarks, options, !request.options().without_shapes(), call, response, nullptr);
}

std::unique_ptr<StreamHandler<v1::RegisterSequenceRequest, v1::RegisterResponse>> makeScanStream(ModelStore& store,
                                                                                                 const Limits& limits) {
  return std::make_unique<ScanStream>(store, limits);
}

}  // namespace shaped::server
