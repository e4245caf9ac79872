#include "client/shapectl/bootstrap_output.h"

#include <algorithm>
#include <cstdio>

#include "client/shapectl/output.h"

namespace shaped::shapectl {
namespace {

/// The name of a value of an enumeration, without what all its values begin with, in lower case.
std::string shortName(const std::string& name, std::string_view prefix) {
  std::string text = name.substr(std::min(prefix.size(), name.size()));
  std::transform(text.begin(), text.end(), text.begin(), [](unsigned char c) { return std::tolower(c); });
  return text;
}

std::string nameOf(v1::BootstrapEnd end) { return shortName(v1::BootstrapEnd_Name(end), "BOOTSTRAP_END_"); }

std::string endText(v1::BootstrapEnd end) {
  switch (end) {
    case v1::BOOTSTRAP_END_ROUNDS_DONE:
      return "all rounds are done";
    case v1::BOOTSTRAP_END_FEW_JOINED:
      return "too few scans joined for another round";
    case v1::BOOTSTRAP_END_NONE_LEFT:
      return "no scan is left";
    default:
      return "not known";
  }
}

nlohmann::json toJson(const v1::BootstrapRound& round) {
  nlohmann::json document{{"round", round.round()},
                          {"registrations", round.registrations()},
                          {"field_registrations", round.field_registrations()},
                          {"tried", round.scans_size()},
                          {"joined", round.joined()},
                          {"smallest", round.smallest()},
                          {"largest", round.largest()},
                          {"accepted_below", round.accepted_below()},
                          {"scans", nlohmann::json::array()}};
  for (const auto& scan : round.scans()) document["scans"].push_back(shapectl::toJson(scan));
  return document;
}

std::string scanText(const v1::BootstrapScan& scan, int name_width) {
  const bool joined = scan.verdict() == v1::SCAN_VERDICT_JOINED;
  char numbers[320];
  std::snprintf(numbers, sizeof numbers, "  %-*.200s  %-8s  round %-3u  %9.2f mm  score %.2f", name_width,
                scan.name().c_str(), shapectl::nameOf(scan.verdict()).c_str(), scan.round(), 1000 * scan.chamfer(),
                scan.score());
  return numbers + (joined || scan.why().empty() ? "" : "  " + scan.why()) + "\n";
}

}  // namespace

std::string nameOf(v1::ScanVerdict verdict) {
  if (verdict == v1::SCAN_VERDICT_UNSPECIFIED) return "pending";
  return shortName(v1::ScanVerdict_Name(verdict), "SCAN_VERDICT_");
}

nlohmann::json toJson(const v1::BootstrapScan& scan) {
  nlohmann::json document{{"scan", scan.scan()},
                          {"name", scan.name()},
                          {"round", scan.round()},
                          {"model_chamfer", scan.model_chamfer()},
                          {"chamfer", scan.chamfer()},
                          {"score", scan.score()},
                          {"verdict", nameOf(scan.verdict())},
                          {"why", scan.why()}};
  addReport(document, scan.report());
  document.erase("seconds");  // nobody measured them
  return document;
}

void BootstrapOutput::add(const v1::BootstrapRound& round) {
  rounds_.push_back(round);
  for (const auto& scan : round.scans()) scans_[scan.scan()] = scan;
}

nlohmann::json BootstrapOutput::document() const {
  nlohmann::json document{{"rounds", nlohmann::json::array()}, {"scans", nlohmann::json::array()}};
  for (const auto& round : rounds_) document["rounds"].push_back(toJson(round));
  for (const auto& [index, scan] : scans_) document["scans"].push_back(toJson(scan));
  document["end"] = rounds_.empty() ? "" : nameOf(rounds_.back().end());
  return document;
}

std::string BootstrapOutput::text(std::size_t told) const {
  std::string text = told == 0 ? roundHeading() : "";
  for (auto i = told; i < rounds_.size(); ++i) text += roundText(rounds_[i]);
  int width = 4;
  for (const auto& [index, scan] : scans_) width = std::max(width, static_cast<int>(scan.name().size()));
  width = std::min(width, 40);
  text += "scans\n";
  for (const auto& [index, scan] : scans_) text += scanText(scan, width);
  if (!rounds_.empty()) text += "ended because " + endText(rounds_.back().end()) + "\n";
  return text;
}

std::string BootstrapOutput::roundHeading() {
  return "round  shapes  for the field  tried  joined  chamfer distance: smallest, joining to, largest\n";
}

std::string BootstrapOutput::roundText(const v1::BootstrapRound& round) {
  char line[200];
  std::snprintf(line, sizeof line, "%5u  %6u  %13u  %5d  %6u  %26.2f  %10.2f  %7.2f mm\n", round.round(),
                round.registrations(), round.field_registrations(), round.scans_size(), round.joined(),
                1000 * round.smallest(), 1000 * round.accepted_below(), 1000 * round.largest());
  return line;
}

}  // namespace shaped::shapectl
