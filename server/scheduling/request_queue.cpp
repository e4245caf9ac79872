#include "server/scheduling/request_queue.h"

#include <algorithm>

namespace shaped::server {

Decision RequestQueue::enter(std::uint64_t id, const Caller& caller, Entry entry, std::size_t bytes) {
  const auto known = clients_.find(caller.client);
  auto decision = admit(load(), known == clients_.end() ? ClientLoad() : known->second.load, limits_,
                        {entry, caller.priority, bytes});
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
  line.tasks.push_back({id, std::move(work)});
  ++length_;
}

std::optional<RequestQueue::Work> RequestQueue::withdraw(std::uint64_t id) {
  const auto place = places_.find(id);
  if (place == places_.end()) return std::nullopt;
  auto& tasks = lineOf(place->second.caller).tasks;
  const auto found = std::find_if(tasks.begin(), tasks.end(), [id](const Task& task) { return task.id == id; });
  if (found == tasks.end()) return std::nullopt;
  auto work = std::move(found->work);
  tasks.erase(found);
  --length_;
  return work;
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
  Begun begun{owner.client, std::move(line.tasks.front().work)};
  line.tasks.pop_front();
  line.since = now;
  --length_;
  ++busy_;
  auto& client = clients_.at(begun.client);
  ++client.running;
  served_now_ = std::max(served_now_, client.served);
  return begun;
}

void RequestQueue::ended(const std::string& name, double seconds) {
  constexpr double memory = 0.9;  // of the moving average, per piece of work
  mean_seconds_ = mean_seconds_ == 0 ? seconds : memory * mean_seconds_ + (1 - memory) * seconds;
  --busy_;
  auto& client = clients_.at(name);
  --client.running;
  client.served += seconds;
  forgetIfGone(name);
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
