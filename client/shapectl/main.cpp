#include <grpc/support/log.h>

#include <cstdlib>

#include "client/shapectl/command_line.h"
#include "client/shapectl/interrupt.h"
#include "client/shapectl/verbs/verbs.h"
#include "core/numerics/threads.h"

int main(int argc, char** argv) {
  const shaped::shapectl::Interrupt interrupt;
  shaped::limitLibraryThreads();
  // What goes wrong is said once, by us; GRPC_VERBOSITY brings gRPC's own words back.
  if (!std::getenv("GRPC_VERBOSITY")) gpr_set_log_function([](gpr_log_func_args*) {});
  return shaped::shapectl::runCommandLine(argc, argv, shaped::shapectl::allVerbs(), interrupt.token());
}
