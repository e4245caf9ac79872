#include "core/bootstrap/bootstrap_options.h"

#include <cmath>

#include "core/numerics/option_checks.h"

namespace shaped {

std::optional<std::string> BootstrapOptions::firstViolation() const {
  const auto atLeast = [](const char* field, int value, int least) -> std::optional<std::string> {
    if (value >= least) return std::nullopt;
    return std::string(field) + " = " + std::to_string(value) + ", want >= " + std::to_string(least);
  };
  if (auto problem = atLeast("rounds", rounds, 1)) return problem;
  if (auto problem = atLeast("modes", modes, 1)) return problem;
  if (auto problem = atLeast("least_joined", least_joined, 1)) return problem;
  if (auto problem = atLeast("sample", sample, 0)) return problem;
  if (!(acceptance >= 0) || !std::isfinite(acceptance))
    return "acceptance = " + std::to_string(acceptance) + ", want >= 0";
  if (auto problem = unlessPositive("reach", reach)) return problem;
  if (const auto problem = registration.firstViolation()) return "registration." + *problem;
  if (const auto problem = scanner.firstViolation()) return "scanner." + *problem;
  return std::nullopt;
}

}  // namespace shaped
