#include "core/numerics/blas_kernels.h"

#include <catch2/catch.hpp>

using namespace shaped;

TEST_CASE("a processor with AVX2 gets better kernels than those for ones without, another what it got") {
  CHECK(betterBlasKernels("Prescott", {true, true}) == "SkylakeX");
  CHECK(betterBlasKernels("Prescott", {true, false}) == "Haswell");
  CHECK(betterBlasKernels("Nehalem", {true, false}) == "Haswell");
  CHECK(betterBlasKernels("Prescott", {false, false}).empty());
  for (const char* young : {"Haswell", "SkylakeX", "Zen", "Cooperlake", "Sapphirerapids", "armv8", "neoversen1"})
    CHECK(betterBlasKernels(young, {true, true}).empty());
}

TEST_CASE("this program runs kernels that its processor deserves") {
  INFO("OpenBLAS for " << blasKernels());
  CHECK(betterBlasKernels(blasKernels(), vectorUnits()).empty());
}
