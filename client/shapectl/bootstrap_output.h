#pragma once

#include <map>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "shaped/v1/jobs.pb.h"

namespace shaped::shapectl {

/// "joined", "too_far", ...; "pending" where a scan's round has not ended.
std::string nameOf(v1::ScanVerdict verdict);
nlohmann::json toJson(const v1::BootstrapScan& scan);

/// What a bootstrap has left: its rounds, and where the scans went.
class BootstrapOutput {
 public:
  /// Rounds come in order.
  void add(const v1::BootstrapRound& round);
  bool empty() const { return rounds_.empty(); }

  /// {"rounds": [...], "scans": [...], "end": "few_joined"}
  nlohmann::json document() const;
  /// Tables of rounds and of scans, and why it ended. told: the first rounds, which stand there already.
  std::string text(std::size_t told = 0) const;

  static std::string roundHeading();
  /// A line of the table of rounds.
  static std::string roundText(const v1::BootstrapRound& round);

 private:
  std::vector<v1::BootstrapRound> rounds_;
  std::map<std::uint32_t, v1::BootstrapScan> scans_;  ///< as each was tried last
};

}  // namespace shaped::shapectl
