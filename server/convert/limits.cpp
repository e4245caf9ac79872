#include "server/convert/limits.h"

#include "core/numerics/error.h"

namespace shaped::server {

void requireAtMost(std::int64_t count, std::int64_t most, const std::string& field, const std::string& of) {
  if (count > most)
    throw InvalidInput(field, "has " + std::to_string(count) + " " + of + ", want at most " + std::to_string(most) +
                                  ", the server's limit (Server.GetLimits)");
}

}  // namespace shaped::server
