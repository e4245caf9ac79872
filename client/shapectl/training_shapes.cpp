#include "client/shapectl/training_shapes.h"

#include "core/numerics/error.h"

namespace shaped::shapectl {

void TrainingShapes::declare(Arguments& arguments) {
  arguments.positionals("MESH", meshes, 0, "Training meshes of one connectivity (OBJ, PLY, OFF, STL), in metres");
  arguments.option("--template", template_file, "T.ply", "With --frames: the mesh that gives the connectivity");
  arguments.option("--frames", frames_file, "F.npy", "With --template: the shapes, n x V x 3, in metres");
}

client::ShapeSource TrainingShapes::source() const {
  if (template_file.empty() != frames_file.empty())
    throw InvalidInput(template_file.empty() ? "--template" : "--frames", "is missing: the two come together");
  if (!frames_file.empty() && !meshes.empty())
    throw InvalidInput("MESH", "name either mesh files or --template and --frames");
  return frames_file.empty() ? client::ShapeSource(meshes) : client::ShapeSource(template_file, frames_file);
}

std::string uploadShapes(const std::shared_ptr<grpc::Channel>& channel, const client::ShapeSource& shapes,
                         const std::string& prefix, const Session& session, ProgressBar& bar) {
  const auto count = static_cast<double>(shapes.count());
  return client::uploadDataset(channel, client::contentName(shapes, prefix), shapes, session.callOptions(),
                               [&](std::int64_t sent) { bar.show(static_cast<double>(sent) / count, "uploading"); })
      .name();
}

}  // namespace shaped::shapectl
