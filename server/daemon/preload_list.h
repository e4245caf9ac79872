#pragma once

#include <string>
#include <vector>

#include "server/models/served_model.h"

namespace shaped::server {

/// What --preload names: NAME, NAME@VERSION or NAME@LABEL, separated by commas; or all.
struct PreloadList {
  bool all = false;  ///< every name of the store
  std::vector<ModelSelector> models;
};
/// Throws InvalidInput naming `where` when there is an empty name, version or label, or a name that can be none.
PreloadList preloadListFrom(const std::string& where, const std::string& text);

}  // namespace shaped::server
