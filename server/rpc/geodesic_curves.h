#pragma once

#include <functional>

#include "server/convert/limits.h"
#include "server/datasets/dataset_store.h"
#include "server/models/model_store.h"
#include "server/rpc/call.h"
#include "shaped/v1/curves.pb.h"

namespace shaped::server {

/// Where the connectivity of a request may come from.
struct TopologySources {
  ModelStore& models;
  const DatasetStore& datasets;
  const Limits& limits;
};

/// Curves.Geodesic.
void geodesic(const TopologySources& sources, const v1::GeodesicRequest& request,
              const std::function<void(v1::GeodesicResponse&&)>& write, Call& call);

/// Curves.Bezier.
void bezier(const TopologySources& sources, const v1::BezierRequest& request,
            const std::function<void(v1::BezierResponse&&)>& write, Call& call);

}  // namespace shaped::server
