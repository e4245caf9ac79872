#include "server/models/kind.h"

#include "core/model/shell_pga_file.h"
#include "core/model/shell_pga_shapes.h"
#include "server/errors/errors.h"

namespace shaped::server {
namespace {

template <class Shapes>
const Shapes& of(const char* kind, const std::string& what, const ServedModel& served) {
  if (const auto* shapes = dynamic_cast<const Shapes*>(served.shapes.get())) return *shapes;
  throw WrongState("model " + served.name + " version " + std::to_string(served.version) + " is of kind \"" +
                   served.shapes->kind() + "\", and " + what + " needs one of kind \"" + kind + "\"");
}

}  // namespace

const ShellPgaModel& shellPgaFor(const std::string& what, const ServedModel& served) {
  return *of<ShellPgaShapes>(kShellPgaKind, what, served).model();
}

const BodyShapes& bodyFor(const std::string& what, const ServedModel& served) {
  return of<BodyShapes>(kBodyKind, what, served);
}

}  // namespace shaped::server
