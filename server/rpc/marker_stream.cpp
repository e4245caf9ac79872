#include "server/rpc/marker_stream.h"

#include <optional>

#include "core/numerics/error.h"
#include "server/rpc/answer.h"
#include "server/rpc/marker_session.h"

namespace shaped::server {
namespace {

class MarkerStream final : public StreamHandler<v1::FitMarkersRequest, v1::FitMarkersResponse> {
 public:
  MarkerStream(ModelStore& store, const Limits& limits) : store_(store), limits_(limits) {}

  bool message(const v1::FitMarkersRequest& request, v1::FitMarkersResponse& response, Call& call) override {
    if (request.has_setup()) {
      if (session_) throw InvalidInput("setup", "came a second time");
      session_.emplace(pinModel(store_, request.setup(), call), request.setup(), limits_, call.stopToken());
      return false;
    }
    if (!request.has_frame()) throw InvalidInput("part", "is neither setup nor frame");
    if (!session_) throw InvalidInput("setup", "is missing: the first message must be it");
    const auto solved = session_->fit(request.frame(), response);
    setAnswer(session_->served(), solved, solved.solution.smallest_area_ratio, call, response);
    return true;
  }

  bool end(v1::FitMarkersResponse&, Call&) override {
    if (!session_) throw InvalidInput("setup", "is missing: the stream was empty");
    return false;
  }

 private:
  ModelStore& store_;
  const Limits& limits_;
  std::optional<MarkerSession> session_;
};

}  // namespace

std::unique_ptr<StreamHandler<v1::FitMarkersRequest, v1::FitMarkersResponse>> makeMarkerStream(ModelStore& store,
                                                                                               const Limits& limits) {
  return std::make_unique<MarkerStream>(store, limits);
}

}  // namespace shaped::server
