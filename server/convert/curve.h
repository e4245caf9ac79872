#pragma once

#include "core/curve/bezier.h"
#include "core/curve/joining.h"
#include "core/curve/long_clip.h"
#include "server/convert/limits.h"
#include "shaped/v1/curves.pb.h"

namespace shaped::server {

/// Throws InvalidInput naming `field`.name where a number is out of its range. vertices: of the mesh, which decide
/// whether the automatic choice is reduced. steps: where the message has none.
SmoothingOptions smoothingFromProto(const v1::FlowOptions& message, Eigen::Index vertices, int steps,
                                    const std::string& field);
GeodesicFlowOptions geodesicFromProto(const v1::GeodesicOptions& message, const std::string& field);

/// One number for all frames or one for each, as the flow wants it: empty, or one for each. Throws InvalidInput naming
/// restore.
std::vector<double> restoreFromProto(const google::protobuf::RepeatedField<double>& restore, std::int64_t frames);
/// Indices of frames as a mask. Throws InvalidInput naming held[i].
std::vector<bool> heldFromProto(const google::protobuf::RepeatedField<std::uint32_t>& held, std::int64_t frames);
/// Empty: none. Throws InvalidInput naming up.
std::optional<Eigen::Vector3d> upFromProto(const google::protobuf::RepeatedField<double>& up);

/// The number; `otherwise` where it is 0. Throws InvalidInput naming `field` when it is outside [least, most].
int numberFromProto(std::uint32_t value, int otherwise, int least, int most, const std::string& field);
/// eta of a request: `otherwise` where it is 0. Throws InvalidInput naming bending.
double bendingFromProto(double bending, double otherwise);

/// Throws InvalidInput naming `field` when so many frames take more memory than a curve may.
void requireCurveFits(std::int64_t frames, std::int64_t vertices, const Limits& limits, const std::string& field);

void toProto(const LongClipReport& report, v1::SmoothSummary& message);
void toProto(const JoinedClips& joined, v1::JoinSummary& message);

}  // namespace shaped::server
