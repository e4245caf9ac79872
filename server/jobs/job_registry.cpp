#include "server/jobs/job_registry.h"

#include <algorithm>
#include <charconv>

#include "server/errors/errors.h"

namespace shaped::server {

JobRecord MemoryJobRegistry::create(JobRecord record) {
  const std::scoped_lock lock(mutex_);
  const auto number = next_++;
  record.id = std::to_string(number);
  record.created = std::chrono::system_clock::now();
  entries_[number].record = record;
  return record;
}

MemoryJobRegistry::Entry& MemoryJobRegistry::find(const std::string& id) {
  std::uint64_t number = 0;
  const auto* end = id.data() + id.size();
  const auto [stopped, error] = std::from_chars(id.data(), end, number);
  const auto found = entries_.find(number);
  if (error != std::errc() || stopped != end || found == entries_.end())
    throw NotFound("there is no job \"" + id + "\"");
  return found->second;
}

JobRecord MemoryJobRegistry::get(const std::string& id) const {
  const std::scoped_lock lock(mutex_);
  return const_cast<MemoryJobRegistry*>(this)->find(id).record;
}

std::vector<JobRecord> MemoryJobRegistry::list() const {
  const std::scoped_lock lock(mutex_);
  std::vector<JobRecord> records;
  for (const auto& [number, entry] : entries_) records.push_back(entry.record);
  return records;
}

bool MemoryJobRegistry::update(const std::string& id, const std::function<void(JobRecord&)>& change) {
  std::vector<std::shared_ptr<const Listener>> listeners;
  {
    const std::scoped_lock lock(mutex_);
    auto& entry = find(id);
    if (hasEnded(entry.record.state)) return false;
    change(entry.record);
    std::erase_if(entry.listeners, [](const auto& listener) { return listener.expired(); });
    for (const auto& listener : entry.listeners) listeners.push_back(listener.lock());
    if (hasEnded(entry.record.state)) forgetOld();
  }
  for (const auto& listener : listeners)
    if (listener) (*listener)();
  return true;
}

std::shared_ptr<const JobRegistry::Listener> MemoryJobRegistry::listen(const std::string& id, Listener listener) {
  auto shared = std::make_shared<const Listener>(std::move(listener));
  const std::scoped_lock lock(mutex_);
  find(id).listeners.push_back(shared);
  return shared;
}

void MemoryJobRegistry::forgetOld() {
  const auto ended = [](const auto& item) { return hasEnded(item.second.record.state); };
  auto count = static_cast<std::size_t>(std::count_if(entries_.begin(), entries_.end(), ended));
  for (auto at = entries_.begin(); count > most_ended_;) {
    at = std::find_if(at, entries_.end(), ended);
    at = entries_.erase(at);
    --count;
  }
}

}  // namespace shaped::server
