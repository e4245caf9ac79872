#include "server/daemon/options.h"

#include <algorithm>

#include "core/io/text_scanner.h"
#include "core/numerics/error.h"
#include "server/daemon/preload_list.h"
#include "server/telemetry/call_log.h"

namespace shaped::server {
namespace {

constexpr const char *kExplicit = "explicit", *kWatch = "watch";

enum class When { kAtStart, kWhileRunning };

template <class Access>
OptionSpec textOption(std::string name, std::string value_name, When when, Access access, std::string help) {
  return {std::move(name),
          std::move(value_name),
          std::move(help),
          when == When::kWhileRunning,
          [access](DaemonOptions& options, const std::string&, const std::string& value) { access(options) = value; },
          [access](DaemonOptions options) -> std::string { return access(options); }};
}

/// A number from least to most.
template <class Access>
OptionSpec numberOption(std::string name, std::string value_name, When when, double least, double most, Access access,
                        std::string help) {
  const auto set = [=](DaemonOptions& options, const std::string& where, const std::string& text) {
    double value = 0;
    if (!parseNumber(text, value) || !(value >= least && value <= most))
      throw InvalidInput(where, "\"" + text + "\", want a number from " + shortest(least) + " to " + shortest(most));
    access(options) = value;
  };
  return {std::move(name),
          std::move(value_name),
          std::move(help),
          when == When::kWhileRunning,
          set,
          [access](DaemonOptions options) { return shortest(access(options)); }};
}

/// A whole number from 1 to most, in units of `unit`.
template <class Access>
OptionSpec countOption(std::string name, std::string value_name, When when, std::int64_t most, Access access,
                       std::string help, std::int64_t unit = 1) {
  const auto set = [=](DaemonOptions& options, const std::string& where, const std::string& text) {
    std::int64_t value = 0;
    if (!parseInteger(text, value) || value < 1 || value > most)
      throw InvalidInput(where, "\"" + text + "\", want a whole number from 1 to " + std::to_string(most));
    auto& member = access(options);
    member = static_cast<std::remove_reference_t<decltype(member)>>(value * unit);
  };
  return {std::move(name),
          std::move(value_name),
          std::move(help),
          when == When::kWhileRunning,
          set,
          [=](DaemonOptions options) { return std::to_string(static_cast<std::int64_t>(access(options)) / unit); }};
}

OptionSpec logLevelOption() {
  auto option = textOption(
      "log", "LEVEL", When::kWhileRunning, [](auto& o) -> auto& { return o.log; },
      "debug, info, warn or error, to stderr");
  option.set = [](DaemonOptions& options, const std::string& where, const std::string& value) {
    requireLogLevel(value, where);
    options.log = value;
  };
  return option;
}

/// The address once more: this way of giving it is the consent to an open network.
OptionSpec listenInsecurelyOption() {
  return {"listen-insecurely",
          "HOST:PORT",
          "as --listen, but without TLS on any address: where the network itself is secured",
          false,
          [](DaemonOptions& options, const std::string&, const std::string& value) {
            options.security.anywhere = !value.empty();
            if (!value.empty()) options.listen = value;
          },
          [](const DaemonOptions& options) { return options.security.anywhere ? options.listen : std::string(); }};
}

OptionSpec preloadOption() {
  auto option = textOption(
      "preload", "NAME,...", When::kAtStart, [](auto& o) -> auto& { return o.preload; },
      "models to have in memory before health says SERVING: NAME, NAME@VERSION, NAME@LABEL, or all");
  option.set = [](DaemonOptions& options, const std::string& where, const std::string& value) {
    preloadListFrom(where, value);
    options.preload = value;
  };
  return option;
}

OptionSpec modelPolicyOption() {
  return {"model-policy",
          "POLICY",
          "explicit: versions that others put into the store count once they are loaded; watch: as they appear",
          false,
          [](DaemonOptions& options, const std::string& where, const std::string& value) {
            if (value != kExplicit && value != kWatch)
              throw InvalidInput(where, "\"" + value + "\", want " + kExplicit + " or " + kWatch);
            options.watch_models = value == kWatch;
          },
          [](const DaemonOptions& options) { return std::string(options.watch_models ? kWatch : kExplicit); }};
}

OptionSpec logFormatOption() {
  auto option = textOption(
      "log-format", "FORMAT", When::kAtStart, [](auto& o) -> auto& { return o.log_format; },
      "text, or json: one object a line");
  option.set = [](DaemonOptions& options, const std::string& where, const std::string& value) {
    requireLogFormat(value, where);
    options.log_format = value;
  };
  return option;
}

constexpr std::int64_t kMostCount = 1 << 20;
constexpr std::int64_t kMostMegabytes = std::int64_t{1} << 30;
constexpr double kMostSeconds = 1e6;
constexpr std::int64_t kMostVertices = 100'000'000;

std::vector<OptionSpec> servingOptions() {
  return {
      textOption(
          "listen", "HOST:PORT", When::kAtStart, [](auto& o) -> auto& { return o.listen; },
          "address to serve on, port 0 for any free one; unix:PATH works too"),
      textOption(
          "store", "DIR", When::kAtStart, [](auto& o) -> auto& { return o.store; },
          "folder of models, datasets and jobs, made when missing"),
      countOption(
          "threads", "N", When::kAtStart, 1024, [](auto& o) -> auto& { return o.threads; },
          "solver threads, and threads of the job that runs; all processors where not given"),
      numberOption(
          "longest-call", "S", When::kWhileRunning, 0.001, kMostSeconds,
          [](auto& o) -> auto& { return o.longest_call; },
          "cap on a call, and on a stream's time between messages [s]"),
      numberOption(
          "write-patience", "S", When::kAtStart, 0.001, kMostSeconds, [](auto& o) -> auto& { return o.write_patience; },
          "how long a stream waits for a client that takes no more [s]"),
  };
}

std::vector<OptionSpec> jobOptions() {
  return {
      numberOption(
          "publish-patience", "S", When::kAtStart, 0, kMostSeconds, [](auto& o) -> auto& { return o.publish_patience; },
          "how long a trained model waits for room on a full disk [s]"),
      numberOption(
          "checkpoint-every", "S", When::kAtStart, 0, kMostSeconds, [](auto& o) -> auto& { return o.checkpoint_every; },
          "time between two checkpoints of a running job [s]"),
      countOption(
          "job-crashes", "N", When::kAtStart, kMostCount, [](auto& o) -> auto& { return o.job_crashes; },
          "crashes over one job without a checkpoint in between until it is given up"),
      countOption(
          "keep-jobs", "N", When::kAtStart, kMostCount, [](auto& o) -> auto& { return o.keep_jobs; },
          "ended jobs that are remembered"),
      numberOption(
          "keep-jobs-days", "D", When::kAtStart, 0, 36500, [](auto& o) -> auto& { return o.keep_jobs_days; },
          "for at most so many days; 0: whatever their age"),
      countOption(
          "keep-results-megabytes", "N", When::kAtStart, kMostMegabytes,
          [](auto& o) -> auto& { return o.keep_results; },
          "results of jobs, all together; the oldest are forgotten with their jobs [MiB]", 1 << 20),
      textOption(
          "trainer", "FILE", When::kAtStart, [](auto& o) -> auto& { return o.trainer; },
          "the program that trains the fields of bootstraps; shaped-trainer beside this program where not given"),
  };
}

std::vector<OptionSpec> stopOptions() {
  return {
      numberOption(
          "drain", "S", When::kWhileRunning, 0, kMostSeconds, [](auto& o) -> auto& { return o.drain; },
          "asked to stop: how long it still answers while health says NOT_SERVING [s]"),
      numberOption(
          "grace", "S", When::kWhileRunning, 0, kMostSeconds, [](auto& o) -> auto& { return o.grace; },
          "then: how long running calls may go on before they are cancelled [s]"),
  };
}

std::vector<OptionSpec> admissionOptions() {
  return {
      countOption(
          "queue-length", "N", When::kWhileRunning, kMostCount,
          [](auto& o) -> auto& { return o.admission.queue_length; }, "requests that may wait for a solver thread"),
      countOption(
          "in-flight-megabytes", "N", When::kWhileRunning, kMostCount,
          [](auto& o) -> auto& { return o.admission.bytes_in_flight; },
          "messages of requests that wait or run, together [MiB]", 1 << 20),
      countOption(
          "open-streams", "N", When::kWhileRunning, kMostCount,
          [](auto& o) -> auto& { return o.admission.open_streams; }, "streams at a time"),
      countOption(
          "client-requests", "N", When::kWhileRunning, kMostCount,
          [](auto& o) -> auto& { return o.admission.client_requests; }, "requests of one client that wait or run"),
      countOption(
          "client-megabytes", "N", When::kWhileRunning, kMostCount,
          [](auto& o) -> auto& { return o.admission.client_bytes; }, "their messages together [MiB]", 1 << 20),
      countOption(
          "client-streams", "N", When::kWhileRunning, kMostCount,
          [](auto& o) -> auto& { return o.admission.client_streams; }, "streams of one client at a time"),
      numberOption(
          "ageing", "S", When::kWhileRunning, 0.001, kMostSeconds, [](auto& o) -> auto& { return o.ageing; },
          "how long a request waits until it counts as of the next priority [s]"),
  };
}

std::vector<OptionSpec> limitOptions() {
  return {
      countOption(
          "model-megabytes", "N", When::kAtStart, kMostCount, [](auto& o) -> auto& { return o.models.memory_budget; },
          "memory for models; those that no request holds are dropped at need [MiB]", 1 << 20),
      preloadOption(),
      modelPolicyOption(),
      countOption(
          "max-vertices", "N", When::kAtStart, kMostVertices, [](auto& o) -> auto& { return o.limits.vertices; },
          "largest mesh that is taken"),
      countOption(
          "max-faces", "N", When::kAtStart, 2 * kMostVertices, [](auto& o) -> auto& { return o.limits.faces; },
          "its faces"),
      countOption(
          "max-frames", "N", When::kAtStart, 1'000'000'000, [](auto& o) -> auto& { return o.limits.frames; },
          "largest dataset that is taken"),
      countOption(
          "max-message-megabytes", "N", When::kAtStart, 1024, [](auto& o) -> auto& { return o.limits.message_bytes; },
          "largest message, either way [MiB]", 1 << 20),
      countOption(
          "max-job-megabytes", "N", When::kAtStart, kMostMegabytes, [](auto& o) -> auto& { return o.limits.job_bytes; },
          "most that is sent for one job, and largest result of one [MiB]", 1 << 20),
      countOption(
          "max-curve-megabytes", "N", When::kAtStart, kMostMegabytes,
          [](auto& o) -> auto& { return o.limits.curve_bytes; },
          "frames that a curve may hold in memory at once; the work takes about five times as much [MiB]", 1 << 20),
      countOption(
          "max-clothing-megabytes", "N", When::kAtStart, kMostMegabytes,
          [](auto& o) -> auto& { return o.limits.clothing_bytes; },
          "scans that one estimate under clothing may hold in memory; the work takes about six times as much [MiB]",
          1 << 20),
      countOption(
          "max-upload-megabytes", "N", When::kAtStart, kMostCount,
          [](auto& o) -> auto& { return o.limits.upload_bytes; }, "largest model that an upload may bring [MiB]",
          1 << 20),
  };  // namespace
}  // namespace shaped::server

std::vector<OptionSpec> securityOptions() {
  return {
      textOption(
          "tls-cert", "FILE", When::kAtStart, [](auto& o) -> auto& { return o.security.certificates.chain; },
          "certificate chain of the daemon, PEM; with tls-key: serve over TLS. Without, on the loopback only"),
      textOption(
          "tls-key", "FILE", When::kAtStart, [](auto& o) -> auto& { return o.security.certificates.key; },
          "its private key, PEM"),
      textOption(
          "tls-client-ca", "FILE", When::kAtStart, [](auto& o) -> auto& { return o.security.certificates.client_ca; },
          "serve only clients with a certificate of these authorities, PEM"),
      textOption(
          "tokens", "FILE", When::kAtStart, [](auto& o) -> auto& { return o.security.tokens; },
          "serve only clients that this file knows, each as far as its roles allow"),
      listenInsecurelyOption(),
  };
}

std::vector<OptionSpec> telemetryOptions() {
  return {
      logLevelOption(),
      logFormatOption(),
      textOption(
          "metrics", "HOST:PORT", When::kAtStart, [](auto& o) -> auto& { return o.metrics; },
          "serves /metrics, /healthz and /readyz over HTTP, to whoever reaches it; off where not given"),
  };
}

}  // namespace

const std::vector<OptionSpec>& optionSpecs() {
  static const auto specs = [] {
    std::vector<OptionSpec> all;
    for (auto* group :
         {servingOptions, jobOptions, stopOptions, admissionOptions, limitOptions, securityOptions, telemetryOptions})
      for (auto& spec : group()) all.push_back(std::move(spec));
    return all;
  }();
  return specs;
}

void setOptions(const std::vector<GivenOption>& given, DaemonOptions& options) {
  const auto& specs = optionSpecs();
  for (const auto& [where, name, value] : given) {
    const auto spec =
        std::find_if(specs.begin(), specs.end(), [&name = name](const auto& one) { return one.name == name; });
    if (spec == specs.end()) throw InvalidInput(where, "is no option of shaped; see shaped --help");
    spec->set(options, where, value);
  }
}

}  // namespace shaped::server
