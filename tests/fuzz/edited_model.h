#pragma once

#include <optional>
#include <string_view>

#include "core/io/model_directory.h"

namespace shaped::fuzz {

/// A version that looks like `sound` and holds anything: the bytes are the manifest's description up to the first NUL
/// (empty: the right one), then edits of the tensors, twelve bytes each. Nothing when the description is no object.
std::optional<StoredModel> editedModel(const StoredModel& sound, std::string_view bytes);

}  // namespace shaped::fuzz
