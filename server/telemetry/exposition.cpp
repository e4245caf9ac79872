#include "server/telemetry/exposition.h"

#include <prometheus/text_serializer.h>

#include <functional>
#include <limits>

namespace shaped::server {
namespace {

using prometheus::ClientMetric;
using prometheus::MetricFamily;
using prometheus::MetricType;
using Labels = std::vector<ClientMetric::Label>;

/// One metric with all its series.
class Family {
 public:
  Family(MetricType type, std::string name, std::string help) : family_{std::move(name), std::move(help), type, {}} {}

  Family& add(Labels labels, double value) {
    auto& metric = family_.metric.emplace_back();
    metric.label = std::move(labels);
    (family_.type == MetricType::Counter ? metric.counter.value : metric.gauge.value) = value;
    return *this;
  }

  Family& add(Labels labels, const Histogram& histogram) {
    auto& metric = family_.metric.emplace_back();
    metric.label = std::move(labels);
    metric.histogram.sample_count = histogram.count();
    metric.histogram.sample_sum = histogram.sum();
    std::uint64_t cumulative = 0;
    for (std::size_t i = 0; i < histogram.counts().size(); ++i) {
      cumulative += histogram.counts()[i];
      const bool last = i == histogram.bounds().size();
      metric.histogram.bucket.push_back(
          {cumulative, last ? std::numeric_limits<double>::infinity() : histogram.bounds()[i]});
    }
    return *this;
  }

  MetricFamily take() { return std::move(family_); }

