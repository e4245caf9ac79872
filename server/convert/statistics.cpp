#include "server/convert/statistics.h"

#include <cmath>

#include "server/convert/report.h"
#include "server/convert/time.h"

namespace shaped::server {
namespace {

void toProto(const DurationStatistics& duration, v1::DurationStatistics& message) {
  message.set_count(duration.total.count());
  message.set_seconds(duration.total.sum());
  message.set_recent_count(duration.recent.count());
  message.set_p50(duration.recent.quantile(0.5));
  message.set_p90(duration.recent.quantile(0.9));
  message.set_p99(duration.recent.quantile(0.99));
}

void solverToProto(const MethodStatistics& method, v1::SolverStatistics& message) {
  message.set_solves(method.iterations.count());
  message.set_iterations(static_cast<std::uint64_t>(std::llround(method.iterations.sum())));
  for (const auto& [termination, count] : method.unconverged) {
    auto& entry = *message.add_unconverged();
    entry.set_termination(server::toProto(termination));
    entry.set_count(count);
  }
}

void toProto(const MethodStatistics& method, v1::MethodStatistics& message) {
  message.set_method(method.name);
  message.set_in_flight(method.in_flight);
  for (const auto& [code, count] : method.by_code) {
    auto& entry = *message.add_by_code();
    entry.set_code(code);
    entry.set_count(count);
  }
  toProto(method.request, *message.mutable_request());
  toProto(method.queue, *message.mutable_queue());
  toProto(method.compute, *message.mutable_compute());
  if (method.iterations.count() > 0) solverToProto(method, *message.mutable_solver());
}

void toProto(const PoolStatistics& pool, v1::PoolStatistics& message) {
  message.set_pool(pool.name);
  message.set_threads(static_cast<std::uint32_t>(pool.load.workers));
  message.set_busy_threads(static_cast<std::uint32_t>(pool.load.busy));
  message.set_queue_length(pool.load.queue_length);
  message.set_queue_length_limit(pool.limits.queue_length);
  message.set_bytes_in_flight(pool.load.bytes_in_flight);
  message.set_bytes_in_flight_limit(pool.limits.bytes_in_flight);
  message.set_open_streams(pool.load.open_streams);
  message.set_open_streams_limit(pool.limits.open_streams);
}

void toProto(const Surroundings& surroundings, v1::GetStatisticsResponse& response) {
  for (const auto& pool : surroundings.pools) toProto(pool, *response.add_pools());
  for (const auto& model : surroundings.models) {
    auto& entry = *response.add_models();
    entry.mutable_model()->set_name(model.name);
    entry.mutable_model()->set_version(model.version);
    entry.set_bytes(model.bytes);
  }
  for (const auto& [code, count] : surroundings.denials) {
    auto& entry = *response.add_denials();
    entry.set_code(code);
    entry.set_count(count);
  }
  for (const auto& [state, count] : surroundings.jobs) {
    auto& entry = *response.add_jobs();
    entry.set_state(state);
    entry.set_count(count);
  }
}

void toProto(const ProcessStatistics& process, v1::ProcessStatistics& message) {
  message.set_resident_bytes(process.resident_bytes);
  message.set_memory_limit_bytes(process.memory_limit_bytes);
  message.set_cpu_seconds(process.cpu_seconds);
  message.set_open_files(process.open_files);
  message.set_threads(process.threads);
}

}  // namespace

void toProto(const Statistics& statistics, v1::GetStatisticsResponse& response) {
  response.set_version(statistics.version);
  toProto(statistics.started, *response.mutable_started());
  response.set_uptime(statistics.uptime);
  for (const auto& method : statistics.methods) toProto(method, *response.add_methods());
  for (const auto& [cause, count] : statistics.refusals) {
    auto& entry = *response.add_refusals();
    entry.set_cause(std::string(name(cause)));
    entry.set_count(count);
  }
  for (const auto& [job, count] : statistics.ended_jobs) {
    auto& entry = *response.add_ended_jobs();
    entry.set_kind(job.kind);
    entry.set_state(job.state);
    entry.set_count(count);
  }
  toProto(statistics.surroundings, response);
  toProto(statistics.process, *response.mutable_process());
  response.set_lost_log_lines(statistics.lost_log_lines);
}

}  // namespace shaped::server
