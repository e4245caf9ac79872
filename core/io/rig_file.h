#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>

#include "core/skeleton/rig.h"

namespace shaped {

/// A rig as its file gave it, its weights made to sum to 1.
struct RigFile {
  Rig rig;
  double largest_weight_change;  ///< the largest |sum of a vertex's weights - 1| in the file
};

/// Reads a rig for a mesh of vertex_count vertices:
///   {"unit": "m",
///    "joints": [{"name": "hips", "parent": null, "rest": [0, 0.9, 0]},
///               {"name": "knee", "parent": "hips", "rest": [0.1, 0.5, 0],
///                "limits": {"low": [-0.1, 0, 0], "high": [2.4, 0, null]}}, ...],
///    "weights": [[[0, 1]], [[0, 0.25], [1, 0.75]], ...]}
/// `joints`: parents before children, the root first; `parent` is a name, an index or, for the root, null (or -1).
/// `rest`: where the joint lies in the mesh at rest, in `unit` (metres when there is none; see metresPer). `limits`
/// (optional): of the joint's axis-angle vector, radians; null is no limit. `weights`: one list a vertex, in the mesh's
/// order, of pairs [joint, weight]. Other fields are skipped.
///
/// Throws InvalidInput naming the file and the entry when the file cannot be opened or is no JSON of that form, a joint
/// breaks what Skeleton demands, a limit is above its counterpart, there are more or fewer lists than vertices, a pair
/// names a joint that is not there or one twice, a weight is negative or not finite, or a vertex has none.
RigFile readRig(const std::filesystem::path& path, std::int32_t vertex_count);

/// The same from text; file: its name for error texts.
RigFile parseRig(const std::string& file, std::string_view text, std::int32_t vertex_count);

/// Writes the form above, in metres; joints read back exactly, weights within rounding. Throws FileError; InvalidInput
/// unless the rig is valid (Rig::requireValid).
void writeRig(const std::filesystem::path& path, const Rig& rig);

}  // namespace shaped
