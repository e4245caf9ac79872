#include "server/jobs/record_file.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <system_error>

#include "core/io/file_error.h"
#include "core/io/folder.h"
#include "core/io/sha256.h"
#include "server/errors/errors.h"

namespace shaped::server {
namespace {

/// Before each record: its length and the beginning of its SHA-256.
struct Head {
  std::uint64_t length = 0;
  char checksum[16] = {};
};
static_assert(sizeof(Head) == 24);

Head headOf(std::string_view record) {
  Head head{record.size(), {}};
  const auto hash = sha256(record);
  std::memcpy(head.checksum, hash.data(), sizeof(head.checksum));
  return head;
}

int open(const std::filesystem::path& path, int flags) {
  const int descriptor = ::open(path.c_str(), flags | O_CLOEXEC, 0644);
  if (descriptor < 0)
    throw FileError(path.string(), "cannot be opened: " + std::generic_category().message(errno));
  return descriptor;
}

}  // namespace

RecordReader::RecordReader(const std::filesystem::path& path) : path_(path), descriptor_(open(path, O_RDONLY)) {
  struct stat status {};
  if (::fstat(descriptor_, &status) == 0) size_ = status.st_size;
}

RecordReader::~RecordReader() { ::close(descriptor_); }

bool RecordReader::next(std::string& record) {
  const auto read = [this](void* into, std::size_t bytes, std::int64_t from) {
    for (std::size_t done = 0; done < bytes;) {
      const auto count = ::pread(descriptor_, static_cast<char*>(into) + done, bytes - done,
                                 static_cast<off_t>(from + static_cast<std::int64_t>(done)));
      if (count < 0 && errno == EINTR) continue;
      if (count <= 0)
        throw FileError(path_.string(), "cannot be read: " + std::generic_category().message(count < 0 ? errno : EIO));
      done += static_cast<std::size_t>(count);
    }
  };
  const auto left = size_ - at_;
  if (left == 0) return false;
  constexpr auto head_size = static_cast<std::int64_t>(sizeof(Head));
  Head head;
  if (left >= head_size) read(&head, sizeof(head), at_);
  if (left < head_size || head.length > static_cast<std::uint64_t>(left - head_size))
    throw Corrupted(path_.string() + ": ends in the middle of a record");
  record.resize(head.length);
  read(record.data(), record.size(), at_ + head_size);
  if (std::memcmp(headOf(record).checksum, head.checksum, sizeof(head.checksum)) != 0)
    throw Corrupted(path_.string() + ": is damaged at byte " + std::to_string(at_));
  at_ += head_size + static_cast<std::int64_t>(head.length);
  return true;
}

RecordWriter::RecordWriter(const std::filesystem::path& path, std::int64_t keep)
    : path_(path), descriptor_(open(path, O_RDWR | O_CREAT)) {
  try {
    goBehind(keep);
    syncFolder(path.parent_path());
  } catch (...) {
    ::close(descriptor_);
    throw;
  }
}

RecordWriter::~RecordWriter() { ::close(descriptor_); }

void RecordWriter::goBehind(std::int64_t keep) {
  RecordReader reader(path_);
  try {
    std::string record;
    while (count_ < keep && reader.next(record)) ++count_;
  } catch (const Corrupted&) {
    // Torn or damaged from here on.
  }
  if (keep != kAll && count_ < keep)
    throw Corrupted(path_.string() + ": has " + std::to_string(count_) + " whole records, want " +
                    std::to_string(keep));
  end_ = reader.position();
  if (::ftruncate(descriptor_, static_cast<off_t>(end_)) != 0) fail("cannot be cut off");
}

void RecordWriter::append(std::string_view record) {
  const auto head = headOf(record);
  std::string bytes(reinterpret_cast<const char*>(&head), sizeof(head));
  bytes += record;
  for (std::size_t done = 0; done < bytes.size();) {
    const auto count = ::pwrite(descriptor_, bytes.data() + done, bytes.size() - done,
                                static_cast<off_t>(end_ + static_cast<std::int64_t>(done)));
    if (count < 0 && errno == EINTR) continue;
    if (count < 0) {
      const int reason = errno;
      // Should this fail too, the torn record is recognised by whoever reads.
      [[maybe_unused]] const int cut = ::ftruncate(descriptor_, static_cast<off_t>(end_));
      errno = reason;
      fail("cannot be written");
    }
    done += static_cast<std::size_t>(count);
  }
  end_ += static_cast<std::int64_t>(bytes.size());
  ++count_;
}

void RecordWriter::sync() {
  if (::fdatasync(descriptor_) != 0) fail("cannot be written");
}

void RecordWriter::fail(const std::string& problem) const {
  throw FileError(path_.string(), problem + ": " + std::generic_category().message(errno));
}

}  // namespace shaped::server
