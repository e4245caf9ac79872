#pragma once

#include "server/datasets/dataset_store.h"
#include "shaped/v1/datasets.pb.h"

namespace shaped::server {

/// Throws InvalidInput naming `field` for what is no kind.
DatasetKind kindFromProto(v1::DatasetKind kind, const std::string& field);

void toProto(const DatasetInfo& info, v1::Dataset& dataset);

}  // namespace shaped::server
