#include "core/numerics/simplex_qp.h"

#include <Eigen/Dense>
#include <algorithm>
#include <vector>

namespace shaped {
namespace {

/// The minimiser with x = 0 outside `free` and the sum kept at 1, and the multiplier of the sum.
struct Equality {
  Eigen::VectorXd x;
  double multiplier;
};

Equality solveOnFace(const Eigen::MatrixXd& b, const Eigen::VectorXd& g, const std::vector<Eigen::Index>& free) {
  const Eigen::MatrixXd inner = b(free, free);
  const Eigen::LDLT<Eigen::MatrixXd> factor(inner);
  const Eigen::VectorXd ones = factor.solve(Eigen::VectorXd::Ones(inner.rows()));
  const Eigen::VectorXd pull = factor.solve(Eigen::VectorXd(g(free)));
  const double multiplier = (1 + pull.sum()) / ones.sum();  // B x + g = multiplier on the face
  Equality result{Eigen::VectorXd::Zero(g.size()), multiplier};
  result.x(free) = multiplier * ones - pull;
  return result;
}

}  // namespace

Eigen::VectorXd minimiseOnSimplex(const Eigen::MatrixXd& b, const Eigen::VectorXd& g, const Eigen::VectorXd& start) {
  Eigen::VectorXd x = start;
  std::vector<Eigen::Index> free;
  for (Eigen::Index i = 0; i < x.size(); ++i)
    if (x[i] > 0) free.push_back(i);
  const auto limit = 20 * x.size() + 50;
  for (Eigen::Index round = 0; round < limit; ++round) {
    const auto target = solveOnFace(b, g, free);
    double step = 1;
    Eigen::Index blocking = -1;
    for (const auto i : free)
      if (target.x[i] < 0 && x[i] / (x[i] - target.x[i]) < step) {
        step = x[i] / (x[i] - target.x[i]);
        blocking = i;
      }
    x += step * (target.x - x);
    if (blocking >= 0) {
      x[blocking] = 0;
      std::erase(free, blocking);
      continue;
    }
    // on the face's minimum: free the bound unknown that gains most
    const Eigen::VectorXd slope = b * x + g;
    Eigen::Index entering = -1;
    double most = -1e-12 * (slope.cwiseAbs().maxCoeff() + std::abs(target.multiplier));
    for (Eigen::Index i = 0; i < x.size(); ++i)
      if (x[i] == 0 && slope[i] - target.multiplier < most && std::find(free.begin(), free.end(), i) == free.end()) {
        most = slope[i] - target.multiplier;
        entering = i;
      }
    if (entering < 0) break;
    free.push_back(entering);
  }
  return x.cwiseMax(0) / x.cwiseMax(0).sum();
}

}  // namespace shaped
