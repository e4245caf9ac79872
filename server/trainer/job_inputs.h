#pragma once

#include <filesystem>
#include <optional>
#include <stop_token>
#include <vector>

#include "server/trainer/job_spec.h"

namespace shaped::server {

/// What a job trains on.
struct JobInputs {
  std::vector<FieldPair> pairs;
  FieldScaling scaling;
  std::string sha256;  ///< of the files that these came from
};

/// Reads the files of a job and makes features of them. Nothing once the stop token has fired. Throws InvalidInput
/// naming the file and what is wrong with it.
std::optional<JobInputs> readJobInputs(const std::filesystem::path& folder, const JobSpec& spec,
                                       const std::stop_token& stop = {});

}  // namespace shaped::server
