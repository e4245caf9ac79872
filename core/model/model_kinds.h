#pragma once

#include "core/model/shape_model.h"

namespace shaped {

/// Throws InvalidInput naming "manifest" unless it is of a kind and format version that shapeModelFrom() reads.
void requireServable(const ModelManifest& manifest);

/// Builds a model of any kind out of its files. Throws InvalidInput as the kind's own reader (shellPgaFrom, bodyFrom).
ShapeModelPtr shapeModelFrom(const ModelManifest& manifest, const std::shared_ptr<const TensorFile>& tensors);

/// Builds the model that a stored version holds. Throws FileError naming the version where shapeModelFrom() throws.
ShapeModelPtr loadShapeModel(const StoredModel& stored);

}  // namespace shaped
