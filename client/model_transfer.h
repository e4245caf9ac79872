#pragma once

#include <filesystem>
#include <functional>
#include <memory>

#include "client/connection.h"
#include "shaped/v1/models.grpc.pb.h"

namespace shaped::client {

/// Hears how much of the tensors has gone [0, 1].
using TransferProgress = std::function<void(double)>;

/// Writes a version's files, manifest.json and tensors.safetensors, into a new folder, which appears only when they are
/// whole and have the SHA-256 that the daemon states. Throws InvalidInput when the folder exists, RpcError when the
/// daemon refuses, FileError when the disk fails or the files were changed on the way; then nothing is left.
v1::ModelVersion downloadModel(const std::shared_ptr<grpc::Channel>& channel, const v1::ModelSelector& model,
                               const std::filesystem::path& folder, const CallOptions& options,
                               const TransferProgress& progress);

/// Brings the files of such a folder, which become the next version of `name`. Throws InvalidInput when they are no
/// model's files, RpcError when the daemon refuses; nothing is then kept on the daemon.
v1::ModelDescription uploadModel(const std::shared_ptr<grpc::Channel>& channel, const std::string& name,
                                 const std::filesystem::path& folder, const CallOptions& options,
                                 const TransferProgress& progress);

}  // namespace shaped::client
