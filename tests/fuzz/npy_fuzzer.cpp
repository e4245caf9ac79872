#include "core/io/npy.h"

#include <cmath>

#include "core/io/frames.h"
#include "tests/fuzz/fuzz.h"

using namespace shaped;
using namespace shaped::fuzz;

namespace {

bool same(double one, double other) { return one == other || (std::isnan(one) && std::isnan(other)); }

/// An array as a whole, which must survive being written as doubles.
void readArray(const std::filesystem::path& file) {
  const auto array = accepted<InvalidInput>([&] { return readNpy(file); });
  if (!array) return;
  std::size_t count = 1;
  for (const auto extent : array->shape) count *= static_cast<std::size_t>(extent);
  require(count == array->values.size(), "there are as many values as the shape says");
  const auto copy = scratchFolder() / "copy.npy";
  if (!accepted<InvalidInput>([&] { return writeNpy(copy, array->shape, array->values), true; })) return;
  const auto back = readNpy(copy);
  require(back.shape == array->shape, "the shape survives");
  for (std::size_t i = 0; i < count; ++i) require(same(back.values[i], array->values[i]), "values survive");
}

/// The same file as a sequence of shapes.
void readSequence(const std::filesystem::path& file) {
  const auto frames = accepted<InvalidInput>([&] { return readFrames(file); });
  if (!frames) return;
  require(!frames->empty(), "there are frames");
  for (const auto& frame : *frames) {
    require(frame.rows() == frames->front().rows() && frame.rows() > 0, "frames have the same number of vertices");
    require(frame.allFinite(), "vertices are finite");
  }
}

}  // namespace

FUZZ_TARGET(npy) {
  const auto file = scratchFile("array.npy", bytes);
  readArray(file);
  readSequence(file);
}
