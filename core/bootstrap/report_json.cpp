#include "core/bootstrap/report_json.h"

#include <array>
#include <nlohmann/json.hpp>

#include "core/io/json_fields.h"
#include "core/numerics/error.h"

namespace shaped {
namespace {

using nlohmann::json;

constexpr std::array kVerdicts{ScanVerdict::kPending,  ScanVerdict::kJoined, ScanVerdict::kTooFar,
                               ScanVerdict::kDoubtful, ScanVerdict::kFailed, ScanVerdict::kUnusable};
constexpr std::array kTerminations{Termination::kConverged, Termination::kIterationLimit, Termination::kStalled,
                                   Termination::kCancelled, Termination::kNumericalFailure};

/// The value of that name.
template <class Values>
auto named(const Values& values, const std::string& text) {
  for (const auto value : values)
    if (name(value) == text) return value;
  throw InvalidInput("report", "has \"" + text + "\", which is none of the words it could be");
}

json toJson(const BootstrapScan& scan) {
  return {{"scan", scan.scan},
          {"name", scan.name},
          {"round", scan.round},
          {"termination", name(scan.outcome.termination)},
          {"iterations", scan.outcome.iterations},
          {"residual", scan.outcome.residual},
          {"model_chamfer", scan.model_chamfer},
          {"chamfer", scan.chamfer},
          {"score", scan.score},
          {"verdict", name(scan.verdict)},
          {"why", scan.why}};
}

BootstrapScan scanFrom(const json& object) {
  BootstrapScan scan;
  object.at("scan").get_to(scan.scan);
  object.at("name").get_to(scan.name);
  object.at("round").get_to(scan.round);
  scan.outcome.termination = named(kTerminations, object.at("termination").get<std::string>());
  object.at("iterations").get_to(scan.outcome.iterations);
  object.at("residual").get_to(scan.outcome.residual);
  object.at("model_chamfer").get_to(scan.model_chamfer);
  object.at("chamfer").get_to(scan.chamfer);
  object.at("score").get_to(scan.score);
  scan.verdict = named(kVerdicts, object.at("verdict").get<std::string>());
  object.at("why").get_to(scan.why);
  return scan;
}

json toJson(const BootstrapRound& round) {
  auto scans = json::array();
  for (const auto& scan : round.scans) scans.push_back(toJson(scan));
  return {{"round", round.round},
          {"registrations", round.registrations},
          {"smallest", round.smallest},
          {"largest", round.largest},
          {"accepted_below", round.accepted_below},
          {"examples", round.examples},
          {"joined", round.joined},
          {"scans", std::move(scans)}};
}

BootstrapRound roundFrom(const json& object) {
  BootstrapRound round;
  object.at("round").get_to(round.round);
  object.at("registrations").get_to(round.registrations);
  object.at("smallest").get_to(round.smallest);
  object.at("largest").get_to(round.largest);
  object.at("accepted_below").get_to(round.accepted_below);
  object.at("examples").get_to(round.examples);
  object.at("joined").get_to(round.joined);
  for (const auto& scan : object.at("scans")) round.scans.push_back(scanFrom(scan));
  return round;
}

template <class Item>
std::string textOfAll(const std::vector<Item>& items) {
  auto list = json::array();
  for (const auto& item : items) list.push_back(toJson(item));
  return list.dump(-1, ' ', false, json::error_handler_t::replace);
}

template <class Item>
std::vector<Item> allFrom(const std::string& text, Item (*from)(const json&)) try {
  std::vector<Item> items;
  for (const auto& item : parseJson("report", text)) items.push_back(from(item));
  return items;
} catch (const json::exception& problem) {
  throw InvalidInput("report", problem.what());
}

}  // namespace

std::string textOf(const std::vector<BootstrapScan>& scans) { return textOfAll(scans); }
std::string textOf(const std::vector<BootstrapRound>& rounds) { return textOfAll(rounds); }
std::vector<BootstrapScan> scansFrom(const std::string& text) { return allFrom(text, &scanFrom); }
std::vector<BootstrapRound> roundsFrom(const std::string& text) { return allFrom(text, &roundFrom); }

}  // namespace shaped
