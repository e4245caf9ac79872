#pragma once

#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "core/training/field_training.h"

namespace shaped::server {

/// What a job folder asks shaped-trainer to do: the content of its job.json,
///   {"kind": "jacobian_field",
///    "references": {"body": "body.safetensors"},
///    "pairs": [{"reference": "body", "file": "pair_0.safetensors"}],
///    "scaling": "body",
///    "architecture": {"source_net": [64, 64, 64], "scan_net": [64, 64, 64], "mlp": [128, 128, 128], "offsets": false},
///    "options": {"epochs": 100, "batch": 4, "learning_rate": 1e-3, "last_learning_rate": 1e-5, "warm_up": 100,
///                "vertex_weight": 10, "jacobian_weight": 1, "seed": 1},
///    "threads": 1, "checkpoint_seconds": 60}
/// The first three are required; what else is left out has the value above. Files are names within the folder.
///
/// A reference's file: `faces`, F x 3 I32, and `shape`, V x 3 F64 or F32 [m], the shape that Jacobians are taken
/// against. A pair's file: `source` and `target`, V x 3, and `scan`, P x 3, all F64 or F32 [m], in the rest pose;
/// perhaps `scan_normals`, P x 3.
///
/// The trainer writes into the folder: checkpoint.safetensors (core/training/field_checkpoint.h), replaced as it goes
/// on, and from which a later run of the same job goes on; and at the end field.safetensors, the field under the name
/// `field` (core/neural/jacobian_field_file.h).
struct JobSpec {
  struct Pair {
    std::string reference, file;
  };

  std::map<std::string, std::string> references;  ///< files by name
  std::vector<Pair> pairs;
  std::string scaling;  ///< the reference whose size and signatures set the scale of inputs; the first pair's
  FieldArchitecture architecture;
  FieldTrainingOptions options;    ///< without stop and callback
  int threads = 1;                 ///< >= 1; what is learned does not depend on it
  double checkpoint_seconds = 60;  ///< at least so long between checkpoints, >= 0

  /// All that decides what is learned, but for what the files hold: a checkpoint is of this training or of another.
  std::string training() const;
};

/// Reads <folder>/job.json. Throws InvalidInput naming the file and the field that is missing, unknown, of another
/// type or out of range.
JobSpec readJobSpec(const std::filesystem::path& folder);

}  // namespace shaped::server
