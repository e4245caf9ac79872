#include "core/model/model_kinds.h"

#include "core/io/file_error.h"
#include "core/model/body_shapes.h"
#include "core/model/shell_pga_file.h"
#include "core/model/shell_pga_shapes.h"

namespace shaped {
namespace {

/// To add a kind: its ShapeModel and its reader, and a line below.
struct Kind {
  const char* name;
  void (*require)(const ModelManifest& manifest);
  ShapeModelPtr (*from)(const ModelManifest& manifest, const std::shared_ptr<const TensorFile>& tensors);
};

ShapeModelPtr shellPga(const ModelManifest& manifest, const std::shared_ptr<const TensorFile>& tensors) {
  return std::make_shared<const ShellPgaShapes>(shellPgaFrom(manifest, tensors));
}

ShapeModelPtr body(const ModelManifest& manifest, const std::shared_ptr<const TensorFile>& tensors) {
  auto stored = bodyFrom(manifest, *tensors);
  return std::make_shared<const BodyShapes>(std::move(stored.model), std::move(stored.training),
                                            std::move(stored.field));
}

constexpr Kind kKinds[] = {{kShellPgaKind, requireShellPga, shellPga}, {kBodyKind, requireBody, body}};

const Kind& kindOf(const ModelManifest& manifest) {
  std::string known;
  for (const auto& kind : kKinds) {
    if (manifest.kind == kind.name) return kind;
    known += std::string(known.empty() ? "\"" : " or \"") + kind.name + "\"";
  }
  throw InvalidInput("manifest", "is of kind \"" + manifest.kind + "\", want " + known);
}

}  // namespace

void requireServable(const ModelManifest& manifest) { kindOf(manifest).require(manifest); }

ShapeModelPtr shapeModelFrom(const ModelManifest& manifest, const std::shared_ptr<const TensorFile>& tensors) {
  return kindOf(manifest).from(manifest, tensors);
}

ShapeModelPtr loadShapeModel(const StoredModel& stored) try {
  return shapeModelFrom(stored.manifest, stored.tensors);
} catch (const InvalidInput& problem) {
  throw FileError("model " + stored.name + " version " + std::to_string(stored.version),
                  std::string("cannot be used: ") + problem.what());
}

}  // namespace shaped
