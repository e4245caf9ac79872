#include <stop_token>

#include "core/model/shell_pga_shapes.h"
#include "server/convert/model.h"
#include "tests/fuzz/small_model.h"
#include "tests/fuzz/wire.h"

using namespace shaped;
using namespace shaped::fuzz;

// Coefficients become a point as they are; whether it is one of the model, the model says when it makes its shape.
FUZZ_WIRE_TARGET(wire_model, shaped::v1::Coefficients) {
  const auto message = parsed<v1::Coefficients>(bytes);
  if (!message) return;
  const auto converted = accepted<InvalidInput>([&] { return server::coefficientsFromProto(*message, {}); });
  if (!converted) return;
  const auto& point = *converted;
  v1::Coefficients back;
  server::toProto(point, back);
  v1::Coefficients known;  // without fields of other versions
  if (message->body_size() > 0) {
    known.mutable_body()->CopyFrom(message->body());
  } else {
    known.mutable_alpha()->CopyFrom(message->alpha());
    known.set_scale(message->scale());
  }
  require(back.SerializeAsString() == known.SerializeAsString(), "coefficients survive");
  // Solving is not what is tested, and a far shape takes seconds: an abandoned request is checked and then ends.
  std::stop_source abandoned;
  abandoned.request_stop();
  accepted<InvalidInput>(
      [&] { return ShellPgaShapes(smallModel()).synthesize(point, {.fine = false, .stop = abandoned.get_token()}); });
}
