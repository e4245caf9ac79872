#include "server/scheduling/request_queue.h"

#include <algorithm>

namespace shaped::server {
namespace {

constexpr double kMemory = 0.9;  // of moving averages, per piece of work

}  // namespace

Decision RequestQueue::enter(std::uint64_t id, const Caller& caller, Entry entry, std::size_t bytes) {
  const auto known = clients_.find(caller.client);
  auto decision = admit(load(), known == clients_.end() ? ClientLoad() : known->second.load, limits_,
                        {entry, caller.priority, bytes, caller.time_left, expectedWait(caller), expected(caller.kind)});
  if (!decision.admitted) return decision;
  auto& client = clientOf(caller.client);
  entry == Entry::kStream ? ++client.load.streams : ++client.load.requests;
  if (entry == Entry::kStream) ++streams_;
  count(places_.emplace(id, Place{caller, entry, 0}).first->second, bytes);
  return decision;
}

RequestQueue::Waiting& RequestQueue::lineOf(const Caller& caller) {
  return clients_.at(caller.client).lines.at(static_cast<std::size_t>(caller.priority));
}

void RequestQueue::push(std::uint64_t id, std::size_t bytes, Work work, Time now) {
  auto& place = places_.at(id);
  count(place, bytes);
  auto& line = lineOf(place.caller);
  if (line.tasks.empty()) line.since = now;
  line.tasks.push_back({id, expected(place.caller.kind), std::move(work)});
  line.work += line.tasks.back().expected;
  ++length_;
}

std::optional<RequestQueue::Work> RequestQueue::withdraw(std::uint64_t id) {
  const auto place = places_.find(id);
  if (place == places_.end()) return std::nullopt;
  auto& line = lineOf(place->second.caller);
  const auto found =
      std::find_if(line.tasks.begin(), line.tasks.end(), [id](const Task& task) { return task.id == id; });
  if (found == line.tasks.end()) return std::nullopt;
  return take(line, found).work;
}

void RequestQueue::leave(std::uint64_t id) {
  const auto found = places_.find(id);
  if (found == places_.end()) return;
  auto& place = found->second;
  count(place, 0);
  auto& load = clients_.at(place.caller.client).load;
  place.entry == Entry::kStream ? --load.streams : --load.requests;
  if (place.entry == Entry::kStream) --streams_;
  const auto name = std::move(place.caller.client);
  places_.erase(found);
  forgetIfGone(name);
}

RequestQueue::Begun RequestQueue::pop(Time now) {
  std::vector<Line> lines;
  std::vector<Caller> owners;
  for (const auto& [name, client] : clients_)
    for (const auto priority : kPriorities) {
      const auto& line = client.lines.at(static_cast<std::size_t>(priority));
      if (line.tasks.empty()) continue;
      const double waited = std::chrono::duration<double>(now - line.since).count();
      lines.push_back({priority, std::max(waited, 0.0), client.running, client.served});
      owners.push_back({name, priority});
    }
  const auto& owner = owners.at(next(lines, ageing_));
  auto& line = lineOf(owner);
  auto task = take(line, line.tasks.begin());
  Begun begun{owner.client, places_.at(task.id).caller.kind, std::move(task.work)};
  line.since = now;
  ++busy_;
  auto& client = clients_.at(begun.client);
  ++client.running;
  served_now_ = std::max(served_now_, client.served);
  return begun;
}

void RequestQueue::ended(const std::string& name, const std::string& kind, double seconds) {
  for (auto* mean : {&mean_seconds_, &mean_of_kind_[kind]})
    *mean = *mean == 0 ? seconds : kMemory * *mean + (1 - kMemory) * seconds;
  --busy_;
  auto& client = clients_.at(name);
  --client.running;
  client.served += seconds;
  forgetIfGone(name);
}

RequestQueue::Task RequestQueue::take(Waiting& line, std::deque<Task>::iterator task) {
  auto taken = std::move(*task);
  line.tasks.erase(task);
  line.work = line.tasks.empty() ? 0 : line.work - taken.expected;
  --length_;
  return taken;
}

/// The time that work of this kind took lately; that of all work where it is new.
double RequestQueue::expected(const std::string& kind) const {
  const auto known = mean_of_kind_.find(kind);
  return known == mean_of_kind_.end() ? mean_seconds_ : known->second;
}

/// Until a worker takes up a request that comes now: what is more urgent goes first, and of other clients' lines of the
/// same priority as many requests as the client itself has waiting then. Ageing is left out.
double RequestQueue::expectedWait(const Caller& caller) const {
  if (length_ == 0 && busy_ < static_cast<std::size_t>(workers_)) return 0;
  const auto own = clients_.find(caller.client);
  const auto at = static_cast<std::size_t>(caller.priority);
  const auto turn = static_cast<double>(own == clients_.end() ? 1 : own->second.lines.at(at).tasks.size() + 1);
  double work = mean_seconds_;  // of what runs: a worker is free after its share of this
  for (const auto& [name, client] : clients_)
    for (const auto priority : kPriorities) {
      const auto& line = client.lines.at(static_cast<std::size_t>(priority));
      if (line.tasks.empty() || priority > caller.priority) continue;
      const bool before = priority < caller.priority || name == caller.client;
      work += line.work * (before ? 1 : std::min(1.0, turn / static_cast<double>(line.tasks.size())));
    }
  return work / workers_;
}

Load RequestQueue::load() const { return {workers_, busy_, length_, bytes_, streams_, mean_seconds_}; }

RequestQueue::Client& RequestQueue::clientOf(const std::string& name) {
  const auto [found, is_new] = clients_.try_emplace(name);
  if (is_new) found->second.served = served_now_;
  return found->second;
}

void RequestQueue::forgetIfGone(const std::string& name) {
  const auto found = clients_.find(name);
  const auto& load = found->second.load;
  if (load.requests == 0 && load.streams == 0 && found->second.running == 0) clients_.erase(found);
}

void RequestQueue::count(Place& place, std::size_t bytes) {
  auto& load = clients_.at(place.caller.client).load;
  load.bytes += bytes - place.bytes;
  bytes_ += bytes - place.bytes;
  place.bytes = bytes;
}

}  // namespace shaped::server
