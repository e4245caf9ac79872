#include "server/telemetry/metrics.h"

#include "server/telemetry/call_log.h"

namespace shaped::server {
namespace {

using Clock = RecentSketch::Clock;

// 0.1 ms to 100 s, three a decade: 1 - 2.5 - 5, as dashboards like them.
constexpr std::array kSeconds{0.0001, 0.00025, 0.0005, 0.001, 0.0025, 0.005, 0.01, 0.025, 0.05, 0.1,
                              0.25,   0.5,     1.,     2.5,   5.,     10.,   25.,  50.,   100.};
constexpr std::array kIterations{1., 2., 5., 10., 20., 50., 100., 200., 500., 1000.};

}  // namespace

void MethodMetrics::Duration::observe(double seconds, Clock::time_point now) {
  total.observe(seconds);
  recent.observe(seconds, now);
}

DurationStatistics MethodMetrics::Duration::snapshot(Clock::time_point now) const {
  return {total, recent.recent(now)};
}

MethodMetrics::MethodMetrics(std::string name)
    : name_(std::move(name)),
      request_{Histogram(kSeconds), {}},
      queue_{Histogram(kSeconds), {}},
      compute_{Histogram(kSeconds), {}},
      iterations_(kIterations) {}

void MethodMetrics::began() { in_flight_.fetch_add(1, std::memory_order_relaxed); }

void MethodMetrics::ended(const CallOutcome& outcome) {
  in_flight_.fetch_sub(1, std::memory_order_relaxed);
  const std::scoped_lock lock(mutex_);
  const auto now = Clock::now();  // under the lock, so that it never goes back
  ++by_code_[outcome.code];
  request_.observe(outcome.seconds, now);
  queue_.observe(outcome.queue_seconds, now);
  compute_.observe(outcome.compute_seconds, now);
}

void MethodMetrics::solved(const Outcome& outcome) {
  if (outcome.termination == Termination::kCancelled) return;
  const std::scoped_lock lock(mutex_);
  iterations_.observe(outcome.iterations);
  if (!outcome.converged()) ++unconverged_[outcome.termination];
}

MethodStatistics MethodMetrics::snapshot() const {
  const std::scoped_lock lock(mutex_);
  const auto now = Clock::now();
  return {.name = name_,
          .by_code = by_code_,
          .in_flight = in_flight_.load(std::memory_order_relaxed),
          .request = request_.snapshot(now),
          .queue = queue_.snapshot(now),
          .compute = compute_.snapshot(now),
          .iterations = iterations_,
          .unconverged = unconverged_};
}

Metrics::Metrics(std::function<Surroundings()> surroundings)
    : surroundings_(std::move(surroundings)),
      started_(std::chrono::system_clock::now()),
      begin_(std::chrono::steady_clock::now()) {}

MethodMetrics& Metrics::method(const std::string& name) {
  {
    const std::shared_lock lock(mutex_);
    if (const auto found = methods_.find(name); found != methods_.end()) return *found->second;
  }
  const std::scoped_lock lock(mutex_);
  auto& method = methods_[name];
  if (!method) method = std::make_unique<MethodMetrics>(name);
  return *method;
}

void Metrics::jobEnded(const std::string& kind, const std::string& state) {
  const std::scoped_lock lock(mutex_);
  ++ended_jobs_[{kind, state}];
}

void Metrics::declareJobs(const std::string& kind, const std::string& state) {
  const std::scoped_lock lock(mutex_);
  ended_jobs_.emplace(EndedJobs{kind, state}, 0);
}

Statistics Metrics::snapshot() const {
  Statistics statistics;
  statistics.version = SHAPED_VERSION;
  statistics.started = started_;
  statistics.uptime = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin_).count();
  {
    const std::shared_lock lock(mutex_);
    for (const auto& [name, method] : methods_) statistics.methods.push_back(method->snapshot());
    statistics.ended_jobs = ended_jobs_;
  }
  for (const auto cause : kRefusalCauses) statistics.refusals[cause] = refusals_[static_cast<std::size_t>(cause)];
  statistics.surroundings = surroundings_();
  statistics.process = processStatistics();
  statistics.lost_log_lines = lostLogLines();
  return statistics;
}

}  // namespace shaped::server
