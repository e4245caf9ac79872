#pragma once

#include <functional>

#include "server/convert/limits.h"
#include "server/datasets/dataset_store.h"
#include "server/rpc/call.h"
#include "shaped/v1/curves.pb.h"

namespace shaped::server {

/// Curves.Smooth: frames come window by window.
void smooth(const DatasetStore& datasets, const Limits& limits, const v1::SmoothRequest& request,
            const std::function<void(v1::SmoothResponse&&)>& write, Call& call);

/// Curves.Join.
void join(const DatasetStore& datasets, const Limits& limits, const v1::JoinRequest& request,
          const std::function<void(v1::JoinResponse&&)>& write, Call& call);

}  // namespace shaped::server
