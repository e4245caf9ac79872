#include "client/shapectl/command_line.h"
#include "client/shapectl/interrupt.h"
#include "client/shapectl/verbs/verbs.h"
#include "core/numerics/threads.h"

int main(int argc, char** argv) {
  const shaped::shapectl::Interrupt interrupt;
  shaped::limitLibraryThreads();
  return shaped::shapectl::runCommandLine(argc, argv, shaped::shapectl::allVerbs(), interrupt.token());
}
