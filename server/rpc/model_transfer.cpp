#include "server/rpc/model_transfer.h"

#include <algorithm>

#include "core/io/file_error.h"
#include "core/io/sha256.h"
#include "core/numerics/error.h"
#include "server/convert/model.h"

namespace shaped::server {
namespace {

constexpr std::int64_t kPiece = (1 << 20) - (1 << 10);  ///< with its frame a message of less than 1 MiB [bytes]
constexpr std::size_t kMostManifestBytes = 256 << 10;

/// What was wrong, under the field's path in the request.
InvalidInput at(const std::string& path, const InvalidInput& problem) {
  const std::string text = problem.what();
  const auto prefix = problem.field().empty() ? 0 : problem.field().size() + 2;
  return {path, text.substr(std::min(prefix, text.size()))};
}

void requireAgreement(const v1::ModelFiles& files, const ModelManifest& manifest) {
  if (files.tensors_bytes() != manifest.tensors_bytes)
    throw InvalidInput("header.files.tensors_bytes", "is " + std::to_string(files.tensors_bytes()) +
                                                         ", the manifest says " +
                                                         std::to_string(manifest.tensors_bytes));
  if (files.tensors_sha256() != manifest.tensors_sha256)
    throw InvalidInput("header.files.tensors_sha256",
                       "is \"" + files.tensors_sha256() + "\", the manifest says \"" + manifest.tensors_sha256 + "\"");
}

class ReceiveModel final : public ModelUploadHandler {
 public:
  ReceiveModel(ModelStore& store, const Limits& limits) : store_(store), limits_(limits) {}

  bool message(const v1::UploadModelRequest& request, v1::UploadModelResponse&, Call& call) override {
    if (request.has_header())
      begin(request.header(), call);
    else if (request.has_tensors())
      append(request.tensors());
    else
      throw InvalidInput("part", "is neither header nor tensors");
    return false;
  }

  /// Comes again once the model is built.
  bool end(v1::UploadModelResponse& response, Call& call) override {
    if (!incoming_ && !published_) throw InvalidInput("header", "is missing: the stream was empty");
    if (!published_) published_ = store_.publish(std::move(incoming_), call.stopToken());
    const auto model = published_->get();
    call.setModel(model->name, model->version);
    toProto(*model, *response.mutable_description());
    toProto(store_.standing(model->name, model->version), *response.mutable_description());
    return false;
  }

 private:
  void begin(const v1::UploadModelRequest::Header& header, Call& call) {
    if (incoming_) throw InvalidInput("header", "came a second time");
    const auto& files = header.files();
    if (files.manifest().size() > kMostManifestBytes)
      throw InvalidInput("header.files.manifest", "has " + std::to_string(files.manifest().size()) +
                                                      " bytes, want at most " + std::to_string(kMostManifestBytes));
    if (const auto hash = sha256(files.manifest()); hash != files.manifest_sha256())
      throw InvalidInput("header.files.manifest", "has SHA-256 " + hash + ", the header says \"" +
                                                      files.manifest_sha256() + "\": it was changed on the way");
    if (files.tensors_bytes() > static_cast<std::uint64_t>(limits_.upload_bytes))
      throw InvalidInput("header.files.tensors_bytes", "is " + std::to_string(files.tensors_bytes()) +
                                                           ", want at most " + std::to_string(limits_.upload_bytes) +
                                                           ", the server's limit (--max-upload-megabytes)");
    try {
      incoming_ = store_.receive(header.name(), files.manifest());
    } catch (const InvalidInput& problem) {
      throw at(problem.field() == "model" ? "header.name" : "header.files.manifest", problem);
    }
    requireAgreement(files, incoming_->manifest());
    call.setModel(header.name(), 0);
  }

  void append(const std::string& bytes) {
    if (!incoming_) throw InvalidInput("header", "is missing: the first message must be it");
    incoming_->append(bytes);
  }

  ModelStore& store_;
  const Limits& limits_;
  std::unique_ptr<IncomingModel> incoming_;  ///< until the store has it
  PendingModelPtr published_;
};

/// The files of a version, message by message.
class SendModel {
 public:
  SendModel(ModelFiles files, std::int64_t piece) : files_(std::move(files)), piece_(static_cast<std::size_t>(piece)) {}

  bool next(v1::DownloadModelResponse& message) {
    if (!header_sent_) return fillHeader(*message.mutable_header());
    const auto bytes = files_.tensors->bytes().substr(sent_, piece_);
    if (bytes.empty()) return requireWhole();
    hash_.update(bytes);
    sent_ += bytes.size();
    message.set_tensors(bytes.data(), bytes.size());
    return true;
  }

 private:
  bool fillHeader(v1::DownloadModelResponse::Header& header) {
    header.mutable_model()->set_name(files_.name);
    header.mutable_model()->set_version(static_cast<std::uint64_t>(files_.version));
    auto& files = *header.mutable_files();
    files.set_manifest(files_.manifest_text);
    files.set_manifest_sha256(sha256(files_.manifest_text));
    files.set_tensors_sha256(files_.manifest.tensors_sha256);
    files.set_tensors_bytes(files_.manifest.tensors_bytes);
    return header_sent_ = true;
  }

  /// The client compares too; that the store's file is damaged is for the operator to know.
  bool requireWhole() {
    if (const auto hash = hash_.finish(); hash != files_.manifest.tensors_sha256)
      throw FileError("model " + files_.name + " version " + std::to_string(files_.version),
                      "has tensors of SHA-256 " + hash + ", its manifest says " + files_.manifest.tensors_sha256 +
                          "; restore or remove this version");
    return false;
  }

  const ModelFiles files_;
  const std::size_t piece_;
  bool header_sent_ = false;
  std::size_t sent_ = 0;
  Sha256 hash_;
};

}  // namespace

std::unique_ptr<ModelUploadHandler> receiveModel(ModelStore& store, const Limits& limits) {
  return std::make_unique<ReceiveModel>(store, limits);
}

ModelDownload::Begin sendModel(const ModelStore& store, const Limits& limits) {
  const auto piece = std::min(kPiece, limits.message_bytes - (1 << 10));
  return [&store, piece](const v1::DownloadModelRequest& request, Call& call) {
    auto files = store.files(selectorFromProto(request.model()));
    call.setModel(files.name, static_cast<std::uint64_t>(files.version));
    const auto sender = std::make_shared<SendModel>(std::move(files), piece);
    return [sender](v1::DownloadModelResponse& message, Call&) { return sender->next(message); };
  };
}

}  // namespace shaped::server
