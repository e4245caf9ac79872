#include "server/telemetry/metrics.h"

#include <catch2/catch.hpp>
#include <thread>

#include "server/telemetry/exposition.h"

using namespace shaped;
using namespace shaped::server;
using Catch::Contains;

namespace {

Surroundings surroundings() {
  Surroundings around;
  around.pools.push_back({"solver", {.workers = 4, .busy = 3, .queue_length = 7, .bytes_in_flight = 100}, {}});
  around.models.push_back({"a\"b\\c\nd", 2, 12345});
  around.jobs = {{"failed", 1}, {"running", 2}};
  return around;
}

}  // namespace

TEST_CASE("a histogram counts a value in the bucket whose upper end it does not exceed") {
  Histogram histogram(std::array{1., 2., 5.});
  for (const double value : {0.5, 1.0, 1.5, 2.0, 5.0, 6.0}) histogram.observe(value);
  CHECK(histogram.counts() == std::vector<std::uint64_t>{2, 2, 1, 1});
  CHECK(histogram.count() == 6);
  CHECK(histogram.sum() == Approx(16));
}

TEST_CASE("a method's counts follow its calls") {
  MethodMetrics method("Shapes.Edit");
  for (int i = 0; i < 3; ++i) method.began();
  method.ended({"OK", 0.2, 0.05, 0.1});
  method.ended({"CANCELLED", 2, 1.5, 0});
  method.solved({Termination::kConverged, 7, 0});
  method.solved({Termination::kStalled, 30, 0});
  method.solved({Termination::kCancelled, 1000, 0});
  const auto seen = method.snapshot();
  CHECK(seen.name == "Shapes.Edit");
  CHECK(seen.in_flight == 1);
  CHECK(seen.by_code == std::map<std::string, std::uint64_t>{{"OK", 1}, {"CANCELLED", 1}});
  CHECK(seen.request.total.sum() == Approx(2.2));
  CHECK(seen.queue.total.sum() == Approx(1.55));
  CHECK(seen.compute.total.sum() == Approx(0.1));
  CHECK(seen.request.recent.quantile(1) == Approx(2).epsilon(0.03));
  CHECK(seen.iterations.count() == 2);
  CHECK(seen.iterations.sum() == 37);
  CHECK(seen.unconverged == std::map<Termination, std::uint64_t>{{Termination::kStalled, 1}});
}

TEST_CASE("counts from many threads are all there") {
  Metrics metrics(surroundings);
  std::vector<std::thread> threads;
  for (int t = 0; t < 4; ++t)
    threads.emplace_back([&] {
      for (int i = 0; i < 5000; ++i) {
        auto& method = metrics.method(i % 2 == 0 ? "A.X" : "A.Y");
        method.began();
        metrics.refused(RefusalCause::kOpenStreams);
        method.ended({"OK", 1e-3, 0, 1e-3});
        if (i % 1000 == 0) metrics.snapshot();
      }
    });
  for (auto& thread : threads) thread.join();
  const auto seen = metrics.snapshot();
  REQUIRE(seen.methods.size() == 2);
  for (const auto& method : seen.methods) {
    CHECK(method.by_code.at("OK") == 10000);
    CHECK(method.request.total.count() == 10000);
    CHECK(method.in_flight == 0);
  }
  CHECK(seen.refusals.at(RefusalCause::kOpenStreams) == 20000);
  CHECK(seen.refusals.at(RefusalCause::kMemory) == 0);
}

TEST_CASE("the exposition says what was counted, in Prometheus' format") {
  Metrics metrics(surroundings);
  auto& method = metrics.method("Shapes.Project");
  method.began();
  method.began();
  method.ended({"OK", 0.3, 0.0002, 0.25});
  method.solved({Termination::kIterationLimit, 40, 0});
  metrics.refused(RefusalCause::kQueueLength);
  metrics.declareJobs("evaluate", "failed");
  metrics.jobEnded("evaluate", "succeeded");
  metrics.jobEnded("evaluate", "succeeded");
  const auto text = exposition(metrics.snapshot());
  CHECK_THAT(text, Catch::Contains("shaped_jobs_ended_total{kind=\"evaluate\",state=\"failed\"} 0"));
  CHECK_THAT(text, Catch::Contains("shaped_jobs_ended_total{kind=\"evaluate\",state=\"succeeded\"} 2"));
  for (const std::string line : {
           "# TYPE shaped_requests_total counter",
           "shaped_requests_total{method=\"Shapes.Project\",code=\"OK\"} 1",
           "shaped_requests_in_flight{method=\"Shapes.Project\"} 1",
           "# TYPE shaped_request_seconds histogram",
           "shaped_request_seconds_bucket{method=\"Shapes.Project\",le=\"0.25\"} 0",
           "shaped_request_seconds_bucket{method=\"Shapes.Project\",le=\"0.5\"} 1",
           "shaped_request_seconds_bucket{method=\"Shapes.Project\",le=\"+Inf\"} 1",
           "shaped_request_seconds_count{method=\"Shapes.Project\"} 1",
           "shaped_queue_seconds_bucket{method=\"Shapes.Project\",le=\"0.0001\"} 0",
           "shaped_queue_seconds_bucket{method=\"Shapes.Project\",le=\"0.00025\"} 1",
           "shaped_solver_iterations_bucket{method=\"Shapes.Project\",le=\"50\"} 1",
           "shaped_solver_unconverged_total{method=\"Shapes.Project\",termination=\"iteration_limit\"} 1",
           "shaped_solver_unconverged_total{method=\"Shapes.Project\",termination=\"stalled\"} 0",
           "shaped_refusals_total{cause=\"queue_length\"} 1",
           "shaped_refusals_total{cause=\"disk\"} 0",
           "shaped_model_bytes{model=\"a\\\"b\\\\c\\nd\",version=\"2\"} 12345",
           "shaped_jobs{state=\"running\"} 2",
           "shaped_pool_queue_length{pool=\"solver\"} 7",
           "shaped_pool_queue_length_limit{pool=\"solver\"} 256",
           "shaped_build_info{version=\"0.1.0\"} 1",
       }) {
    INFO(line << " in\n" << text);
    CHECK((text.find(line + "\n") != text.npos));
  }
}

TEST_CASE("the process says something plausible about itself") {
  const auto process = processStatistics();
  CHECK(process.resident_bytes > 1 << 20);
  CHECK(process.memory_limit_bytes > process.resident_bytes);
  CHECK(process.cpu_seconds > 0);
  CHECK(process.open_files >= 3);
  CHECK(process.most_open_files > process.open_files);
  CHECK(process.threads >= 1);
  const auto now = std::chrono::duration<double>(std::chrono::system_clock::now().time_since_epoch()).count();
  CHECK(process.start_seconds > now - 86400);
  CHECK(process.start_seconds < now + 2);
}
