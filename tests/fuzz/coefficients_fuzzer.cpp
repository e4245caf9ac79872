#include "client/shapectl/coefficients.h"

#include <algorithm>

#include "tests/fuzz/fuzz.h"

using namespace shaped;
using namespace shaped::fuzz;

FUZZ_TARGET(coefficients) {
  const auto file = scratchFile("coefficients.json", bytes);
  const auto coefficients = accepted<InvalidInput>([&] { return shapectl::readCoefficients(file); });
  if (!coefficients) return;
  shapectl::writeCoefficients(file, *coefficients);
  const auto back = shapectl::readCoefficients(file);
  require(std::ranges::equal(back.alpha(), coefficients->alpha()), "weights survive");
  require(back.scale() == coefficients->scale(), "the scale survives");
}
