#pragma once

#include "server/datasets/dataset_store.h"
#include "shaped/v1/datasets.pb.h"

namespace shaped::server {

void toProto(const DatasetInfo& info, v1::Dataset& dataset);

}  // namespace shaped::server
