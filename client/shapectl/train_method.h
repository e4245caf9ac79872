#pragma once

#include <memory>
#include <string>
#include <vector>

#include "client/dataset_upload.h"
#include "client/shapectl/arguments.h"
#include "shaped/v1/jobs.pb.h"

namespace shaped::shapectl {

/// A way to train a model: its options on the command line, and what it asks of the daemon.
class TrainMethod {
 public:
  virtual ~TrainMethod() = default;
  /// The word on the command line: "shell-pga".
  virtual std::string name() const = 0;
  virtual void declare(Arguments& arguments) = 0;
  /// The option of this method that was given, "" for none: it goes with no other method.
  virtual std::string given() const = 0;
  /// shapes: what is trained on. modes: 0: the method's own choice. Throws InvalidInput naming the option or its file.
  virtual void fill(const client::ShapeSource& shapes, std::uint32_t modes, v1::TrainRequest& request) const = 0;
};

/// Of --posture, "" for none given. Throws InvalidInput.
v1::PostureNormalisation postureNamed(const std::string& text);
/// A rig file as it travels; says on stderr where weights are far from summing to 1. Throws InvalidInput naming the file
/// and what is wrong in it for such a mesh.
std::string rigText(const std::string& file, Eigen::Index vertex_count);

/// All of them, the one that is named first in the help first.
std::vector<std::unique_ptr<TrainMethod>> trainMethods();

/// The one of that name. Throws InvalidInput naming METHOD, or an option of another method.
const TrainMethod& methodNamed(const std::vector<std::unique_ptr<TrainMethod>>& methods, const std::string& name);

}  // namespace shaped::shapectl
