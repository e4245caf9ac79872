#pragma once

#include <stop_token>

#include "client/shapectl/verb.h"

namespace shaped::shapectl {

/// Parses the command line against the verbs, runs the one that was named and turns every failure into an exit code and
/// a message: on stderr as text, on stdout as {"error": ...} with --output json.
int runCommandLine(int argc, char** argv, const std::vector<Verb>& verbs, std::stop_token stop);

}  // namespace shaped::shapectl
