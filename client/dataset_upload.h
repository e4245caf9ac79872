#pragma once

#include <filesystem>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "client/connection.h"
#include "core/io/frames.h"
#include "core/io/mesh_file.h"
#include "shaped/v1/datasets.grpc.pb.h"

namespace shaped::client {

/// Shapes with one connectivity out of files, read one at a time.
class ShapeSource {
 public:
  /// One mesh file a shape; the first gives the connectivity. Throws InvalidInput when there are none, or as readMesh.
  explicit ShapeSource(std::vector<std::string> files);
  /// A template mesh and an n x V x 3 .npy file. Throws InvalidInput when the vertex counts differ, or as readMesh and
  /// FrameReader.
  ShapeSource(const std::string& template_file, const std::string& frames_file);

  std::int64_t count() const;
  Eigen::Index vertexCount() const { return first_.vertices.rows(); }
  const Faces& faces() const { return first_.faces; }
  /// The template's positions, where there is one beside the shapes.
  const Vertices* templateShape() const { return frames_ ? &first_.vertices : nullptr; }
  /// What errors call a shape: its file, or the .npy file and the frame.
  std::string label(std::int64_t index) const;
  /// V x 3. Throws InvalidInput naming the file when it is connected differently, or as readMesh and FrameReader.
  Vertices shape(std::int64_t index) const;

 private:
  std::vector<std::string> files_;
  MeshFile first_;
  std::string frames_file_;
  std::unique_ptr<FrameReader> frames_;
};

/// A dataset name that follows from the content, so that the same shapes are uploaded and kept once:
/// "shapes-<prefix>-<16 hexadecimal digits>". Reads all shapes.
std::string contentName(const ShapeSource& shapes, const std::string& prefix);

/// Uploads the shapes; `progress` hears how many have gone. Throws RpcError when the daemon refuses, InvalidInput when
/// a file is faulty; nothing is then kept on the daemon.
v1::Dataset uploadDataset(const std::shared_ptr<grpc::Channel>& channel, const std::string& name,
                          const ShapeSource& shapes, const CallOptions& options,
                          const std::function<void(std::int64_t)>& progress);

}  // namespace shaped::client