 private:
  MetricFamily family_;
};

Family counter(std::string name, std::string help) { return {MetricType::Counter, std::move(name), std::move(help)}; }
Family gauge(std::string name, std::string help) { return {MetricType::Gauge, std::move(name), std::move(help)}; }
Family histogram(std::string name, std::string help) {
  return {MetricType::Histogram, std::move(name), std::move(help)};
}

double number(std::uint64_t count) { return static_cast<double>(count); }

using Families = std::vector<MetricFamily>;

void addMethods(const std::vector<MethodStatistics>& methods, Families& families) {
  auto requests = counter("shaped_requests_total", "Calls that have ended, by method and gRPC status");
  auto in_flight = gauge("shaped_requests_in_flight", "Calls that have arrived and not ended");
  auto request = histogram("shaped_request_seconds", "From a call's arrival to its end");
  auto queue = histogram("shaped_queue_seconds", "A call's wait for a worker, all messages of a stream together");
  auto compute = histogram("shaped_compute_seconds", "A worker's time on a call, without waiting for the client");
  for (const auto& method : methods) {
    const ClientMetric::Label name{"method", method.name};
    for (const auto& [code, count] : method.by_code) requests.add({name, {"code", code}}, number(count));
    in_flight.add({name}, static_cast<double>(method.in_flight));
    request.add({name}, method.request.total);
    queue.add({name}, method.queue.total);
    compute.add({name}, method.compute.total);
  }
  for (auto* family : {&requests, &in_flight, &request, &queue, &compute}) families.push_back(family->take());
}

void addSolvers(const std::vector<MethodStatistics>& methods, Families& families) {
  auto iterations = histogram("shaped_solver_iterations", "Iterations of a solve, cancelled ones left out");
  auto unconverged = counter("shaped_solver_unconverged_total", "Solves that ended without converging, by how");
  constexpr std::array kinds{Termination::kIterationLimit, Termination::kStalled, Termination::kNumericalFailure};
  for (const auto& method : methods) {
    if (method.iterations.count() == 0) continue;  // most methods have no solver
    iterations.add({{"method", method.name}}, method.iterations);
    for (const auto kind : kinds) {
      const auto found = method.unconverged.find(kind);
      unconverged.add({{"method", method.name}, {"termination", std::string(name(kind))}},
                      found == method.unconverged.end() ? 0 : number(found->second));
    }
  }
  families.push_back(iterations.take());
  families.push_back(unconverged.take());
}

void addPools(const std::vector<PoolStatistics>& pools, Families& families) {
  using Value = std::function<double(const PoolStatistics&)>;
  const auto add = [&](const std::string& name, const std::string& help, const Value& value) {
    auto family = gauge(name, help);
    for (const auto& pool : pools) family.add({{"pool", pool.name}}, value(pool));
    families.push_back(family.take());
  };
  add("shaped_pool_threads", "Workers of a pool", [](const auto& pool) { return double(pool.load.workers); });
  add("shaped_pool_busy_threads", "Workers that run something",
      [](const auto& pool) { return number(pool.load.busy); });
  add("shaped_pool_queue_length", "Requests that wait for a worker",
      [](const auto& pool) { return number(pool.load.queue_length); });
  add("shaped_pool_queue_length_limit", "Requests that may wait",
      [](const auto& pool) { return number(pool.limits.queue_length); });
  add("shaped_pool_bytes_in_flight", "Messages of requests that wait or run",
      [](const auto& pool) { return number(pool.load.bytes_in_flight); });
  add("shaped_pool_bytes_in_flight_limit", "What they may take together",
      [](const auto& pool) { return number(pool.limits.bytes_in_flight); });
  add("shaped_pool_open_streams", "Streams that hold a place",
      [](const auto& pool) { return number(pool.load.open_streams); });
  add("shaped_pool_open_streams_limit", "Streams that may",
      [](const auto& pool) { return number(pool.limits.open_streams); });
}

void addStores(const Statistics& statistics, Families& families) {
  auto refusals = counter("shaped_refusals_total", "Requests and jobs turned away for want of something, by what");
  for (const auto& [cause, count] : statistics.refusals)
    refusals.add({{"cause", std::string(name(cause))}}, number(count));
  auto models = gauge("shaped_model_bytes", "Memory of a loaded model's arrays and factors");
  for (const auto& model : statistics.surroundings.models)
    models.add({{"model", model.name}, {"version", std::to_string(model.version)}}, number(model.bytes));
  auto jobs = gauge("shaped_jobs", "Job records, by state");
  for (const auto& [state, count] : statistics.surroundings.jobs) jobs.add({{"state", state}}, number(count));
  auto ended = counter("shaped_jobs_ended_total", "Jobs that have ended, by kind and how");
  for (const auto& [job, count] : statistics.ended_jobs)
    ended.add({{"kind", job.kind}, {"state", job.state}}, number(count));
  auto denials = counter("shaped_denials_total", "Calls turned away for who makes them, by gRPC status");
  for (const auto& [code, count] : statistics.surroundings.denials) denials.add({{"code", code}}, number(count));
  for (auto* family : {&refusals, &models, &jobs, &ended, &denials}) families.push_back(family->take());
}

void addProcess(const Statistics& statistics, Families& families) {
  const auto& process = statistics.process;
  for (auto family : {
           gauge("process_resident_memory_bytes", "Resident memory").add({}, number(process.resident_bytes)),
           counter("process_cpu_seconds_total", "User and system time").add({}, process.cpu_seconds),
           gauge("process_open_fds", "Open file descriptors").add({}, number(process.open_files)),
           gauge("process_max_fds", "File descriptors that may be open").add({}, number(process.most_open_files)),
           gauge("process_threads", "Threads").add({}, number(process.threads)),
           gauge("process_start_time_seconds", "Start, seconds since 1970").add({}, process.start_seconds),
           gauge("shaped_memory_limit_bytes", "Memory of the container or the machine")
               .add({}, number(process.memory_limit_bytes)),
           counter("shaped_log_lines_lost_total", "Log lines dropped because nobody took them in time")
               .add({}, number(statistics.lost_log_lines)),
           gauge("shaped_build_info", "Always 1; the version is in the label")
               .add({{"version", statistics.version}}, 1),
       })
    families.push_back(family.take());
}

}  // namespace

std::string exposition(const Statistics& statistics) {
  Families families;
  addMethods(statistics.methods, families);
  addSolvers(statistics.methods, families);
  addPools(statistics.surroundings.pools, families);
  addStores(statistics, families);
  addProcess(statistics, families);
  return prometheus::TextSerializer().Serialize(families);
}

}  // namespace shaped::server
