#pragma once

#include <torch/types.h>

#include <Eigen/Core>

namespace shaped {

/// A copy of a matrix as a tensor of its shape, row-major, of its own type or another.
template <class Derived>
torch::Tensor tensorOf(const Eigen::MatrixBase<Derived>& matrix,
                       torch::Dtype type = c10::CppTypeToScalarType<typename Derived::Scalar>::value) {
  using Number = typename Derived::Scalar;
  Eigen::Matrix<Number, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor> rows = matrix;
  return torch::from_blob(rows.data(), {rows.rows(), rows.cols()}, c10::CppTypeToScalarType<Number>::value)
      .to(type, /*non_blocking=*/false, /*copy=*/true);
}

/// A copy of a tensor of one or two dimensions as a matrix of a row-major type such as Vertices, or as a vector.
template <class Matrix>
Matrix matrixOf(const torch::Tensor& tensor) {
  using Number = typename Matrix::Scalar;
  const auto numbers = tensor.detach().to(c10::CppTypeToScalarType<Number>::value).contiguous();
  return Eigen::Map<const Matrix>(numbers.template data_ptr<Number>(), tensor.size(0),
                                  tensor.dim() == 1 ? 1 : tensor.size(1));
}

}  // namespace shaped
