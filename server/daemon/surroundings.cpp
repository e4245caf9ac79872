#include "server/daemon/surroundings.h"

#include <google/protobuf/descriptor.h>

#include "server/errors/status.h"

namespace shaped::server {

PoolStatistics poolStatistics(const std::string& name, const WorkerPool& pool) {
  return {name, pool.load(), pool.limits()};
}

std::vector<ModelMemory> modelMemory(ModelStore& models) {
  std::vector<ModelMemory> memory;
  for (const auto& model : models.loaded()) memory.push_back({model->name, model->version, model->bytes});
  return memory;
}

std::map<std::string, std::uint64_t> jobCounts(const JobRegistry& registry) {
  std::map<std::string, std::uint64_t> counts;
  for (const auto state :
       {JobState::kQueued, JobState::kRunning, JobState::kSucceeded, JobState::kFailed, JobState::kCancelled})
    counts[nameOf(state)] = 0;
  for (const auto& record : registry.list({.states = {}, .after = {}, .limit = 100'000}))
    ++counts[nameOf(record.state)];
  return counts;
}

std::map<std::string, std::uint64_t> denialCounts(const Access* access) {
  std::map<std::string, std::uint64_t> counts;
  for (const auto& [code, count] : access ? access->denials() : Access().denials()) counts[nameOf(code)] = count;
  return counts;
}

void declareMethods(const std::string& service, Metrics& metrics) {
  const auto* descriptor = google::protobuf::DescriptorPool::generated_pool()->FindServiceByName(service);
  if (!descriptor) return;
  for (int i = 0; i < descriptor->method_count(); ++i)
    metrics.method(descriptor->name() + "." + descriptor->method(i)->name());
}

}  // namespace shaped::server
