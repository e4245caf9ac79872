#pragma once

#include <google/protobuf/timestamp.pb.h>

#include <chrono>

namespace shaped::server {

inline void toProto(std::chrono::system_clock::time_point time, google::protobuf::Timestamp& stamp) {
  const auto nanoseconds = std::chrono::duration_cast<std::chrono::nanoseconds>(time.time_since_epoch()).count();
  stamp.set_seconds(nanoseconds / 1'000'000'000);
  stamp.set_nanos(static_cast<std::int32_t>(nanoseconds % 1'000'000'000));
}

}  // namespace shaped::server
