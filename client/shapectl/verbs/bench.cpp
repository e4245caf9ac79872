#include <iostream>

#include "client/shapectl/bench_call.h"
#include "client/shapectl/bench_output.h"
#include "client/shapectl/failure.h"
#include "client/shapectl/numbers.h"
#include "client/shapectl/output.h"
#include "client/shapectl/progress_bar.h"
#include "client/shapectl/verbs/verbs.h"
#include "core/numerics/error.h"

namespace shaped::shapectl {
namespace {

using Channels = std::vector<std::shared_ptr<grpc::Channel>>;

std::chrono::nanoseconds durationOf(const char* option, double seconds, double least) {
  constexpr double most = 86400;
  if (!(seconds >= least && seconds <= most))
    throw InvalidInput(option,
                       "= " + std::to_string(seconds) + ", want " + std::to_string(least) + " to 86400 seconds");
  return std::chrono::duration_cast<std::chrono::nanoseconds>(std::chrono::duration<double>(seconds));
}

struct Bench {
  std::string method, arrivals = "poisson";
  BenchInputs inputs;
  std::optional<double> rate;
  std::int64_t concurrency = 100, connections = 1, seed = 1;
  double seconds = 10, warm_up = 1;

  void declare(Arguments& arguments) {
    arguments.positional("METHOD", method, benchMethods());
    arguments.option("--rate", rate, "R",
                     "Calls per second, sent when due whether earlier ones are answered or not "
                     "(default: each place sends again when it has its answer)");
    arguments.option("--concurrency", concurrency, "N",
                     "Calls in flight at most, over all connections; what is due beyond waits "
                     "for a place, and that counts as its latency (100)");
    arguments.option("--connections", connections, "C",
                     "Connections, used in turn; the daemon takes 100 calls at a time on each (1)");
    arguments.option("--seconds", seconds, "S", "Length of what is measured (10)");
    arguments.option("--warm-up", warm_up, "S", "The same load before it, which is not counted (1)");
    arguments.option("--arrivals", arrivals, "KIND",
                     "poisson, as many independent clients send, or fixed gaps (poisson)");
    arguments.option("--seed", seed, "N", "Of the arrivals (1)");
    arguments.option("--model", inputs.model, "NAME", "The model that is asked, and that the inputs are taken from");
    arguments.option("--mesh", inputs.mesh, "MESH",
                     "Project, score, edit, fit or interpolate to this one, not the model's mean; any mesh for frames");
    arguments.option("--modes", inputs.modes, "J", "Principal variations to use (all)");
    arguments.option("--frames", inputs.frames, "N", "Frames of interpolate, frames and fit (30)");
    arguments.option("--path-steps", inputs.path_steps, "K", "Of interpolate (4)");
  }

  ExitCode run(const Session& session) const {
    auto options = loadOptions(session);
    const auto channels = connected(session);
    const auto call = makeBenchCall(method, inputs, channels.front(), session.callOptions());
    client::tryOnce(channels.front(), call, session.callOptions());
    ProgressBar bar;
    options.progress = [&](double fraction) { bar.show(fraction, method); };
    const auto account = client::generateLoad(channels, call, options);
    print(account, session);
    return exitCodeOf(account, session);
  }

 private:
  client::LoadOptions loadOptions(const Session& session) const {
    if (arrivals != "poisson" && arrivals != "fixed")
      throw InvalidInput("--arrivals", "\"" + arrivals + "\", want poisson or fixed");
    if (rate && !(*rate > 0 && *rate <= 1e6))
      throw InvalidInput("--rate", "= " + std::to_string(*rate) + ", want more than 0 and at most 1000000");
    if (concurrency < 1 || concurrency > 100'000)
      throw InvalidInput("--concurrency", "= " + std::to_string(concurrency) + ", want 1 to 100000");
    if (connections < 1 || connections > 10'000)
      throw InvalidInput("--connections", "= " + std::to_string(connections) + ", want 1 to 10000");
    return {.rate = rate,
            .arrivals = arrivals == "fixed" ? client::Arrivals::Kind::kFixed : client::Arrivals::Kind::kPoisson,
            .seed = static_cast<std::uint64_t>(seed),
            .concurrency = countOf("--concurrency", concurrency),
            .warm_up = durationOf("--warm-up", warm_up, 0),
            .duration = durationOf("--seconds", seconds, 0.01),
            .call = session.callOptions()};
  }

  Channels connected(const Session& session) const {
    Channels channels;
    auto connection = session.connection;
    connection.retries = false;  // a refusal that is tried again behind our back would count as a slow answer
    for (; connection.number < connections; ++connection.number) channels.push_back(client::connect(connection));
    client::connectAll(channels, session.stop);
    return channels;
  }

  void print(const client::LoadAccount& account, const Session& session) const {
    if (!session.json) {
      std::cout << method << ": " << benchText(account);
      return;
    }
    auto document = toJson(account);
    document["method"] = method;
    document["rate"] = rate ? nlohmann::json(*rate) : nlohmann::json();
    document["arrivals"] = rate ? nlohmann::json(arrivals) : nlohmann::json();
    document["concurrency"] = concurrency;
    document["connections"] = connections;
    document["warm_up_seconds"] = warm_up;
    document["timeout_seconds"] = session.timeout ? nlohmann::json(*session.timeout) : nlohmann::json();
    printJson(document);
  }

  /// Errors under load are results; none but errors is a failure.
  static ExitCode exitCodeOf(const client::LoadAccount& account, const Session& session) {
    if (session.stop.stop_requested()) return ExitCode::kCancelled;
    if (account.answered() > 0 || account.errors().empty()) return ExitCode::kSuccess;
    return shapectl::exitCodeOf(account.errors().begin()->first.first);
  }
};

}  // namespace

Verb benchVerb() {
  return makeVerb<Bench>("bench", "Load a daemon with calls and measure how it answers: latency, throughput, refusals");
}

}  // namespace shaped::shapectl
