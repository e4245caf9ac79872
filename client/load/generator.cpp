#include "client/load/generator.h"

#include <sys/prctl.h>

#include <condition_variable>
#include <mutex>
#include <thread>

#include "client/load/flight.h"
#include "core/numerics/error.h"

namespace shaped::client {
namespace {

using Clock = std::chrono::steady_clock;
using std::chrono::nanoseconds;

constexpr std::chrono::milliseconds kGlance{50};  // how often the sender looks for a stop while it waits

/// The kernel may otherwise wake a sleeper 50 us late, which would count as latency.
void wakePunctually() { prctl(PR_SET_TIMERSLACK, 1, 0, 0, 0); }

/// Places for calls in flight.
class Places {
 public:
  explicit Places(std::uint32_t count) : free_(count), all_(count) {}

  /// False when none was free until then.
  bool take(Clock::time_point until) {
    std::unique_lock lock(mutex_);
    if (!changed_.wait_until(lock, until, [this] { return free_ > 0; })) return false;
    --free_;
    return true;
  }
  void release() {
    const std::scoped_lock lock(mutex_);
    ++free_;
    changed_.notify_one();
  }
  void waitUntilAllAreFree() {
    std::unique_lock lock(mutex_);
    changed_.wait(lock, [this] { return free_ == all_; });
  }

 private:
  std::mutex mutex_;
  std::condition_variable changed_;
  std::uint32_t free_;
  const std::uint32_t all_;
};

/// One run: sends on the thread that calls run(), hears on one of its own, which alone keeps the books meanwhile.
class Run {
 public:
  Run(const std::vector<std::shared_ptr<grpc::Channel>>& channels, const LoadCall& call, const LoadOptions& options)
      : call_(call),
        options_(options),
        end_(options.warm_up + options.duration),
        places_(options.concurrency),
        account_(options.warm_up, options.duration, deadlineOf(options)) {
    for (const auto& channel : channels) stubs_.emplace_back(channel);
  }

  LoadAccount run() {
    std::thread listener([this] { listen(); });
    wakePunctually();
    options_.rate ? sendOnTime(Arrivals(options_.arrivals, *options_.rate, options_.seed)) : sendWhenFree();
    places_.waitUntilAllAreFree();
    queue_.Shutdown();
    listener.join();
    for (const auto intended : unsent_) account_.recordUnsent(intended);
    return std::move(account_);
  }

 private:
  static std::optional<nanoseconds> deadlineOf(const LoadOptions& options) {
    if (!options.call.timeout) return std::nullopt;
    return std::chrono::duration_cast<nanoseconds>(*options.call.timeout);
  }

  nanoseconds now() const { return Clock::now() - start_; }
  bool stopped() const { return options_.call.stop.stop_requested(); }

  void sendOnTime(Arrivals arrivals) {
    auto intended = arrivals.next();
    for (; intended < end_ && !stopped(); intended = arrivals.next()) {
      if (!sleepUntil(intended) || !takePlace()) break;
      send(intended);
    }
    // After Ctrl-C, what was still to come is nobody's fault.
    const auto due = std::min(end_, now());
    for (; intended < due; intended = arrivals.next()) unsent_.push_back(intended);
  }

  void sendWhenFree() {
    while (now() < end_ && !stopped() && takePlace()) send(now());
  }

  /// False after a stop.
  bool sleepUntil(nanoseconds time) {
    for (auto left = time - now(); left > nanoseconds(0) && !stopped(); left = time - now()) {
      std::this_thread::sleep_for(std::min<nanoseconds>(left, kGlance));
      tellProgress();
    }
    return !stopped();
  }

  /// False after a stop, or when the run is over.
  bool takePlace() {
    while (now() < end_ && !stopped()) {
      tellProgress();
      if (places_.take(std::min(start_ + end_, Clock::now() + kGlance))) return true;
    }
    return false;
  }

  void tellProgress() {
    if (!options_.progress || now() < told_ + kGlance) return;
    told_ = now();
    options_.progress(static_cast<double>(told_.count()) / static_cast<double>(end_.count()));
  }

  void send(nanoseconds intended) {
    auto& stub = stubs_[next_stub_++ % stubs_.size()];
    const auto sent = now();
    Flight::start(stub, call_, options_.call, queue_, [this, intended, sent](CallOutcome outcome, const grpc::Status&) {
      outcome.intended = intended;
      outcome.sent = sent;
      outcome.ended = now();
      account_.record(outcome);
      places_.release();
    });
  }

  void listen() {
    void* tag = nullptr;
    bool ok = false;
    while (queue_.Next(&tag, &ok)) Flight::deliver(tag, ok);
  }

  const LoadCall& call_;
  const LoadOptions& options_;
  const nanoseconds end_;
  std::vector<grpc::GenericStub> stubs_;
  grpc::CompletionQueue queue_;
  Places places_;
  LoadAccount account_;
  std::vector<nanoseconds> unsent_;
  const Clock::time_point start_ = Clock::now();
  nanoseconds told_{};
  std::size_t next_stub_ = 0;
};

void check(const LoadOptions& options) {
  constexpr std::uint32_t most = 100'000;
  if (options.concurrency < 1 || options.concurrency > most)
    throw InvalidInput("concurrency", "= " + std::to_string(options.concurrency) + ", want 1 to 100000");
  if (options.duration <= nanoseconds(0) || options.warm_up < nanoseconds(0))
    throw InvalidInput("duration", "want more than 0 seconds, and 0 or more to warm up");
}

}  // namespace

void connectAll(const std::vector<std::shared_ptr<grpc::Channel>>& channels, const std::stop_token& stop) {
  constexpr std::chrono::seconds patience{20};
  const auto until = std::chrono::system_clock::now() + patience;
  for (const auto& channel : channels) {
    auto state = channel->GetState(true);
    for (; state != GRPC_CHANNEL_READY; state = channel->GetState(true)) {
      if (stop.stop_requested()) throw RpcError(grpc::Status(grpc::CANCELLED, "stopped while connecting"));
      if (state == GRPC_CHANNEL_TRANSIENT_FAILURE || std::chrono::system_clock::now() > until)
        throw RpcError(grpc::Status(grpc::UNAVAILABLE, "cannot connect"));
      channel->WaitForStateChange(state, std::chrono::system_clock::now() + kGlance);
    }
  }
}

void tryOnce(const std::shared_ptr<grpc::Channel>& channel, const LoadCall& call, const CallOptions& options) {
  grpc::GenericStub stub(channel);
  grpc::CompletionQueue queue;
  grpc::Status answer;
  Flight::start(stub, call, options, queue, [&](const CallOutcome&, const grpc::Status& status) {
    answer = status;
    queue.Shutdown();
  });
  void* tag = nullptr;
  for (bool ok = false; queue.Next(&tag, &ok);) Flight::deliver(tag, ok);
  require(answer);
}

LoadAccount generateLoad(const std::vector<std::shared_ptr<grpc::Channel>>& channels, const LoadCall& call,
                         const LoadOptions& options) {
  check(options);
  return Run(channels, call, options).run();
}

}  // namespace shaped::client
