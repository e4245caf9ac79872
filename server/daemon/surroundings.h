#pragma once

#include "server/jobs/job_registry.h"
#include "server/models/model_store.h"
#include "server/rpc/call.h"
#include "server/telemetry/statistics.h"

namespace shaped::server {

PoolStatistics poolStatistics(const std::string& name, const WorkerPool& pool);
std::vector<ModelMemory> modelMemory(ModelStore& models);
/// Every state, also those that no job is in.
std::map<std::string, std::uint64_t> jobCounts(const JobRegistry& registry);

/// Both ways to be turned away; never happened where nobody is asked who he is (access null).
std::map<std::string, std::uint64_t> denialCounts(const Access* access);

/// Makes all methods of a service known, so that their counts begin at 0 and not at their first call.
/// service: the full name of one that is linked, "shaped.v1.Shapes".
void declareMethods(const std::string& service, Metrics& metrics);

}  // namespace shaped::server
