#pragma once

#include "core/body/posture.h"
#include "core/model/shape_model.h"
#include "server/convert/limits.h"
#include "server/models/model_store.h"
#include "shaped/v1/model.pb.h"

namespace shaped::server {

/// What the manifest says; eigenvalues are not in it.
void toProto(const ModelStore::Entry& entry, v1::ModelDescription& description);
void toProto(const ModelStore::Standing& standing, v1::ModelDescription& description);
/// Everything but what stands for it.
void toProto(const ServedModel& model, v1::ModelDescription& description);

ModelSelector selectorFromProto(const v1::ModelSelector& message);

/// The numbers as they came; whether they are a point of a model is for the model to say. Throws InvalidInput when they
/// are more than the limits allow, or those of two kinds at once.
ModelPoint coefficientsFromProto(const v1::Coefficients& coefficients, const Limits& limits);
void toProto(const ModelPoint& point, v1::Coefficients& coefficients);
void toProto(const ShapeScore& score, v1::Score& message);

/// Throws InvalidInput naming `field`.
PostureNormalisation postureFromProto(v1::PostureNormalisation posture, const std::string& field);
v1::PostureNormalisation toProto(PostureNormalisation posture);

/// Throws InvalidInput naming `field` when the number is above `most`.
int countFromProto(std::uint32_t value, int most, const std::string& field);

}  // namespace shaped::server
