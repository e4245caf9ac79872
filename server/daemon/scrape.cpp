#include "server/daemon/scrape.h"

#include "server/telemetry/exposition.h"

namespace shaped::server {
namespace {

HttpResponse plain(int status, const std::string& text) { return {.status = status, .body = text + "\n"}; }

}  // namespace

HttpHandler scrapeHandler(const Metrics& metrics, const std::atomic<bool>& ready) {
  return [&](const HttpRequest& request) -> HttpResponse {
    if (request.path == "/metrics")
      return {200, "text/plain; version=0.0.4; charset=utf-8", exposition(metrics.snapshot())};
    if (request.path == "/healthz") return plain(200, "alive");
    if (request.path == "/readyz") return ready ? plain(200, "ready") : plain(503, "starting or stopping");
    return plain(404, "there are /metrics, /healthz and /readyz");
  };
}

}  // namespace shaped::server
