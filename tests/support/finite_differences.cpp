#include "tests/support/finite_differences.h"

namespace shaped::test {

Vertices differenceGradient(const std::function<double(const Vertices&)>& f, const Vertices& at, double step) {
  Vertices gradient(at.rows(), 3), moved = at;
  for (Eigen::Index i = 0; i < at.size(); ++i) {
    const auto valueAt = [&](double distance) {
      moved.data()[i] = at.data()[i] + distance;
      return f(moved);
    };
    const double near = valueAt(step) - valueAt(-step), far = valueAt(2 * step) - valueAt(-2 * step);
    gradient.data()[i] = (8 * near - far) / (12 * step);
    moved.data()[i] = at.data()[i];
  }
  return gradient;
}

Eigen::MatrixXd differenceJacobian(const std::function<Eigen::VectorXd(const Vertices&)>& f, const Vertices& at,
                                   double step) {
  Eigen::MatrixXd result(f(at).size(), at.size());
  for (Eigen::Index i = 0; i < at.size(); ++i) {
    Vertices plus = at, minus = at;
    plus.data()[i] += step;
    minus.data()[i] -= step;
    result.col(i) = (f(plus) - f(minus)) / (2 * step);
  }
  return result;
}

}  // namespace shaped::test
