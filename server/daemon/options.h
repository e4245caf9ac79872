#pragma once

#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "server/convert/limits.h"
#include "server/models/model_store.h"
#include "server/scheduling/admission.h"
#include "server/security/security.h"

namespace shaped::server {

struct DaemonOptions {
  std::string listen = "127.0.0.1:50051";  ///< host:port, port 0 for any free one, or unix:PATH
  std::filesystem::path store;             ///< models, datasets and jobs; made when missing
  int threads = 1;                         ///< of the solvers, and of the job that runs, 1 .. 1024
  double longest_call = 600;               ///< cap on a call, and on a stream's time between messages [s], > 0
  double publish_patience = 300;           ///< how long a trained model waits for room on a full disk [s], >= 0
  double checkpoint_every = 10;            ///< time between two checkpoints of a running job [s], >= 0
  int job_crashes = 3;                     ///< crashes without a checkpoint in between that end a job, >= 1
  std::size_t keep_jobs = 1000;            ///< ended jobs that are remembered, >= 1
  double keep_jobs_days = 90;              ///< for at most so long [d], >= 0; 0: whatever their age
  std::int64_t keep_results = std::int64_t{10} << 30;  ///< bytes of all results of batch jobs together, >= 1
  std::filesystem::path trainer;                       ///< the program shaped-trainer; empty: beside this one
  double drain = 0;            ///< asked to stop: how long it still answers, NOT_SERVING [s], >= 0
  double grace = 5;            ///< then: how long running calls may go on [s], >= 0
  double write_patience = 60;  ///< how long a stream waits for a client to take a message [s], > 0
  AdmissionLimits admission;
  double ageing = 10;  ///< how long a request waits until it counts as of the next priority [s], > 0
  SecurityOptions security;
  Limits limits;  ///< of requests
  ModelStoreOptions models;
  std::string preload;              ///< as preloadListFrom takes it; empty: none
  bool watch_models = false;        ///< take over what other processes change in the store
  std::string log = "info";         ///< debug, info, warn, error
  std::string log_format = "text";  ///< text, json
  std::string metrics;              ///< host:port of the scrape's HTTP; empty: none
};

/// One option: `--name VALUE` on the command line, `name: value` in the configuration file.
struct OptionSpec {
  std::string name, value_name, help;
  bool while_running;  ///< whether a changed value takes effect when the configuration is read again
  /// Takes the value's text; throws InvalidInput naming `where` when it is none of the option.
  std::function<void(DaemonOptions&, const std::string& where, const std::string& value)> set;
  /// The value as set() would take it.
  std::function<std::string(const DaemonOptions&)> show;
};

/// All options, in the order in which --help lists them.
const std::vector<OptionSpec>& optionSpecs();

/// An option's value and where it stands: "--threads", or "shaped.yaml:3: threads".
struct GivenOption {
  std::string where, name, value;
};

/// Sets the options in order, so that a later one counts. Throws InvalidInput for an unknown name or a bad value.
void setOptions(const std::vector<GivenOption>& given, DaemonOptions& options);

}  // namespace shaped::server
