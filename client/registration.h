#pragma once

#include <functional>
#include <vector>

#include "client/connection.h"
#include "core/mesh/scan.h"
#include "shaped/v1/registration.grpc.pb.h"

namespace shaped::client {

/// Positions, normals and faces as they travel, rounded to float, in the scan's own unit.
v1::Scan pack(const Scan& scan);

/// Throws RpcError when the daemon refuses or the call is aborted.
v1::RegisterResponse registerScan(const std::shared_ptr<grpc::Channel>& channel, const v1::RegisterRequest& request,
                                  const CallOptions& options);

/// Streams `count` frames, made one after the other by `frame`, and hears an answer for each, in order, while later
/// ones are still being sent. Throws RpcError when the daemon refuses or the call is aborted, and whatever `frame` and
/// `answer` throw.
void registerSequence(const std::shared_ptr<grpc::Channel>& channel, const v1::RegisterSequenceRequest::Setup& setup,
                      std::int64_t count,
                      const std::function<v1::RegisterSequenceRequest::Frame(std::int64_t index)>& frame,
                      const CallOptions& options, const std::function<void(const v1::RegisterResponse&)>& answer);

/// Streams `count` frames, made one after the other by `frame`; once all have been sent and worked on together, hears
/// the body and then an answer for each, in order. Throws as registerSequence().
void estimateUnderClothing(const std::shared_ptr<grpc::Channel>& channel,
                           const v1::EstimateUnderClothingRequest::Setup& setup, std::int64_t count,
                           const std::function<v1::EstimateUnderClothingRequest::Frame(std::int64_t index)>& frame,
                           const CallOptions& options,
                           const std::function<void(const v1::EstimateUnderClothingResponse&)>& answer);

}  // namespace shaped::client
