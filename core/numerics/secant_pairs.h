#pragma once

#include <Eigen/Core>
#include <deque>
#include <functional>

namespace shaped {

/// The last steps of a descent and how the gradient changed over each: what makes an inverse Hessian of a place nearby
/// into one of here (the limited-memory BFGS method; Nocedal and Wright, algorithm 7.4).
class SecantPairs {
 public:
  /// most: pairs that are kept, >= 1.
  explicit SecantPairs(std::size_t most) : most_(most) {}

  /// Forgets the oldest pair where there are too many. A pair whose curvature is not clearly positive is left out.
  void add(const Eigen::VectorXd& step, const Eigen::VectorXd& change);
  void clear() { pairs_.clear(); }
  std::size_t size() const { return pairs_.size(); }

  /// B gradient. initial(v): the product of the inverse Hessian to begin with, symmetric and positive definite, and v.
  /// B is positive definite too.
  Eigen::VectorXd multiply(const std::function<Eigen::VectorXd(const Eigen::VectorXd&)>& initial,
                           const Eigen::VectorXd& gradient) const;

 private:
  struct Pair {
    Eigen::VectorXd step, change;
    double curvature = 0;
  };

  std::size_t most_;
  std::deque<Pair> pairs_;
};

}  // namespace shaped
