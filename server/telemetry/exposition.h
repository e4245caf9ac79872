#pragma once

#include <string>

#include "server/telemetry/statistics.h"

namespace shaped::server {

/// The snapshot in Prometheus' text format, version 0.0.4. docs/operations.md lists every metric.
std::string exposition(const Statistics& statistics);

}  // namespace shaped::server
