#pragma once

#include <array>
#include <chrono>
#include <cstdint>
#include <deque>
#include <functional>
#include <limits>
#include <map>
#include <optional>
#include <string>
#include <unordered_map>

#include "server/scheduling/admission.h"
#include "server/scheduling/order.h"

namespace shaped::server {

/// Who asks for something, how urgently, and for what.
struct Caller {
  std::string client;  ///< tells clients apart
  Priority priority = Priority::kNormal;
  std::string kind = {};                                       ///< work of one kind takes about as long each time
  double time_left = std::numeric_limits<double>::infinity();  ///< of a call, until its deadline [s]
};

/// What waits, runs and holds a place in a worker pool: the book that admission (admission.h) and order (order.h) are
/// read from. Has no lock and no clock; `now` never goes back.
///
/// The time spent on a client is counted from the moment when it had something here, and begins with what the latest
/// request to run had: who comes anew has neither credit nor debt.
class RequestQueue {
 public:
  using Time = std::chrono::steady_clock::time_point;
  using Work = std::function<void()>;

  struct Begun {
    std::string client, kind;
    Work work;
  };

  RequestQueue(int workers, AdmissionLimits limits) : workers_(workers), limits_(limits) {}

  /// A place for a call or a stream, until leave(); or why there is none. id: of nobody who is here.
  Decision enter(std::uint64_t id, const Caller& caller, Entry entry, std::size_t bytes);
  /// Queues work of somebody who has a place and nothing in the queue; `bytes` are what its messages take from now on.
  void push(std::uint64_t id, std::size_t bytes, Work work, Time now);
  /// Takes work out of the queue, if it is there; the place stays.
  std::optional<Work> withdraw(std::uint64_t id);
  /// Gives a place back; nothing where there is none. Not while work of it is queued.
  void leave(std::uint64_t id);

  bool empty() const { return length_ == 0; }
  /// The work that is to run now; not from an empty queue.
  Begun pop(Time now);
  /// Work of this client and kind that was popped has ended.
  void ended(const std::string& client, const std::string& kind, double seconds);

  Load load() const;
  const AdmissionLimits& limits() const { return limits_; }
  void setLimits(const AdmissionLimits& limits) { limits_ = limits; }
  /// See next().
  void setAgeing(double seconds) { ageing_ = seconds; }

 private:
  struct Task {
    std::uint64_t id;
    double expected;  ///< [s]
    Work work;
  };
  struct Waiting {
    std::deque<Task> tasks;
    double work = 0;  ///< of all tasks, as expected() had it [s]
    Time since;       ///< the line does not move
  };
  struct Client {
    ClientLoad load;
    std::size_t running = 0;
    double served = 0;
    std::array<Waiting, kPriorities.size()> lines{};
  };
  struct Place {
    Caller caller;
    Entry entry;
    std::size_t bytes;
  };

  double expected(const std::string& kind) const;
  double expectedWait(const Caller& caller) const;
  Task take(Waiting& line, std::deque<Task>::iterator task);
  Waiting& lineOf(const Caller& caller);
  Client& clientOf(const std::string& name);
  void forgetIfGone(const std::string& name);
  void count(Place& place, std::size_t bytes);

  const int workers_;
  AdmissionLimits limits_;
  double ageing_ = 10;
  std::map<std::string, Client> clients_;  // that hold a place or have something running
  std::unordered_map<std::uint64_t, Place> places_;
  std::size_t length_ = 0, bytes_ = 0, busy_ = 0, streams_ = 0;
  double mean_seconds_ = 0, served_now_ = 0;
  std::unordered_map<std::string, double> mean_of_kind_;  // [s]
};

}  // namespace shaped::server
