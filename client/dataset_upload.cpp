#include "client/dataset_upload.h"

#include "client/fingerprint.h"
#include "client/mesh.h"
#include "client/sending.h"
#include "core/numerics/error.h"

namespace shaped::client {
namespace {

v1::UploadDatasetRequest headerOf(const std::string& name, const ShapeSource& shapes) {
  v1::UploadDatasetRequest message;
  auto& header = *message.mutable_header();
  header.set_name(name);
  header.set_vertex_count(static_cast<std::uint32_t>(shapes.vertexCount()));
  pack(shapes.faces(), *header.mutable_faces());
  header.set_frames(static_cast<std::uint32_t>(shapes.count()));
  if (shapes.templateShape()) pack(*shapes.templateShape(), *header.mutable_template_positions());
  return message;
}

v1::UploadDatasetRequest frameOf(const ShapeSource& shapes, std::int64_t index) {
  v1::UploadDatasetRequest message;
  pack(shapes.shape(index), *message.mutable_frame()->mutable_positions());
  message.mutable_frame()->set_label(shapes.label(index));
  return message;
}

}  // namespace

ShapeSource::ShapeSource(std::vector<std::string> files) : files_(std::move(files)) {
  if (files_.empty()) throw InvalidInput("MESH", "name mesh files, or a template and a .npy file of frames");
  first_ = readMesh(files_.front());
}

ShapeSource::ShapeSource(const std::string& template_file, const std::string& frames_file)
    : first_(readMesh(template_file)), frames_file_(frames_file), frames_(std::make_unique<FrameReader>(frames_file)) {
  if (frames_->vertexCount() != vertexCount())
    throw InvalidInput(frames_file, "has " + std::to_string(frames_->vertexCount()) + " vertices a frame, " +
                                        template_file + " has " + std::to_string(vertexCount()));
}

std::int64_t ShapeSource::count() const { return frames_ ? frames_->frameCount() : std::ssize(files_); }

std::string ShapeSource::label(std::int64_t index) const {
  return frames_ ? frames_file_ + " frame " + std::to_string(index) : files_[static_cast<std::size_t>(index)];
}

Vertices ShapeSource::shape(std::int64_t index) const {
  if (frames_) return frames_->frame(index);
  if (index == 0) return first_.vertices;
  const auto& file = files_[static_cast<std::size_t>(index)];
  auto mesh = readMesh(file);
  requireConnectivity(file, mesh, vertexCount(), faces(), files_.front());
  return std::move(mesh.vertices);
}

std::string contentName(const ShapeSource& shapes, const std::string& prefix) {
  Fingerprint fingerprint;
  fingerprint.addAll(shapes.faces().data(), static_cast<std::size_t>(shapes.faces().size()));
  const auto addShape = [&](const Vertices& shape) {
    google::protobuf::RepeatedField<float> packed;
    pack(shape, packed);
    fingerprint.addAll(packed.data(), static_cast<std::size_t>(packed.size()));
  };
  if (shapes.templateShape()) addShape(*shapes.templateShape());
  for (std::int64_t i = 0; i < shapes.count(); ++i) addShape(shapes.shape(i));
  return datasetName("shapes", prefix, fingerprint);
}

v1::Dataset uploadDataset(const std::shared_ptr<grpc::Channel>& channel, const std::string& name,
                          const ShapeSource& shapes, const CallOptions& options,
                          const std::function<void(std::int64_t)>& progress) {
  const auto stub = v1::Datasets::NewStub(channel);
  Call call(options);
  v1::UploadDatasetResponse response;
  const auto writer = stub->Upload(call.context(), &response);
  sendAll(call, *writer, [&](const auto& send) {
    bool open = send(headerOf(name, shapes));
    for (std::int64_t i = 0; open && i < shapes.count(); ++i) {
      open = send(frameOf(shapes, i));
      progress(i + 1);
    }
  });
  return response.dataset();
}

}  // namespace shaped::client
