#pragma once

#include <string>

#include "core/io/tensor_file.h"
#include "core/mesh/thin_plate.h"

namespace shaped {

/// How a sparse matrix lies in a model's tensor file: `name`.row_begin (rows + 1), `name`.columns and `name`.values.
void addSparse(TensorWriter& tensors, const std::string& name, const SparseRows& matrix);

/// Throws InvalidInput naming `name` when sizes do not fit, row limits fall or lie beyond the end, a column is out of
/// range, or a number is not finite. Entries of the same place are added up.
SparseRows sparseFrom(const TensorFile& tensors, const std::string& name, Eigen::Index rows, Eigen::Index columns);

}  // namespace shaped
