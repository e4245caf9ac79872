#include "core/numerics/gmres.h"

#include <Eigen/Dense>
#include <Eigen/Jacobi>
#include <vector>

namespace shaped {

double gmres(const LinearMap& matrix, const LinearMap& preconditioner, const Eigen::VectorXd& b, double reduction,
             int limit, Eigen::VectorXd& x, const std::stop_token& stop) {
  Eigen::VectorXd r, w, image;
  x.setZero(b.size());
  if (stop.stop_requested()) return 1;
  preconditioner(b, r);
  const double start = r.norm();
  if (start == 0) return 0;
  std::vector<Eigen::VectorXd> basis{r / start};
  Eigen::MatrixXd h = Eigen::MatrixXd::Zero(limit + 1, limit);
  Eigen::VectorXd g = Eigen::VectorXd::Zero(limit + 1);
  g[0] = start;
  std::vector<Eigen::JacobiRotation<double>> rotations;
  int k = 0;
  for (; k < limit && std::abs(g[k]) > reduction * start && !stop.stop_requested(); ++k) {
    matrix(basis.back(), image);
    preconditioner(image, w);
    const double size = w.norm();
    for (int i = 0; i <= k; ++i) {
      h(i, k) = w.dot(basis[static_cast<std::size_t>(i)]);
      w -= h(i, k) * basis[static_cast<std::size_t>(i)];
    }
    const double rest = w.norm();
    for (int i = 0; i < k; ++i) {
      const double upper = h(i, k), lower = h(i + 1, k);
      h(i, k) = rotations[static_cast<std::size_t>(i)].c() * upper + rotations[static_cast<std::size_t>(i)].s() * lower;
      h(i + 1, k) =
          -rotations[static_cast<std::size_t>(i)].s() * upper + rotations[static_cast<std::size_t>(i)].c() * lower;
    }
    const double length = std::hypot(h(k, k), rest);
    if (!(length > 0)) break;
    rotations.emplace_back(h(k, k) / length, rest / length);
    h(k, k) = length;
    g[k + 1] = -rotations.back().s() * g[k];
    g[k] *= rotations.back().c();
    if (rest <= 1e-14 * size) {  // the Krylov space is exhausted
      ++k;
      break;
    }
    basis.push_back(w / rest);
  }
  const Eigen::VectorXd y = h.topLeftCorner(k, k).triangularView<Eigen::Upper>().solve(g.head(k));
  for (int i = 0; i < k; ++i) x += y[i] * basis[static_cast<std::size_t>(i)];
  return std::abs(g[k]) / start;
}

}  // namespace shaped
