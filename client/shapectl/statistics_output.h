#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "shaped/v1/admin.pb.h"

namespace shaped::shapectl {

/// All of it, in the units of admin.proto.
nlohmann::json toJson(const v1::GetStatisticsResponse& statistics);

/// A screen for people, line by line. before: an earlier snapshot, which the rates are taken against; null: the rates
/// of the last minute, and the processor time since the start. Methods that were never called are left out.
std::vector<std::string> screenOf(const v1::GetStatisticsResponse& now, const v1::GetStatisticsResponse* before,
                                  const std::string& server);

}  // namespace shaped::shapectl
