#pragma once

#include <cstdint>
#include <string>

#include "client/load/generator.h"

namespace shaped::shapectl {

/// What a measured call is made of, beside its method.
struct BenchInputs {
  std::string model;         ///< NAME, NAME@VERSION or NAME@LABEL; empty: none
  std::string mesh;          ///< file of a shape of the model; empty: the model's own mean
  std::int64_t frames = 30;  ///< of a stream
  std::int64_t path_steps = 0;
  std::int64_t modes = 0;
};

/// "limits, health, ...", for the help.
std::string benchMethods();

/// The call of that name, with inputs taken from the model itself: its mean, points of it, a shape of its own.
/// Asks the daemon for what it needs. Throws InvalidInput when there is no such method or an input is missing or wrong,
/// client::RpcError when the daemon refuses.
client::LoadCall makeBenchCall(const std::string& method, const BenchInputs& inputs,
                               const std::shared_ptr<grpc::Channel>& channel, const client::CallOptions& options);

}  // namespace shaped::shapectl
