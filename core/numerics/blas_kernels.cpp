#include "core/numerics/blas_kernels.h"

#include <algorithm>
#include <array>
#include <string_view>

extern "C" char* openblas_get_corename();

namespace shaped {
namespace {

/// Kernels for x86 processors without AVX2, as OpenBLAS calls them.
constexpr std::array<std::string_view, 12> kOld{"Katmai",  "Coppermine",  "Northwood", "Prescott",
                                                "Banias",  "Core2",       "Penryn",    "Dunnington",
                                                "Nehalem", "Sandybridge", "Athlon",    "Opteron"};

}  // namespace

std::string blasKernels() { return openblas_get_corename(); }

VectorUnits vectorUnits() {
#if defined(__x86_64__)
  __builtin_cpu_init();
  const bool avx512 = __builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512cd") &&
                      __builtin_cpu_supports("avx512bw") && __builtin_cpu_supports("avx512dq") &&
                      __builtin_cpu_supports("avx512vl");
  return {__builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma"), avx512};
#else
  return {};
#endif
}

std::string betterBlasKernels(const std::string& got, const VectorUnits& units) {
  if (std::find(kOld.begin(), kOld.end(), got) == kOld.end() || !units.avx2) return {};
  return units.avx512 ? "SkylakeX" : "Haswell";
}

}  // namespace shaped
