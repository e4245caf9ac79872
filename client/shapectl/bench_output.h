#pragma once

#include <nlohmann/json.hpp>
#include <string>

#include "client/load/account.h"

namespace shaped::shapectl {

/// Everything that was counted; times in seconds.
nlohmann::json toJson(const client::LoadAccount& account);
/// The same as a table for the terminal; times in milliseconds.
std::string benchText(const client::LoadAccount& account);

}  // namespace shaped::shapectl
