// Runs every file of corpus/<target> and regressions/<target> through its target, in an ordinary build: what fuzzing
// found once stays mended. Arguments: the folder of both.

#include <algorithm>
#include <fstream>
#include <iostream>
#include <iterator>
#include <map>
#include <vector>

#include "tests/fuzz/fuzz.h"

namespace shaped::fuzz {
namespace {

namespace fs = std::filesystem;

std::map<std::string, Target>& targets() {
  static std::map<std::string, Target> known;
  return known;
}

std::vector<fs::path> filesIn(const fs::path& folder) {
  std::vector<fs::path> files;
  if (fs::exists(folder))
    for (const auto& entry : fs::directory_iterator(folder)) files.push_back(entry.path());
  std::sort(files.begin(), files.end());
  return files;
}

/// True when the target has nothing to say against the file.
bool passes(Target target, const fs::path& file) {
  std::ifstream stream(file, std::ios::binary);
  const std::string bytes{std::istreambuf_iterator<char>(stream), {}};
  try {
    target(bytes);
    return true;
  } catch (const std::exception& finding) {
    std::cerr << file.string() << ": " << finding.what() << "\n";
    return false;
  }
}

/// Number of failures.
int replay(const fs::path& folder) {
  int failures = 0, files = 0;
  for (const auto& [name, target] : targets()) {
    const auto seeds = filesIn(folder / "corpus" / name);
    if (seeds.empty()) std::cerr << name << ": has no corpus\n", ++failures;
    for (const auto& list : {seeds, filesIn(folder / "regressions" / name)})
      for (const auto& file : list) failures += passes(target, file) ? 0 : 1, ++files;
  }
  for (const char* kind : {"corpus", "regressions"})
    for (const auto& path : filesIn(folder / kind))
      if (!targets().contains(path.filename())) std::cerr << path.string() << ": has no target\n", ++failures;
  std::cout << files << " files, " << targets().size() << " targets, " << failures << " failures\n";
  return failures;
}

}  // namespace

Registration::Registration(const char* name, Target target) { targets().emplace(name, target); }

}  // namespace shaped::fuzz

int main(int count, char** words) {
  if (count != 2) return std::cerr << "usage: shaped_fuzz_replay FOLDER\n", 2;
  return shaped::fuzz::replay(words[1]) == 0 ? 0 : 1;
}
