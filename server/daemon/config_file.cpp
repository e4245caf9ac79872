#include "server/daemon/config_file.h"

#include <yaml-cpp/yaml.h>

#include <set>

#include "core/io/file.h"
#include "core/numerics/error.h"

namespace shaped::server {
namespace {

std::string place(const std::filesystem::path& path, const YAML::Mark& mark) {
  return path.string() + (mark.is_null() ? "" : ":" + std::to_string(mark.line + 1));
}

YAML::Node parse(const std::filesystem::path& path) {
  const auto text = readFile(path);
  try {
    return YAML::Load(text);
  } catch (const YAML::Exception& problem) {
    throw InvalidInput(place(path, problem.mark), "is no YAML: " + problem.msg);
  }
}

std::string valueOf(const YAML::Node& node, const std::string& where) {
  if (node.IsScalar()) return node.Scalar();
  if (!node.IsSequence()) throw InvalidInput(where, "wants a value, or a list of values");
  std::string joined;
  for (const auto& item : node) {
    if (!item.IsScalar()) throw InvalidInput(where, "wants a list of plain values");
    joined += (joined.empty() ? "" : ",") + item.Scalar();
  }
  return joined;
}

}  // namespace

std::vector<GivenOption> readConfigFile(const std::filesystem::path& path) {
  const auto document = parse(path);
  if (document.IsNull()) return {};
  if (!document.IsMap()) throw InvalidInput(place(path, document.Mark()), "want one mapping of option names to values");
  std::vector<GivenOption> given;
  std::set<std::string> names;
  for (const auto& entry : document) {
    const auto at = place(path, entry.first.Mark());
    if (!entry.first.IsScalar()) throw InvalidInput(at, "want the name of an option before the colon");
    const auto name = entry.first.Scalar();
    const auto where = at + ": " + name;
    if (!names.insert(name).second) throw InvalidInput(where, "stands there twice");
    given.push_back({where, name, valueOf(entry.second, where)});
  }
  return given;
}

}  // namespace shaped::server
