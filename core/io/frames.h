#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "core/io/file.h"
#include "core/io/npy_header.h"
#include "core/mesh/types.h"

namespace shaped {

/// Frames of a mesh sequence out of a .npy file of shape n x V x 3 (any number type, either byte order), one at a time:
/// a long clip need not fit in memory. Not for use from several threads at once.
class FrameReader {
 public:
  /// Opens the file and checks its header against its length. Throws InvalidInput naming the file when it cannot be
  /// opened, is no .npy file of shape n x V x 3 with n, V >= 1, or is longer or shorter than its header says.
  explicit FrameReader(const std::filesystem::path& path);
  ~FrameReader();
  FrameReader(const FrameReader&) = delete;
  FrameReader& operator=(const FrameReader&) = delete;

  std::int64_t frameCount() const { return header_.shape[0]; }
  std::int64_t vertexCount() const { return header_.shape[1]; }

  /// Frame in [0, frameCount()), V x 3. Throws InvalidInput naming file, frame and vertex when a coordinate is not
  /// finite unless allow_missing, which keeps NaN (markers that were not seen); FileError when reading fails.
  Vertices frame(std::int64_t index, bool allow_missing = false) const;

 private:
  std::string file_;
  NpyHeader header_;
  int descriptor_ = -1;
};

/// All frames at once. Throws as FrameReader.
std::vector<Vertices> readFrames(const std::filesystem::path& path);

/// Writes an n x V x 3 .npy file of floats frame by frame; the file appears under its name at close() and not at all
/// when the writer is destroyed before.
class FrameWriter {
 public:
  /// Throws FileError when the file cannot be created.
  explicit FrameWriter(const std::filesystem::path& path);

  /// All frames have as many vertices as the first; NaN is kept (a missing marker). Throws InvalidInput naming the
  /// frame when it has another count, FileError when writing fails.
  void append(const Vertices& frame);
  std::int64_t frameCount() const { return frame_count_; }

  /// Completes the file. Throws InvalidInput when there was no frame, FileError when writing fails. Call once, last.
  void close();

 private:
  std::string file_;
  FileWriter writer_;
  std::int64_t frame_count_ = 0;
  std::optional<std::int64_t> vertex_count_;
};

/// Writes all frames through FrameWriter.
void writeFrames(const std::filesystem::path& path, const std::vector<Vertices>& frames);

}  // namespace shaped
