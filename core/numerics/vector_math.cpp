#include "core/numerics/vector_math.h"

// <cmath> stays out: these declarations tell the compiler that the C library has vector versions of the two functions
// (libmvec, since glibc 2.35; the linker's -lm finds it), so that the loops below call them. Scalar calls elsewhere.
#if defined(__x86_64__) && defined(__GLIBC__)
extern "C" {
#pragma omp declare simd notinbranch
double log(double);
#pragma omp declare simd notinbranch
double atan2(double, double);
}
#else
extern "C" {
double log(double);
double atan2(double, double);
}
#endif

namespace shaped {

void logarithms(std::span<const double> x, std::span<double> result) {
  const double* in = x.data();
  double* out = result.data();
#pragma omp simd
  for (std::size_t i = 0; i < x.size(); ++i) out[i] = log(in[i]);
}

void arcTangents(std::span<const double> y, std::span<const double> x, std::span<double> result) {
  const double *sine = y.data(), *cosine = x.data();
  double* out = result.data();
#pragma omp simd
  for (std::size_t i = 0; i < x.size(); ++i) out[i] = atan2(sine[i], cosine[i]);
}

}  // namespace shaped
