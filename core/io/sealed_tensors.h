#pragma once

#include <filesystem>
#include <string>

#include "core/io/tensor_file.h"

namespace shaped {

/// Tensor files that a later process must be able to trust: the header names a format and the SHA-256 of all that the
/// file holds, so that damage anywhere is found. For state that is written and read by this program alone.

/// Writes the tensors; the file appears only when complete. Throws FileError.
void writeSealed(const std::filesystem::path& path, TensorWriter& tensors, const std::string& format);

/// Throws InvalidInput naming the file and what is wrong unless it is sealed, undamaged and of this format: what it
/// holds was then written by writeSealed() and needs no further checks.
void requireSealed(const TensorFile& file, const std::filesystem::path& path, const std::string& format);

/// A text of the header. Throws InvalidInput naming the file when there is none of that key.
const std::string& metadataOf(const TensorFile& file, const std::filesystem::path& path, const std::string& key);

}  // namespace shaped
