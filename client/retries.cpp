#include "client/retries.h"

#include <nlohmann/json.hpp>

namespace shaped::client {
namespace {

// Largest request that is kept [bytes]; what exceeds it is sent once.
constexpr int kKept = 256 << 20;

/// Calls whose repetition does no harm. Not among them: uploads and Train, Load, SetLabel, Delete and their like, and
/// the two-way stream, whose answers depend on each other.
nlohmann::json idempotentCalls() {
  const auto name = [](const char* service, const char* method) {
    return nlohmann::json{{"service", service}, {"method", method}};
  };
  nlohmann::json names = nlohmann::json::array();
  for (const auto* method : {"List", "Get", "WaitUntilReady"}) names.push_back(name("shaped.v1.Models", method));
  for (const auto* method : {"Project", "Synthesize", "Interpolate", "Edit", "Score", "Evaluate"})
    names.push_back(name("shaped.v1.Shapes", method));
  names.push_back(name("shaped.v1.Registration", "Register"));
  for (const auto* method : {"Get", "List", "Wait"}) names.push_back(name("shaped.v1.Jobs", method));
  names.push_back(name("shaped.v1.Datasets", "List"));
  names.push_back(name("shaped.v1.Server", "GetLimits"));
  return names;
}

}  // namespace

std::string serviceConfig(bool balanced) {
  using nlohmann::json;
  // A balancer that was stopped from below in the middle of a call may say that it was cancelled. Nobody here did: what
  // a client cancels itself is not repeated.
  const auto codes = balanced ? json::array({"UNAVAILABLE"}) : json::array({"UNAVAILABLE", "CANCELLED"});
  const json retries{{"maxAttempts", 4},
                     {"initialBackoff", "0.1s"},
                     {"maxBackoff", "1s"},
                     {"backoffMultiplier", 2},
                     {"retryableStatusCodes", codes}};
  json config{{"methodConfig", json::array({json{{"name", idempotentCalls()}, {"retryPolicy", retries}}})}};
  if (balanced) {
    config["loadBalancingConfig"] = json::array({json{{"round_robin", json::object()}}});
    config["healthCheckConfig"] = json{{"serviceName", ""}};
  }
  return config.dump();
}

void retryIdempotentCalls(grpc::ChannelArguments& arguments, bool balanced) {
  arguments.SetServiceConfigJSON(serviceConfig(balanced));
  arguments.SetInt(GRPC_ARG_PER_RPC_RETRY_BUFFER_SIZE, kKept);
}

}  // namespace shaped::client
