#include "server/daemon/grpc_log.h"

#include <grpc/support/log.h>

#include <string>

#include "server/telemetry/call_log.h"

namespace shaped::server {

void takeGrpcLog() {
  gpr_set_log_function([](gpr_log_func_args* entry) { logWarning(std::string("grpc: ") + entry->message); });
}

}  // namespace shaped::server
