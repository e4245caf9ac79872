#pragma once

#include <atomic>

#include "server/telemetry/http_message.h"
#include "server/telemetry/metrics.h"

namespace shaped::server {

/// Answers /metrics (Prometheus' text), /healthz (200 while the process lives) and /readyz (200 while `ready`, else
/// 503). Both arguments outlive the handler.
HttpHandler scrapeHandler(const Metrics& metrics, const std::atomic<bool>& ready);

}  // namespace shaped::server
