#include "server/daemon/grpc_log.h"

#include <google/protobuf/stubs/logging.h>
#include <grpc/support/log.h>

#include <string>

#include "server/telemetry/call_log.h"

namespace shaped::server {

void takeGrpcLog() {
  // What it says of clients' bytes, their answer and the log say too; it would write past the queue.
  google::protobuf::SetLogHandler(nullptr);
  gpr_set_log_function([](gpr_log_func_args* entry) { logWarning(std::string("grpc: ") + entry->message); });
}

}  // namespace shaped::server
