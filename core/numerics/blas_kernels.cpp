#include "core/numerics/blas_kernels.h"

#include <unistd.h>

#include <algorithm>
#include <array>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <string_view>
#include <vector>

extern "C" char* openblas_get_corename();

namespace shaped {
namespace {

constexpr const char* kVariable = "OPENBLAS_CORETYPE";
/// Kernels for x86 processors without AVX2, as OpenBLAS calls them.
constexpr std::array<std::string_view, 12> kOld{"Katmai",  "Coppermine",  "Northwood", "Prescott",
                                                "Banias",  "Core2",       "Penryn",    "Dunnington",
                                                "Nehalem", "Sandybridge", "Athlon",    "Opteron"};

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

/// As the program was started.
std::vector<std::string> commandLine() {
  std::ifstream file("/proc/self/cmdline", std::ios::binary);
  std::vector<std::string> words;
  for (std::string word; std::getline(file, word, '\0');) words.push_back(word);
  return words;
}

}  // namespace

std::string blasKernels() { return openblas_get_corename(); }

std::string betterBlasKernels(const std::string& got, const VectorUnits& units) {
  if (std::find(kOld.begin(), kOld.end(), got) == kOld.end() || !units.avx2) return {};
  return units.avx512 ? "SkylakeX" : "Haswell";
}

void useBestBlasKernels() {
  const auto better = betterBlasKernels(blasKernels(), vectorUnits());
  if (better.empty() || std::getenv(kVariable) != nullptr) return;
  auto words = commandLine();
  if (words.empty()) return;
  std::vector<char*> arguments;
  for (auto& word : words) arguments.push_back(word.data());
  arguments.push_back(nullptr);
  setenv(kVariable, better.c_str(), 1);
  std::error_code unknown;
  // By its own name: a process is listed by the name of the file that it runs.
  const auto program = std::filesystem::read_symlink("/proc/self/exe", unknown);
  if (!unknown) execv(program.c_str(), arguments.data());
}

}  // namespace shaped
