#include "core/io/frames.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <system_error>

#include "core/io/file_error.h"
#include "core/io/npy.h"
#include "core/numerics/error.h"

namespace shaped {
namespace {

constexpr std::size_t kHeaderBytes = 128;  ///< of a file we write: room for any counts

/// Reads up to `size` bytes at an offset; fewer at the end of the file.
std::string readAt(int descriptor, const std::string& file, std::uint64_t offset, std::size_t size) {
  std::string bytes(size, '\0');
  std::size_t filled = 0;
  while (filled < size) {
    const auto got = ::pread(descriptor, bytes.data() + filled, size - filled, static_cast<off_t>(offset + filled));
    if (got < 0 && errno == EINTR) continue;
    if (got < 0) throw FileError(file, "cannot be read: " + std::generic_category().message(errno));
    if (got == 0) break;
    filled += static_cast<std::size_t>(got);
  }
  bytes.resize(filled);
  return bytes;
}

int openRegularFile(const std::string& file, std::uint64_t& size) {
  const int descriptor = ::open(file.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK);
  if (descriptor < 0) throw InvalidInput(file, "cannot be opened: " + std::generic_category().message(errno));
  struct stat status {};
  const bool regular = ::fstat(descriptor, &status) == 0 && S_ISREG(status.st_mode);
  size = static_cast<std::uint64_t>(status.st_size);
  if (regular && size > 0) return descriptor;
  ::close(descriptor);
  throw InvalidInput(file, regular ? "is empty" : "is not a regular file");
}

}  // namespace

FrameReader::FrameReader(const std::filesystem::path& path) : file_(path.string()) {
  std::uint64_t size = 0;
  descriptor_ = openRegularFile(file_, size);
  try {
    header_ = parseNpyHeader(file_, readAt(descriptor_, file_, 0, kMostNpyHeaderBytes), size);
    const auto& shape = header_.shape;
    if (shape.size() != 3 || shape[0] < 1 || shape[1] < 1 || shape[2] != 3)
      throw InvalidInput(file_, "is not of shape n x V x 3 (frames, vertices, coordinates)");
  } catch (...) {
    ::close(descriptor_);
    throw;
  }
}

FrameReader::~FrameReader() { ::close(descriptor_); }

Vertices FrameReader::frame(std::int64_t index, bool allow_missing) const {
  if (index < 0 || index >= frameCount())
    throw InvalidInput(file_, "has no frame " + std::to_string(index) + "; it has " + std::to_string(frameCount()));
  const auto value_count = static_cast<std::size_t>(vertexCount()) * 3, size = value_count * sizeOf(header_.type);
  const auto bytes = readAt(descriptor_, file_, header_.size + static_cast<std::uint64_t>(index) * size, size);
  if (bytes.size() < size) throw InvalidInput(file_, "became shorter while it was read");
  Vertices vertices(vertexCount(), 3);
  decodeNpyValues(header_, bytes, {vertices.data(), value_count});
  for (Eigen::Index v = 0; !allow_missing && v < vertices.rows(); ++v)
    if (!vertices.row(v).allFinite())
      throw InvalidInput(file_, "frame " + std::to_string(index) + ", vertex " + std::to_string(v) +
                                    " has a coordinate that is not a finite number");
  return vertices;
}

std::vector<Vertices> readFrames(const std::filesystem::path& path) {
  const FrameReader reader(path);
  std::vector<Vertices> frames;
  for (std::int64_t i = 0; i < reader.frameCount(); ++i) frames.push_back(reader.frame(i));
  return frames;
}

FrameWriter::FrameWriter(const std::filesystem::path& path) : file_(path.string()), writer_(path) {
  writer_.write(std::string(kHeaderBytes, ' '));  // patched when the counts are known
}

void FrameWriter::append(const Vertices& frame) {
  if (!vertex_count_) vertex_count_ = frame.rows();
  if (frame.rows() != *vertex_count_)
    throw InvalidInput("frames[" + std::to_string(frame_count_) + "]",
                       "has " + std::to_string(frame.rows()) + " vertices, want " + std::to_string(*vertex_count_));
  const Eigen::Matrix<float, Eigen::Dynamic, 3, Eigen::RowMajor> rounded = frame.cast<float>();
  static_assert(std::endian::native == std::endian::little, "numbers are written as they lie in memory");
  writer_.write({reinterpret_cast<const char*>(rounded.data()), static_cast<std::size_t>(rounded.size()) * 4});
  ++frame_count_;
}

void FrameWriter::close() {
  if (frame_count_ == 0) throw InvalidInput(file_, "no frames to write");
  writer_.patch(0, formatNpyHeader(NpyType::kFloat32, {frame_count_, *vertex_count_, 3}, kHeaderBytes));
  writer_.commit();
}

void writeFrames(const std::filesystem::path& path, const std::vector<Vertices>& frames) {
  FrameWriter writer(path);
  for (const auto& frame : frames) writer.append(frame);
  writer.close();
}

}  // namespace shaped
