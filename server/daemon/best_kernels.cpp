#include "server/daemon/best_kernels.h"

#include <unistd.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <vector>

#include "core/numerics/blas_kernels.h"

namespace shaped::server {
namespace {

/// As the program was started.
std::vector<std::string> commandLine() {
  std::ifstream file("/proc/self/cmdline", std::ios::binary);
  std::vector<std::string> words;
  for (std::string word; std::getline(file, word, '\0');) words.push_back(word);
  return words;
}

}  // namespace

void useBestBlasKernels() {
  const auto better = betterBlasKernels(blasKernels(), vectorUnits());
  if (better.empty() || std::getenv(kBlasKernelsVariable) != nullptr) return;
  auto words = commandLine();
  std::error_code unknown;
  // By its own name: a process is listed by the name of the file that it runs.
  const auto program = std::filesystem::read_symlink("/proc/self/exe", unknown);
  if (words.empty() || unknown) return;
  std::vector<char*> arguments;
  for (auto& word : words) arguments.push_back(word.data());
  arguments.push_back(nullptr);
  setenv(kBlasKernelsVariable, better.c_str(), 1);
  execv(program.c_str(), arguments.data());
}

}  // namespace shaped::server
