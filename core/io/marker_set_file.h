#pragma once

#include <cstdint>
#include <filesystem>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "core/markers/marker_set.h"

namespace shaped {

/// Reads a marker set for a template of vertex_count vertices and face_count triangles:
///   {"markers": [{"label": "LFWT", "vertex": 968, "offset": [0.005, 0, 0.007]},
///                {"label": "C7", "face": 17, "barycentric": [0.2, 0.3, 0.5]}, ...]}
/// `offset` (metres, template axes) is optional. A set made for templates of several resolutions has, instead of
/// `vertex`, one "vertex_<name>" a template, and beside `markers` the vertex counts as "topology_<name>"; the one whose
/// count is vertex_count is taken. `real_marker_offset_m` is another name for `offset`. Other fields are skipped.
///
/// Throws InvalidInput naming the file and the marker when the file cannot be opened or is no JSON of that form, has no
/// markers, a label twice or empty, a vertex or face out of range, or barycentric weights that are negative or do not
/// sum to 1 (within 1e-6).
MarkerSet readMarkerSet(const std::filesystem::path& path, std::int32_t vertex_count, std::int32_t face_count);

/// The same from text; file: its name for error texts.
MarkerSet parseMarkerSet(const std::string& file, std::string_view text, std::int32_t vertex_count,
                         std::int32_t face_count);

/// Writes the form above; it reads back exactly. Throws FileError.
void writeMarkerSet(const std::filesystem::path& path, const MarkerSet& set);

/// Where each marker of the set stands among a trial's labels. A label matches as a whole or, failing that, without the
/// subject's name. Throws InvalidInput naming all labels of the set that the trial lacks (unless allow_absent: they get
/// -1), a label that matches two subjects, or fewer than three matches.
std::vector<std::int32_t> matchLabels(const MarkerSet& set, std::span<const std::string> trial_labels,
                                      bool allow_absent = false);

}  // namespace shaped
