#include "core/numerics/secant_pairs.h"

#include <vector>

namespace shaped {

void SecantPairs::add(const Eigen::VectorXd& step, const Eigen::VectorXd& change) {
  const double curvature = step.dot(change);
  if (!(curvature > 1e-8 * step.norm() * change.norm())) return;
  if (pairs_.size() == most_) pairs_.pop_front();
  pairs_.push_back({step, change, curvature});
}

Eigen::VectorXd SecantPairs::multiply(const std::function<Eigen::VectorXd(const Eigen::VectorXd&)>& initial,
                                      const Eigen::VectorXd& gradient) const {
  Eigen::VectorXd rest = gradient;
  std::vector<double> shares(pairs_.size());
  for (std::size_t k = pairs_.size(); k-- > 0;) {
    shares[k] = pairs_[k].step.dot(rest) / pairs_[k].curvature;
    rest -= shares[k] * pairs_[k].change;
  }
  Eigen::VectorXd result = initial(rest);
  for (std::size_t k = 0; k < pairs_.size(); ++k)
    result += (shares[k] - pairs_[k].change.dot(result) / pairs_[k].curvature) * pairs_[k].step;
  return result;
}

}  // namespace shaped
