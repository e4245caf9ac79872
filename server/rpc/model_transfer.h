#pragma once

#include "server/convert/limits.h"
#include "server/models/model_store.h"
#include "server/rpc/incoming_stream_call.h"
#include "server/rpc/outgoing_stream_call.h"
#include "shaped/v1/models.pb.h"

namespace shaped::server {

using ModelUploadHandler = StreamHandler<v1::UploadModelRequest, v1::UploadModelResponse>;
using ModelDownload = OutgoingStreamCall<v1::DownloadModelRequest, v1::DownloadModelResponse>;

/// Takes one version in. Whatever ends it before the version is published leaves nothing behind.
std::unique_ptr<ModelUploadHandler> receiveModel(ModelStore& store, const Limits& limits);

/// Sends one version out, whatever becomes of it in the store meanwhile. Throws ModelNotFound; FileError when its files
/// are damaged, which for the tensors shows at their end.
ModelDownload::Begin sendModel(const ModelStore& store, const Limits& limits);

}  // namespace shaped::server
