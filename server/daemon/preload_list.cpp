#include "server/daemon/preload_list.h"

#include <sstream>

#include "core/io/text_scanner.h"
#include "core/numerics/error.h"
#include "server/datasets/name.h"

namespace shaped::server {
namespace {

ModelSelector selectorFrom(const std::string& where, const std::string& text) {
  const auto at = text.find('@');
  ModelSelector selector{text.substr(0, at), 0, ""};
  requireName(selector.name, where);
  if (at == std::string::npos) return selector;
  const auto rest = text.substr(at + 1);
  std::int64_t version = 0;
  if (parseInteger(rest, version)) {
    if (version < 1) throw InvalidInput(where, "\"" + text + "\": versions count from 1");
    selector.version = static_cast<std::uint64_t>(version);
  } else {
    requireName(rest, where);
    selector.label = rest;
  }
  return selector;
}

}  // namespace

PreloadList preloadListFrom(const std::string& where, const std::string& text) {
  PreloadList list;
  if (text == "all") return {true, {}};
  std::istringstream words(text);
  for (std::string word; std::getline(words, word, ',');) list.models.push_back(selectorFrom(where, word));
  if (text.ends_with(',')) throw InvalidInput(where, "\"" + text + "\" ends with a comma; name a model after it");
  return list;
}

}  // namespace shaped::server
