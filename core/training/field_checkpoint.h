#pragma once

#include <filesystem>
#include <string>

#include "core/training/field_training.h"

namespace shaped {

/// Writes a state of training as sealed tensors (core/io/sealed_tensors.h), bit for bit. training: what it was training
/// on and how, in the caller's words. Throws FileError.
void writeFieldCheckpoint(const std::filesystem::path& path, const FieldTrainingState& state,
                          const std::string& training);

struct FieldCheckpoint {
  FieldTrainingState state;
  std::string training;
};

/// Throws InvalidInput naming the file when it is damaged or no such checkpoint.
FieldCheckpoint readFieldCheckpoint(const std::filesystem::path& path);

}  // namespace shaped
