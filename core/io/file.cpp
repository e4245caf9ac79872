#include "core/io/file.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <atomic>
#include <cctype>
#include <cerrno>
#include <cstring>
#include <system_error>

#include "core/io/file_error.h"
#include "core/numerics/error.h"

namespace shaped {
namespace {

namespace fs = std::filesystem;

std::string reason(int error) { return std::generic_category().message(error); }

/// A file descriptor that closes itself.
struct Descriptor {
  int number;
  ~Descriptor() {
    if (number >= 0) ::close(number);
  }
};

/// A name beside the target that no other writer uses.
fs::path temporaryBeside(const fs::path& path) {
  static std::atomic<unsigned> counter{0};
  fs::path temporary = path;
  temporary += ".partial-" + std::to_string(::getpid()) + "-" + std::to_string(counter++);
  return temporary;
}

/// Writes all bytes at the current position; returns 0 or the error number.
int writeAll(int descriptor, std::string_view bytes) {
  while (!bytes.empty()) {
    const auto written = ::write(descriptor, bytes.data(), bytes.size());
    if (written < 0 && errno == EINTR) continue;
    if (written <= 0) return written < 0 ? errno : ENOSPC;
    bytes.remove_prefix(static_cast<std::size_t>(written));
  }
  return 0;
}

}  // namespace

std::string extensionOf(const std::filesystem::path& path) {
  std::string extension = path.extension().string();
  for (char& c : extension) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  return extension;
}

std::string readFile(const fs::path& path) {
  // Not blocking, so that a pipe without a writer is refused instead of waited for.
  const Descriptor file{::open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK)};
  if (file.number < 0) throw InvalidInput(path.string(), "cannot be opened: " + reason(errno));
  struct stat status {};
  if (::fstat(file.number, &status) != 0) throw FileError(path.string(), "cannot be examined: " + reason(errno));
  if (!S_ISREG(status.st_mode)) throw InvalidInput(path.string(), "is not a regular file");
  if (status.st_size == 0) throw InvalidInput(path.string(), "is empty");
  std::string bytes(static_cast<std::size_t>(status.st_size), '\0');
  std::size_t filled = 0;
  while (filled < bytes.size()) {
    const auto got = ::read(file.number, bytes.data() + filled, bytes.size() - filled);
    if (got < 0 && errno == EINTR) continue;
    if (got < 0) throw FileError(path.string(), "cannot be read: " + reason(errno));
    if (got == 0) break;  // cut while we read: the parser says what is missing
    filled += static_cast<std::size_t>(got);
  }
  bytes.resize(filled);
  return bytes;
}

FileWriter::FileWriter(fs::path path) : path_(std::move(path)) {
  std::error_code ignored;
  if (fs::is_symlink(path_, ignored)) {
    const auto target = fs::weakly_canonical(path_, ignored);
    if (!ignored) path_ = target;
  }
  if (fs::exists(path_, ignored) && !fs::is_regular_file(path_, ignored)) {
    descriptor_ = ::open(path_.c_str(), O_WRONLY | O_CLOEXEC);
  } else {
    do {  // a crashed process of our number may have left a file of this name
      temporary_ = temporaryBeside(path_);
      descriptor_ = ::open(temporary_.c_str(), O_WRONLY | O_CLOEXEC | O_CREAT | O_EXCL, 0666);
    } while (descriptor_ < 0 && errno == EEXIST);
  }
  if (descriptor_ < 0) fail("cannot be created: " + reason(errno));
}

FileWriter::~FileWriter() {
  if (descriptor_ >= 0) ::close(descriptor_);
  if (!temporary_.empty()) ::unlink(temporary_.c_str());
}

void FileWriter::fail(const std::string& problem) const { throw FileError(path_.string(), problem); }

void FileWriter::write(std::string_view bytes) {
  if (const int error = writeAll(descriptor_, bytes)) fail("cannot be written: " + reason(error));
}

void FileWriter::patch(std::uint64_t offset, std::string_view bytes) {
  if (::lseek(descriptor_, static_cast<off_t>(offset), SEEK_SET) < 0) fail("cannot be rewound: " + reason(errno));
  write(bytes);
  if (::lseek(descriptor_, 0, SEEK_END) < 0) fail("cannot be continued: " + reason(errno));
}

void FileWriter::commit() {
  // Devices and pipes cannot be synchronised; that is no failure.
  if (::fsync(descriptor_) != 0 && errno != EINVAL && errno != EROFS) fail("cannot be written: " + reason(errno));
  const int closed = ::close(descriptor_);
  descriptor_ = -1;
  if (closed != 0) fail("cannot be written: " + reason(errno));
  if (temporary_.empty()) return;
  if (::rename(temporary_.c_str(), path_.c_str()) != 0) fail("cannot be named: " + reason(errno));
  temporary_.clear();
}

void writeFile(const fs::path& path, std::string_view bytes) {
  FileWriter writer(path);
  writer.write(bytes);
  writer.commit();
}

}  // namespace shaped
