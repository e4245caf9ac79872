#include "client/dataset_upload.h"

#include <algorithm>
#include <cctype>

#include "client/mesh.h"
#include "client/sending.h"
#include "core/numerics/error.h"

namespace shaped::client {
namespace {

/// FNV-1a over 64 bits: tells contents apart, no more.
class Fingerprint {
 public:
  void add(const void* data, std::size_t size) {
    for (const auto* byte = static_cast<const unsigned char*>(data); size > 0; --size, ++byte)
      value_ = (value_ ^ *byte) * 1099511628211ULL;
  }
  std::string text() const {
    std::string digits;
    for (int shift = 60; shift >= 0; shift -= 4) digits.push_back("0123456789abcdef"[(value_ >> shift) & 15]);
    return digits;
  }

 private:
  std::uint64_t value_ = 14695981039346656037ULL;
};

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
  constexpr std::size_t longest_prefix = 70;  // names have at most 100 characters
  Fingerprint fingerprint;
  fingerprint.add(shapes.faces().data(), sizeof(std::int32_t) * static_cast<std::size_t>(shapes.faces().size()));
  const auto addShape = [&](const Vertices& shape) {
    google::protobuf::RepeatedField<float> packed;
    pack(shape, packed);
    fingerprint.add(packed.data(), sizeof(float) * static_cast<std::size_t>(packed.size()));
  };
  if (shapes.templateShape()) addShape(*shapes.templateShape());
  for (std::int64_t i = 0; i < shapes.count(); ++i) addShape(shapes.shape(i));
  std::string name = prefix.substr(0, longest_prefix);
  // Whether the model's name will do is for the daemon to say, of the model.
  std::replace_if(
      name.begin(), name.end(), [](unsigned char c) { return std::isalnum(c) == 0; }, '_');
  return "shapes-" + name + "-" + fingerprint.text();
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
