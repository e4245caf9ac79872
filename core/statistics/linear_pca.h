#pragma once

#include <vector>

#include "core/mesh/types.h"

namespace shaped {

/// Linear principal component analysis of vertex positions, the baseline that Shell PGA is compared with.
struct LinearPca {
  Vertices mean;           ///< V x 3, in the common position of the aligned shapes
  Eigen::VectorXd values;  ///< variances of all n - 1 modes or fewer, falling [m^2]
  Eigen::MatrixXd modes;   ///< 3V x k, orthonormal columns, one per value
};

/// Generalised Procrustes alignment (rotation and translation) of the shapes to their mean, then PCA. n >= 2 shapes of
/// equal vertex count, else InvalidInput.
LinearPca linearPca(const std::vector<Vertices>& shapes);

/// The nearest point of the span of the first `modes` components (0 .. all) to a shape in any position: rigid alignment
/// and coefficients alternate until they settle. The result stands where `shape` does. coefficients: set where not null.
Vertices projectLinearly(const LinearPca& pca, const Vertices& shape, int modes, Eigen::VectorXd* coefficients = nullptr);

}  // namespace shaped
