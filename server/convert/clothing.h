#pragma once

#include <string>
#include <vector>

#include "core/clothing/under_clothing.h"
#include "server/convert/limits.h"
#include "shaped/v1/registration.pb.h"

namespace shaped::server {

/// unit_factor goes into `registration`, for the caller to multiply scans and landmarks with. Throws InvalidInput
/// naming `options`.
ClothingOptions clothingOptionsFromProto(const v1::UnderClothingOptions& message, std::stop_token stop);

/// What scans take in memory: 24 bytes a point, 24 a normal, 12 a face.
std::int64_t scanBytes(const v1::Scan& message);
std::int64_t scanBytes(const Scan& scan);

/// Throws InvalidInput naming `field` when so many scans, of so many bytes together, are more than the limits allow.
void requireClothingFits(std::int64_t frames, std::int64_t bytes, const Limits& limits, const std::string& field);

/// What is particular to the frame, warnings included; shape and coefficients are another's. best_explained: of the
/// frame that explains most of its scan.
void toProto(const ClothedFrame& frame, double best_explained, v1::EstimateUnderClothingResponse::Frame& message);

/// What is to be said of the body as a whole, the gravest first.
std::vector<std::string> warningsOf(const ClothedBody& body);

/// The largest `explained` of its frames; 0 without any.
double bestExplained(const ClothedBody& body);

}  // namespace shaped::server
