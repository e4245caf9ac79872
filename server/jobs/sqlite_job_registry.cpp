#include "server/jobs/sqlite_job_registry.h"

#include <algorithm>

#include "core/io/text_scanner.h"
#include "server/errors/errors.h"

namespace shaped::server {
namespace {

/// 0, which no job has, for what is no id.
std::uint64_t numberOf(const std::string& id) {
  std::int64_t number = 0;
  return parseInteger(id, number) && number > 0 && std::to_string(number) == id ? static_cast<std::uint64_t>(number)
                                                                                : 0;
}

[[noreturn]] void throwNotFound(const std::string& id) { throw NotFound("there is no job " + quotedWord(id)); }

bool sameRequest(const JobRecord& one, const JobRecord& other) {
  return one.kind == other.kind && one.request == other.request;
}

constexpr std::size_t kAll = 1'000'000'000;

}  // namespace

SqliteJobRegistry::SqliteJobRegistry(const std::filesystem::path& file, Duration save_every)
    : save_every_(save_every), owner_(newJobKey()), table_(file) {
  for (auto& row : table_.list({{JobState::kQueued, JobState::kRunning}, {}, kAll})) {
    const auto number = numberOf(row.record.id);
    live_[number] = {std::move(row), Steady::now(), {}};
  }
}

SqliteJobRegistry::LiveJobs::iterator SqliteJobRegistry::findLive(const std::string& id) {
  return live_.find(numberOf(id));
}

SqliteJobRegistry::LiveJobs::const_iterator SqliteJobRegistry::findLive(const std::string& id) const {
  return live_.find(numberOf(id));
}

JobRecord SqliteJobRegistry::liveOr(const Row& row) const {
  const auto found = findLive(row.record.id);
  return found == live_.end() ? row.record : found->second.row.record;
}

JobRecord SqliteJobRegistry::create(JobRecord record, std::size_t most_waiting) {
  const std::scoped_lock lock(mutex_);
  if (!record.request_id.empty())
    if (const auto known = table_.find(record.request_id)) {
      if (sameRequest(known->record, record)) return liveOr(*known);
      throw AlreadyExists("request_id: job " + known->record.id + " was made by " + quotedWord(record.request_id) +
                          " with another request; give each request an id of its own");
    }
  const auto waiting = std::count_if(
      live_.begin(), live_.end(), [](const auto& item) { return item.second.row.record.state == JobState::kQueued; });
  if (static_cast<std::size_t>(waiting) >= most_waiting)
    throw Busy("too many jobs are waiting; watch one end, or cancel one, and try again");
  if (record.key.empty()) record.key = newJobKey();
  record.created = std::chrono::floor<std::chrono::microseconds>(std::chrono::system_clock::now());
  record.state = JobState::kQueued;
  Row row{std::move(record), {}};
  table_.insert(row);
  live_[numberOf(row.record.id)] = {row, Steady::now(), {}};
  return row.record;
}

JobRecord SqliteJobRegistry::get(const std::string& id) const {
  const std::scoped_lock lock(mutex_);
  if (const auto found = findLive(id); found != live_.end()) return found->second.row.record;
  if (const auto row = table_.get(id)) return row->record;
  throwNotFound(id);
}

std::optional<JobRecord> SqliteJobRegistry::find(const std::string& request_id) const {
  const std::scoped_lock lock(mutex_);
  const auto row = table_.find(request_id);
  return row ? std::optional(liveOr(*row)) : std::nullopt;
}

std::vector<JobRecord> SqliteJobRegistry::list(const JobQuery& query) const {
  const std::scoped_lock lock(mutex_);
  std::vector<JobRecord> records;
  for (const auto& row : table_.list(query)) records.push_back(liveOr(row));
  return records;
}

std::shared_ptr<const JobRegistry::Listener> SqliteJobRegistry::listen(const std::string& id, Listener listener) {
  auto shared = std::make_shared<const Listener>(std::move(listener));
  const std::scoped_lock lock(mutex_);
  if (const auto found = findLive(id); found != live_.end())
    found->second.listeners.push_back(shared);
  else if (!table_.get(id))
    throwNotFound(id);
  return shared;  // nothing happens any more to one that has ended
}

SqliteJobRegistry::Listeners SqliteJobRegistry::listenersOf(Live& live) {
  std::erase_if(live.listeners, [](const auto& listener) { return listener.expired(); });
  Listeners listeners;
  for (const auto& listener : live.listeners) listeners.push_back(listener.lock());
  return listeners;
}

void SqliteJobRegistry::tell(const Listeners& listeners) {
  for (const auto& listener : listeners)
    if (listener) (*listener)();
}

void SqliteJobRegistry::save(Live& live, Row row) {
  table_.save(row);
  live.row = std::move(row);
  live.saved = Steady::now();
}

bool SqliteJobRegistry::update(const std::string& id, const std::function<void(JobRecord&)>& change) {
  Listeners listeners;
  {
    const std::scoped_lock lock(mutex_);
    const auto found = findLive(id);
    if (found == live_.end()) {
      if (!table_.get(id)) throwNotFound(id);
      return false;
    }
    auto row = found->second.row;
    change(row.record);
    if (row.record.state != JobState::kRunning) row.owner.clear();
    save(found->second, std::move(row));
    listeners = listenersOf(found->second);
    if (hasEnded(found->second.row.record.state)) live_.erase(found);
  }
  tell(listeners);
  return true;
}

void SqliteJobRegistry::report(const std::string& id, const Progress& progress) {
  Listeners listeners;
  {
    const std::scoped_lock lock(mutex_);
    const auto found = findLive(id);
    if (found == live_.end()) return;
    auto& record = found->second.row.record;
    record.stage = progress.stage;
    record.fraction = std::max(record.fraction, progress.fraction);
    record.residual = progress.residual;
    if (Steady::now() - found->second.saved >= save_every_) {
      found->second.saved =
          Steady::now();  // also of an attempt that failed: the work goes on, and the next may succeed
      try {
        table_.save(found->second.row);
      } catch (const std::exception&) {
      }
    }
    listeners = listenersOf(found->second);
  }
  tell(listeners);
}

std::optional<JobRecord> SqliteJobRegistry::claim() {
  Listeners listeners;
  JobRecord claimed;
  {
    const std::scoped_lock lock(mutex_);
    const auto found = std::find_if(live_.begin(), live_.end(),
                                    [](const auto& item) { return item.second.row.record.state == JobState::kQueued; });
    if (found == live_.end()) return std::nullopt;
    auto row = found->second.row;
    row.owner = owner_;
    row.record.state = JobState::kRunning;
    if (!row.record.started)
      row.record.started = std::chrono::floor<std::chrono::microseconds>(std::chrono::system_clock::now());
    ++row.record.attempts;
    save(found->second, std::move(row));
    claimed = found->second.row.record;
    listeners = listenersOf(found->second);
  }
  tell(listeners);
  return claimed;
}

std::vector<JobRecord> SqliteJobRegistry::takeOver() {
  const std::scoped_lock lock(mutex_);
  std::vector<JobRecord> taken;
  for (auto& [number, live] : live_) {
    if (live.row.record.state != JobState::kRunning || live.row.owner == owner_) continue;
    auto row = live.row;
    row.owner = owner_;
    ++row.record.crashes;
    save(live, std::move(row));
    taken.push_back(live.row.record);
  }
  return taken;
}

JobRecord SqliteJobRegistry::remove(const std::string& id) {
  const std::scoped_lock lock(mutex_);
  if (findLive(id) != live_.end())
    throw WrongState("job " + id + " has not ended; cancel it, and delete it once it has");
  const auto row = table_.get(id);
  if (!row) throwNotFound(id);
  table_.erase(id);
  return row->record;
}

std::vector<JobRecord> SqliteJobRegistry::forgetOld(const JobRetention& retention) {
  const auto limit =
      retention.age.count() > 0 ? std::chrono::system_clock::now() - retention.age : JobRecord::Time::min();
  const std::scoped_lock lock(mutex_);
  std::vector<JobRecord> forgotten;
  for (const auto& id : table_.old(retention.most, limit)) {
    if (auto row = table_.get(id)) forgotten.push_back(std::move(row->record));
    table_.erase(id);
  }
  return forgotten;
}

}  // namespace shaped::server
