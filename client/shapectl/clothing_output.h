#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "client/shapectl/exit_code.h"
#include "shaped/v1/registration.pb.h"

namespace shaped::shapectl {

/// Gathers what EstimateUnderClothing says beside the shapes.
class ClothingOutput {
 public:
  /// Names of the scans, in the order of the frames.
  explicit ClothingOutput(std::vector<std::string> scans) : scans_(std::move(scans)) {}

  void set(const v1::EstimateUnderClothingResponse::Body& body);
  void add(const v1::EstimateUnderClothingResponse::Frame& frame);

  /// How the body ended, and "frames".
  const nlohmann::json& document() const { return document_; }
  /// A line about the body, and a table of the frames.
  std::string text() const;
  /// Success when the identity converged and no posture failed. That a posture was still moving by tenths of a
  /// millimetre when its rounds were over is how most end.
  ExitCode exitCode() const { return code_; }

 private:
  const std::vector<std::string> scans_;
  nlohmann::json document_;
  std::string body_text_, table_, warnings_;
  ExitCode code_ = ExitCode::kSuccess;
};

}  // namespace shaped::shapectl
