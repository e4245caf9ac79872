#pragma once

#include <array>
#include <chrono>
#include <compare>
#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "core/numerics/solved.h"
#include "server/scheduling/admission.h"
#include "server/telemetry/histogram.h"
#include "server/telemetry/process.h"
#include "server/telemetry/sketch.h"

namespace shaped::server {

/// Everything the daemon says about itself at one moment: plain values, from which the scrape (exposition.h) and
/// Admin.GetStatistics are made.

/// One duration of a method's calls: since the start for Prometheus, over the last minute for people.
struct DurationStatistics {
  Histogram total;
  Sketch recent;
};

/// One method of a service.
struct MethodStatistics {
  std::string name;                              ///< "Shapes.Project"
  std::map<std::string, std::uint64_t> by_code;  ///< calls that have ended, by gRPC status name
  std::int64_t in_flight = 0;
  DurationStatistics request, queue, compute;
  Histogram iterations;                              ///< of solves that were not cancelled
  std::map<Termination, std::uint64_t> unconverged;  ///< solves that ended otherwise than converged or cancelled
};

struct PoolStatistics {
  std::string name;  ///< "solver", "light", "heavy"
  Load load;
  AdmissionLimits limits;
};

struct ModelMemory {
  std::string name;
  std::uint64_t version = 0;
  std::size_t bytes = 0;
};

/// What others know: the telemetry asks for it and depends on none of them.
struct Surroundings {
  std::vector<PoolStatistics> pools;
  std::vector<ModelMemory> models;                    ///< in memory
  std::map<std::string, std::uint64_t> jobs;          ///< records kept, by state
  std::map<std::string, std::uint64_t> denials = {};  ///< calls turned away for who makes them, by gRPC status name
};

/// How jobs of one kind ended: "succeeded", "failed", "cancelled".
struct EndedJobs {
  std::string kind, state;
  auto operator<=>(const EndedJobs&) const = default;
};

struct Statistics {
  std::string version;  ///< of the program
  std::chrono::system_clock::time_point started;
  double uptime = 0;                      ///< [s]
  std::vector<MethodStatistics> methods;  ///< by name
  std::map<RefusalCause, std::uint64_t> refusals;
  std::map<EndedJobs, std::uint64_t> ended_jobs;  ///< since the start
  Surroundings surroundings;
  ProcessStatistics process;
  std::uint64_t lost_log_lines = 0;
};

}  // namespace shaped::server
