#pragma once

#include "core/model/body_shapes.h"
#include "core/model/shell_pga_model.h"
#include "server/models/served_model.h"

namespace shaped::server {

/// The model as one of the kind that alone can do `what` ("Shapes.Edit"). Throw WrongState naming the model and its
/// kind when it is another.
const ShellPgaModel& shellPgaFor(const std::string& what, const ServedModel& served);
const BodyShapes& bodyFor(const std::string& what, const ServedModel& served);

}  // namespace shaped::server
