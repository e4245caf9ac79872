#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace shaped {

/// Reads handles for editing: which vertex goes where. Lines "vertex,x,y,z" (vertices from 0, positions in the model's
/// unit), after an optional header line "vertex,x,y,z"; # starts a comment.
/// Throws InvalidInput naming file and line when the file cannot be opened, a line is not of that form, a position is
/// not finite, a vertex is negative or stands twice, or there are no handles.
std::vector<std::pair<std::int32_t, Eigen::Vector3d>> readHandles(const std::filesystem::path& path);

/// The same from text; file: its name for error texts.
std::vector<std::pair<std::int32_t, Eigen::Vector3d>> parseHandles(const std::string& file, std::string_view text);

}  // namespace shaped
