#pragma once

#include "core/mesh/scan.h"
#include "core/registration/landmark.h"
#include "core/registration/scan_registration.h"
#include "server/convert/limits.h"
#include "shaped/v1/registration.pb.h"

namespace shaped::server {

/// field: what errors call it. Throws InvalidInput naming its field and the index: counts that do not fit, more points
/// or faces than the limits allow, an index out of range. Whether the points make a surface is for the core to say.
Scan scanFromProto(const v1::Scan& message, const Limits& limits, const std::string& field = "scan");

/// Places on a model, and where they are on the scan, made metres by `unit_factor`. Throws InvalidInput naming
/// `list`[i]: no place, one that is not of the topology, weights that are not a point of a face, or a position that is
/// not three finite numbers.
std::vector<Landmark> landmarksFromProto(const google::protobuf::RepeatedPtrField<v1::ScanLandmark>& messages,
                                         const Topology& topology, double unit_factor, const Limits& limits,
                                         const std::string& list = "landmarks");

/// Throws InvalidInput naming `options`.
ScanRegistrationOptions registrationOptionsFromProto(const v1::RegistrationOptions& message, std::stop_token stop);

void toProto(const ModelFitReport& report, v1::ScanReport& message);
void toProto(const FittingReport& report, v1::RefinementReport& message);

}  // namespace shaped::server
