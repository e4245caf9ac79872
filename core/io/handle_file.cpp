#include "core/io/handle_file.h"

#include <limits>
#include <map>

#include "core/io/file.h"
#include "core/io/text_scanner.h"
#include "core/numerics/error.h"

namespace shaped {

std::vector<std::pair<std::int32_t, Eigen::Vector3d>> parseHandles(const std::string& file, std::string_view text) {
  TextScanner scanner(file, text);
  std::vector<std::pair<std::int32_t, Eigen::Vector3d>> handles;
  std::map<std::int64_t, std::int64_t> lines;  // of each vertex
  while (scanner.nextContentLine('#')) {
    const auto fields = scanner.fields(',');
    if (fields[0] == "vertex" && handles.empty()) continue;
    if (fields.size() != 4) scanner.fail("has " + std::to_string(fields.size()) + " fields; want vertex,x,y,z");
    const auto vertex = scanner.integerIn(fields[0], "the vertex");
    if (vertex < 0 || vertex > std::numeric_limits<std::int32_t>::max())
      scanner.fail("vertex " + std::to_string(vertex) + " is no index; vertices count from 0");
    const Eigen::Vector3d position(scanner.numberIn(fields[1], "x"), scanner.numberIn(fields[2], "y"),
                                   scanner.numberIn(fields[3], "z"));
    if (!position.allFinite()) scanner.fail("the position is not finite");
    if (const auto [known, added] = lines.try_emplace(vertex, scanner.lineNumber()); !added)
      scanner.fail("vertex " + std::to_string(vertex) + " already has a position in line " +
                   std::to_string(known->second));
    handles.emplace_back(static_cast<std::int32_t>(vertex), position);
  }
  if (handles.empty()) throw InvalidInput(file, "has no handles; want lines of vertex,x,y,z");
  return handles;
}

std::vector<std::pair<std::int32_t, Eigen::Vector3d>> readHandles(const std::filesystem::path& path) {
  return parseHandles(path.string(), readFile(path));
}

}  // namespace shaped
