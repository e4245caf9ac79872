#pragma once

namespace shaped::server {

/// The largest message that the daemon takes or sends [bytes]: a shape of five million vertices.
constexpr int kLargestMessage = 64 << 20;

}  // namespace shaped::server
