#include "tests/support/dense_descent.h"

#include <cmath>

namespace shaped::test {
namespace {

Eigen::VectorXd gradientOf(const std::function<double(const Eigen::VectorXd&)>& f, const Eigen::VectorXd& x) {
  constexpr double step = 1e-5;
  Eigen::VectorXd gradient(x.size()), moved = x;
  for (Eigen::Index i = 0; i < x.size(); ++i) {
    moved[i] = x[i] + step;
    const double above = f(moved);
    moved[i] = x[i] - step;
    gradient[i] = (above - f(moved)) / (2 * step);
    moved[i] = x[i];
  }
  return gradient;
}

}  // namespace

Eigen::VectorXd denseDescent(const std::function<double(const Eigen::VectorXd&)>& f, const Eigen::VectorXd& start,
                             int limit) {
  Eigen::VectorXd x = start, g = gradientOf(f, x);
  Eigen::MatrixXd inverse = Eigen::MatrixXd::Identity(x.size(), x.size()) / g.norm();
  double value = f(x);
  for (int k = 0; k < limit && g.norm() > 1e-10; ++k) {
    const Eigen::VectorXd direction = -(inverse * g);
    double length = 1, next = f(x + direction);
    while (!(next <= value + 1e-4 * length * g.dot(direction)) && length > 1e-10) {
      length *= 0.5;
      next = f(x + length * direction);
    }
    if (length <= 1e-10) break;
    const Eigen::VectorXd step = length * direction;
    const Eigen::VectorXd gradient = gradientOf(f, x + step), change = gradient - g;
    x += step;
    g = gradient;
    value = next;
    const double curvature = step.dot(change);
    if (!(curvature > 0)) continue;
    const Eigen::VectorXd image = inverse * change;
    inverse += (1 + change.dot(image) / curvature) / curvature * step * step.transpose() -
               (image * step.transpose() + step * image.transpose()) / curvature;
  }
  return x;
}

}  // namespace shaped::test
