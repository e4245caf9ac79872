#pragma once

#include <grpcpp/create_channel.h>

#include "server/daemon/daemon.h"
#include "server/telemetry/call_log.h"
#include "tests/support/temporary_folder.h"

namespace shaped::test {

/// A daemon in this process, on a free port, with an empty store of its own.
class TestDaemon {
 public:
  explicit TestDaemon(server::DaemonOptions options = {}) : daemon(onFreePort(std::move(options), folder)) {}

  std::shared_ptr<grpc::Channel> channel() const {
    return grpc::CreateChannel(daemon.address(), grpc::InsecureChannelCredentials());
  }

  TemporaryFolder folder;
  server::Daemon daemon;

 private:
  static server::DaemonOptions onFreePort(server::DaemonOptions options, const TemporaryFolder& folder) {
    options.listen = "127.0.0.1:0";
    options.store = folder / "store";
    server::startLog("error");  // refusals are what the tests provoke
    return options;
  }
};

}  // namespace shaped::test
