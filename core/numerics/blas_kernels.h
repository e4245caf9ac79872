#pragma once

#include <string>

namespace shaped {

/// What OpenBLAS calls the kernels that it runs, "SkylakeX".
std::string blasKernels();

/// What a processor can do that OpenBLAS's kernels make use of.
struct VectorUnits {
  bool avx2 = false;    ///< with fused multiply-add
  bool avx512 = false;  ///< F, CD, BW, DQ and VL
};
/// Of the processor that this runs on.
VectorUnits vectorUnits();

/// Better kernels for such a processor than those it got, where these are made for ones without AVX2; else empty.
/// OpenBLAS below 0.3.25 takes Intel's processors that are younger than itself for ones of 2004 (its issue 4267), and
/// factorises at half the speed then. It chooses while it is loaded, and listens to kBlasKernelsVariable alone.
std::string betterBlasKernels(const std::string& got, const VectorUnits& units);

inline constexpr const char* kBlasKernelsVariable = "OPENBLAS_CORETYPE";

}  // namespace shaped
