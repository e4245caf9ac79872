#pragma once

#include <string>
#include <vector>

#include "client/dataset_upload.h"
#include "client/shapectl/arguments.h"
#include "client/shapectl/progress_bar.h"
#include "client/shapectl/session.h"

namespace shaped::shapectl {

/// Shapes of one connectivity as the command line names them.
struct TrainingShapes {
  std::vector<std::string> meshes;
  std::string template_file, frames_file;

  /// MESH..., --template and --frames; declare after all other words.
  void declare(Arguments& arguments);
  bool given() const { return !meshes.empty() || !template_file.empty() || !frames_file.empty(); }
  /// Throws InvalidInput naming what is missing or too much, and as ShapeSource.
  client::ShapeSource source() const;
};

/// Uploads shapes under a name that follows from their content, which it returns.
std::string uploadShapes(const std::shared_ptr<grpc::Channel>& channel, const client::ShapeSource& shapes,
                         const std::string& prefix, const Session& session, ProgressBar& bar);

}  // namespace shaped::shapectl
