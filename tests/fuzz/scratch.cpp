#include <stdlib.h>

#include <fstream>
#include <system_error>

#include "tests/fuzz/fuzz.h"

namespace shaped::fuzz {
namespace {

struct Folder {
  std::filesystem::path path;

  Folder() {
    std::string name = (std::filesystem::temp_directory_path() / "shaped-fuzz-XXXXXX").string();
    if (::mkdtemp(name.data()) == nullptr) throw std::system_error(errno, std::generic_category(), name);
    path = name;
  }
  ~Folder() {
    std::error_code ignored;
    std::filesystem::remove_all(path, ignored);
  }
};

}  // namespace

const std::filesystem::path& scratchFolder() {
  static const Folder folder;
  return folder.path;
}

std::filesystem::path scratchFile(std::string_view name, std::string_view bytes) {
  auto path = scratchFolder() / name;
  std::ofstream stream(path, std::ios::binary);
  stream.write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
  stream.close();
  if (!stream) throw std::system_error(errno, std::generic_category(), path.string());
  return path;
}

}  // namespace shaped::fuzz
