#include "server/convert/bootstrap.h"

#include "server/convert/report.h"

namespace shaped::server {
namespace {

v1::ScanVerdict toProto(ScanVerdict verdict) {
  switch (verdict) {
    case ScanVerdict::kPending:
      return v1::SCAN_VERDICT_UNSPECIFIED;
    case ScanVerdict::kJoined:
      return v1::SCAN_VERDICT_JOINED;
    case ScanVerdict::kTooFar:
      return v1::SCAN_VERDICT_TOO_FAR;
    case ScanVerdict::kDoubtful:
      return v1::SCAN_VERDICT_DOUBTFUL;
    case ScanVerdict::kFailed:
      return v1::SCAN_VERDICT_FAILED;
    case ScanVerdict::kUnusable:
      return v1::SCAN_VERDICT_UNUSABLE;
  }
  return v1::SCAN_VERDICT_UNSPECIFIED;
}

}  // namespace

void toProto(const BootstrapScan& scan, v1::BootstrapScan& message) {
  message.set_scan(static_cast<std::uint32_t>(scan.scan));
  message.set_name(scan.name);
  message.set_round(static_cast<std::uint32_t>(scan.round));
  toProto(scan.outcome, 0, *message.mutable_report());
  message.set_model_chamfer(scan.model_chamfer);
  message.set_chamfer(scan.chamfer);
  message.set_score(scan.score);
  message.set_verdict(toProto(scan.verdict));
  message.set_why(scan.why);
}

void toProto(const BootstrapRound& round, v1::BootstrapRound& message) {
  message.set_round(static_cast<std::uint32_t>(round.round));
  message.set_registrations(static_cast<std::uint32_t>(round.registrations));
  message.set_field_registrations(static_cast<std::uint32_t>(round.examples));
  message.set_smallest(round.smallest);
  message.set_largest(round.largest);
  message.set_accepted_below(round.accepted_below);
  message.set_joined(static_cast<std::uint32_t>(round.joined));
  for (const auto& scan : round.scans) toProto(scan, *message.add_scans());
}

v1::BootstrapEnd toProto(BootstrapEnd end) {
  switch (end) {
    case BootstrapEnd::kRoundsDone:
      return v1::BOOTSTRAP_END_ROUNDS_DONE;
    case BootstrapEnd::kFewJoined:
      return v1::BOOTSTRAP_END_FEW_JOINED;
    case BootstrapEnd::kNoneLeft:
      return v1::BOOTSTRAP_END_NONE_LEFT;
  }
  return v1::BOOTSTRAP_END_UNSPECIFIED;
}

}  // namespace shaped::server
