#pragma once

#include <optional>
#include <stop_token>
#include <string>

#include "client/connection.h"

namespace shaped::shapectl {

/// What all verbs share: the global options, and the token that Ctrl-C fires.
struct Session {
  client::ConnectionOptions connection;  ///< --server, and who calls
  bool json = false;                     ///< --output json
  std::optional<double> timeout;         ///< of each call [s]
  std::string priority;                  ///< of each call; empty: the daemon's default
  std::stop_token stop;

  /// The channel to the daemon; only verbs that need one call this.
  std::shared_ptr<grpc::Channel> channel() const { return client::connect(connection); }
  client::CallOptions callOptions() const {
    client::CallOptions options{.timeout = {}, .stop = stop};
    options.priority = priority;
    if (timeout) options.timeout = std::chrono::duration<double>(*timeout);
    return options;
  }
};

}  // namespace shaped::shapectl
