#include <unistd.h>

#include <condition_variable>
#include <iostream>
#include <mutex>
#include <optional>

#include "client/admin.h"
#include "client/shapectl/live_screen.h"
#include "client/shapectl/output.h"
#include "client/shapectl/statistics_output.h"
#include "client/shapectl/verbs/verbs.h"
#include "core/numerics/error.h"

namespace shaped::shapectl {
namespace {

using Statistics = v1::GetStatisticsResponse;

/// False when Ctrl-C came first.
bool waitFor(double seconds, const std::stop_token& stop) {
  std::mutex mutex;
  std::condition_variable_any wake;
  std::unique_lock lock(mutex);
  wake.wait_for(lock, stop, std::chrono::duration<double>(seconds), [] { return false; });
  return !stop.stop_requested();
}

struct Top {
  double interval = 1;
  std::int64_t count = 0;

  void declare(Arguments& arguments) {
    arguments.option("--interval", interval, "S", "Time between two looks [s] (1)");
    arguments.option("--count", count, "N", "Looks to take; default: until Ctrl-C at a terminal, else one");
  }

  ExitCode run(const Session& session) const {
    if (!(interval >= 0.05 && interval <= 86400)) throw InvalidInput("--interval", "want 0.05 to 86400 seconds");
    if (count < 0) throw InvalidInput("--count", "= " + std::to_string(count) + ", want 1 or more");
    const auto admin = v1::Admin::NewStub(session.channel());
    const bool live = !session.json && isatty(STDOUT_FILENO) != 0;
    return live ? watch(*admin, session) : print(*admin, session);
  }

  ExitCode print(v1::Admin::Stub& admin, const Session& session) const {
    std::optional<Statistics> before;
    for (std::int64_t i = 0; i == 0 || (i < count && waitFor(interval, session.stop)); ++i) {
      auto now = client::getStatistics(admin, session.callOptions());
      if (session.json) printJson(toJson(now));
      if (!session.json)
        for (const auto& line : screenOf(now, before ? &*before : nullptr, session.connection.server)) std::cout << line << "\n";
      std::cout << std::flush;
      before = std::move(now);
    }
    return ExitCode::kSuccess;
  }

  /// Once it has begun, it waits for a daemon that is gone: restarts are when people look.
  ExitCode watch(v1::Admin::Stub& admin, const Session& session) const {
    std::optional<Statistics> before, now = client::getStatistics(admin, session.callOptions());
    LiveScreen screen;
    std::string problem;
    for (std::int64_t i = 1; !session.stop.stop_requested(); ++i) {
      auto lines = screenOf(*now, before ? &*before : nullptr, session.connection.server);
      if (!problem.empty()) lines.insert(lines.begin(), "NO ANSWER (" + problem + "); what follows is old");
      screen.show(lines);
      if (i == count || !waitFor(interval, session.stop)) break;
      look(admin, session, before, now, problem);
    }
    return ExitCode::kSuccess;
  }

  static void look(v1::Admin::Stub& admin, const Session& session, std::optional<Statistics>& before,
                   std::optional<Statistics>& now, std::string& problem) {
    try {
      auto next = client::getStatistics(admin, session.callOptions());
      before = std::exchange(now, std::move(next));
      problem.clear();
    } catch (const client::RpcError& error) {
      problem = error.what();
    }
  }
};

}  // namespace

Verb topVerb() {
  return makeVerb<Top>("top", "Show what the daemon is doing, live: calls, queues, models, jobs, memory");
}

}  // namespace shaped::shapectl
