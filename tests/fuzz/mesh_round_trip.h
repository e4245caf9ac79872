#pragma once

#include <string_view>

namespace shaped::fuzz {

/// Reads the bytes as a mesh file of this extension (".obj"). What is read must be a mesh (finite positions, corners
/// that are vertices) and, written in the same format, read back the same; STL rounds to floats and welds again.
void readAndRewriteMesh(std::string_view bytes, std::string_view extension);

}  // namespace shaped::fuzz
