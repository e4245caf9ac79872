#include "client/model_transfer.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <optional>
#include <system_error>

#include "client/sending.h"
#include "core/io/file.h"
#include "core/io/file_error.h"
#include "core/io/folder.h"
#include "core/io/model_manifest.h"
#include "core/io/sha256.h"
#include "core/numerics/error.h"

namespace shaped::client {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kPiece = (1 << 20) - (1 << 10);  ///< with its frame less than any daemon's message limit [bytes]

std::string reason(int error) { return std::generic_category().message(error); }

/// A file read from front to back.
class FileStream {
 public:
  explicit FileStream(fs::path path) : path_(std::move(path)) {
    descriptor_ = ::open(path_.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK);
    if (descriptor_ < 0) throw InvalidInput(path_.string(), "cannot be opened: " + reason(errno));
    struct stat status {};
    if (::fstat(descriptor_, &status) != 0 || !S_ISREG(status.st_mode)) {
      ::close(descriptor_);
      throw InvalidInput(path_.string(), "is not a regular file");
    }
    size_ = static_cast<std::uint64_t>(status.st_size);
  }
  ~FileStream() { ::close(descriptor_); }
  FileStream(const FileStream&) = delete;
  FileStream& operator=(const FileStream&) = delete;

  std::uint64_t size() const { return size_; }
  /// Fills up to `bytes.size()` bytes; returns how many, 0 at the end. Throws FileError.
  std::size_t read(std::string& bytes) {
    while (true) {
      const auto got = ::read(descriptor_, bytes.data(), bytes.size());
      if (got >= 0) return static_cast<std::size_t>(got);
      if (errno != EINTR) throw FileError(path_.string(), "cannot be read: " + reason(errno));
    }
  }

 private:
  const fs::path path_;
  int descriptor_;
  std::uint64_t size_;
};

/// A version's files as they come, in a scratch folder beside where they will be.
class FolderWriter {
 public:
  explicit FolderWriter(const fs::path& folder) : folder_(folder), scratch_(parentOf(folder)) {}

  void begin(const v1::DownloadModelResponse::Header& header) {
    files_ = header.files();
    writeFile(scratch_.path() / kManifestFile, files_.manifest());
    tensors_.emplace(scratch_.path() / kTensorsFile);
  }

  /// Returns the fraction that has come.
  double append(const std::string& bytes) {
    if (!tensors_) throw damaged("has no header");
    hash_.update(bytes);
    tensors_->write(bytes);
    received_ += bytes.size();
    return static_cast<double>(received_) / static_cast<double>(std::max<std::uint64_t>(files_.tensors_bytes(), 1));
  }

  void publish() {
    if (!tensors_) throw damaged("has no header");
    if (received_ != files_.tensors_bytes())
      throw damaged("has " + std::to_string(received_) + " bytes, want " + std::to_string(files_.tensors_bytes()));
    if (hash_.finish() != files_.tensors_sha256() || sha256(files_.manifest()) != files_.manifest_sha256())
      throw damaged("has not the SHA-256 that the daemon states; try again");
    tensors_->commit();
    syncFolder(scratch_.path());
    scratch_.rename(folder_);
  }

 private:
  static fs::path parentOf(const fs::path& folder) {
    std::error_code none;
    if (fs::exists(fs::symlink_status(folder, none)))
      throw InvalidInput(folder.string(), "exists already; name a folder that is to be made");
    const auto parent = folder.has_parent_path() ? folder.parent_path() : fs::path(".");
    if (!fs::is_directory(parent, none)) throw InvalidInput(parent.string(), "is no folder");
    return parent;
  }
  FileError damaged(const std::string& why) const { return {folder_.string(), "what the daemon sent " + why}; }

  const fs::path folder_;
  ScratchFolder scratch_;
  v1::ModelFiles files_;
  std::optional<FileWriter> tensors_;
  Sha256 hash_;
  std::uint64_t received_ = 0;
};

/// Looks at the files before anything is sent.
v1::UploadModelRequest headerOf(const std::string& name, const fs::path& folder, const FileStream& tensors) {
  const auto path = folder / kManifestFile;
  const auto text = readFile(path);
  v1::UploadModelRequest message;
  auto& header = *message.mutable_header();
  header.set_name(name);
  auto& files = *header.mutable_files();
  try {
    const auto manifest = manifestFrom(text);
    files.set_tensors_sha256(manifest.tensors_sha256);
    files.set_tensors_bytes(manifest.tensors_bytes);
  } catch (const InvalidInput& problem) {
    throw InvalidInput(path.string(), std::string("is no model manifest: ") + problem.what());
  }
  if (tensors.size() != files.tensors_bytes())
    throw InvalidInput(
        (folder / kTensorsFile).string(),
        "has " + std::to_string(tensors.size()) + " bytes, its manifest says " + std::to_string(files.tensors_bytes()));
  files.set_manifest(text);
  files.set_manifest_sha256(sha256(text));
  return message;
}

}  // namespace

v1::ModelVersion downloadModel(const std::shared_ptr<grpc::Channel>& channel, const v1::ModelSelector& model,
                               const fs::path& folder, const CallOptions& options, const TransferProgress& progress) {
  FolderWriter writer(folder.has_filename() ? folder : folder.parent_path());
  const auto stub = v1::Models::NewStub(channel);
  Call call(options);
  v1::DownloadModelRequest request;
  *request.mutable_model() = model;
  v1::ModelVersion version;
  const auto reader = stub->Download(call.context(), request);
  try {
    for (v1::DownloadModelResponse message; reader->Read(&message);) {
      if (message.has_tensors()) {
        progress(writer.append(message.tensors()));
        continue;
      }
      writer.begin(message.header());
      version = message.header().model();
    }
  } catch (...) {
    call.context()->TryCancel();
    reader->Finish();
    throw;
  }
  require(reader->Finish());
  writer.publish();
  return version;
}

v1::ModelDescription uploadModel(const std::shared_ptr<grpc::Channel>& channel, const std::string& name,
                                 const fs::path& folder, const CallOptions& options, const TransferProgress& progress) {
  FileStream tensors(folder / kTensorsFile);
  const auto header = headerOf(name, folder, tensors);
  const auto stub = v1::Models::NewStub(channel);
  Call call(options);
  v1::UploadModelResponse response;
  const auto writer = stub->Upload(call.context(), &response);
  sendAll(call, *writer, [&](const auto& send) {
    bool open = send(header);
    std::uint64_t sent = 0;
    std::string bytes(kPiece, '\0');
    for (v1::UploadModelRequest message; open; progress(static_cast<double>(sent) / tensors.size())) {
      const auto count = tensors.read(bytes);
      if (count == 0) break;
      message.set_tensors(bytes.data(), count);
      open = send(message);
      sent += count;
    }
  });
  return response.description();
}

}  // namespace shaped::client
