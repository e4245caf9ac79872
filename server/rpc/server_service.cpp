#include "server/rpc/server_service.h"

#include "server/rpc/unary_call.h"

namespace shaped::server {
namespace {

void toProto(const Limits& limits, v1::Limits& message) {
  const auto number = [](std::int64_t value) { return static_cast<std::uint64_t>(value); };
  message.set_vertices(number(limits.vertices));
  message.set_faces(number(limits.faces));
  message.set_frames(number(limits.frames));
  message.set_message_bytes(number(limits.message_bytes));
  message.set_coefficients(number(limits.coefficients));
  message.set_handles(number(limits.handles));
  message.set_markers(number(limits.markers));
  message.set_calibration_frames(number(limits.calibration_frames));
  message.set_path_steps(number(limits.path_steps));
  message.set_times(number(limits.times));
  message.set_job_bytes(number(limits.job_bytes));
  message.set_curve_bytes(number(limits.curve_bytes));
  message.set_clothing_frames(number(limits.clothing_frames));
  message.set_clothing_bytes(number(limits.clothing_bytes));
  message.set_upload_bytes(number(limits.upload_bytes));
}

}  // namespace

grpc::ServerUnaryReactor* ServerService::GetLimits(grpc::CallbackServerContext* context,
                                                   const v1::GetLimitsRequest* request,
                                                   v1::GetLimitsResponse* response) {
  return startUnary<v1::GetLimitsRequest, v1::GetLimitsResponse>(
      runtime_, runtime_.light, "Server.GetLimits", context, request, response,
      [this](const auto&, auto& answer, Call&) {
        answer.set_version(version_);
        toProto(limits_, *answer.mutable_limits());
        answer.mutable_limits()->set_call_seconds(runtime_.longest_call.load().count());
      });
}

}  // namespace shaped::server
