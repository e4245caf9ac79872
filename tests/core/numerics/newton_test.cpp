#include "core/numerics/newton.h"

#include <Eigen/Dense>
#include <Eigen/Eigenvalues>
#include <catch2/catch.hpp>
#include <limits>

#include "tests/support/random_blocks.h"

using namespace shaped;
using namespace shaped::test;

namespace {

/// A ring of points in double wells along x joined by springs: sum (x^2 - 1)^2 + y^2 + z^2 + 1/2 stiffness |p - q|^2 +
/// c x. Indefinite Hessian wherever |x| is small.
class DoubleWells : public NewtonObjective {
 public:
  DoubleWells(std::int32_t nodes, double stiffness)
      : fixed(nodes), nodes_(nodes), stiffness_(stiffness), pattern_(ringPattern(nodes)) {}

  CholeskyAnalysisPtr analysis() const { return std::make_shared<const CholeskyAnalysis>(pattern_); }

  double energy(const Eigen::VectorXd& x) const {
    double sum = 0;
    for (std::int32_t n = 0; n < nodes_; ++n) {
      const double u = x[3 * n];
      sum += (u * u - 1) * (u * u - 1) + x[3 * n + 1] * x[3 * n + 1] + x[3 * n + 2] * x[3 * n + 2] + 0.1 * u;
      sum += 0.5 * stiffness_ * (x.segment<3>(3 * n) - x.segment<3>(3 * next(n))).squaredNorm();
    }
    return sum;
  }

  double value(const Eigen::VectorXd& x) override { return energy(x); }
  double noise() const override { return rounding; }

  double gradient(const Eigen::VectorXd& x, Eigen::VectorXd& g) override {
    energies.push_back(energy(x));
    g.setZero(x.size());
    for (std::int32_t n = 0; n < nodes_; ++n) {
      const double u = x[3 * n];
      g.segment<3>(3 * n) += Eigen::Vector3d(4 * u * (u * u - 1) + 0.1, 2 * x[3 * n + 1], 2 * x[3 * n + 2]);
      const Eigen::Vector3d pull = stiffness_ * (x.segment<3>(3 * n) - x.segment<3>(3 * next(n)));
      g.segment<3>(3 * n) += pull;
      g.segment<3>(3 * next(n)) -= pull;
    }
    return 1;
  }

  void hessian(const Eigen::VectorXd& x, bool projected, SymmetricBlockMatrix& h) override {
    (projected ? projections : exact_hessians) += 1;
    const auto add = [&](std::int32_t r, std::int32_t c, const Eigen::Matrix3d& block) {
      Eigen::Map<Eigen::Matrix3d>(h.block(pattern_->lowerSlot(r, c))) += block;
    };
    for (std::int32_t n = 0; n < nodes_; ++n) {
      const double bow = 12 * x[3 * n] * x[3 * n] - 4;
      add(n, n, Eigen::Vector3d(projected ? std::abs(bow) : bow, 2, 2).asDiagonal());
      const Eigen::Matrix3d spring = stiffness_ * Eigen::Matrix3d::Identity();
      add(n, n, spring);
      add(next(n), next(n), spring);
      add(std::max(n, next(n)), std::min(n, next(n)), -spring);
    }
  }

  Pins pins(const Eigen::VectorXd&) override { return fixed; }

  Pins fixed;
  double rounding = 0;
  std::vector<double> energies;  ///< at every iterate, in order
  int exact_hessians = 0, projections = 0;

 private:
  std::int32_t next(std::int32_t n) const { return (n + 1) % nodes_; }

  std::int32_t nodes_;
  double stiffness_;
  BlockPatternPtr pattern_;
};

/// Wells whose functions can be made to fail after a number of gradients.
class FailingWells : public DoubleWells {
 public:
  using DoubleWells::DoubleWells;
  enum class Fault { kNone, kGradient, kHessian };
  Fault fault = Fault::kNone;
  std::size_t after = 0;

  double gradient(const Eigen::VectorXd& x, Eigen::VectorXd& g) override {
    const double scale = DoubleWells::gradient(x, g);
    if (fault == Fault::kGradient && energies.size() > after) g[0] = std::numeric_limits<double>::quiet_NaN();
    return scale;
  }
  void hessian(const Eigen::VectorXd& x, bool projected, SymmetricBlockMatrix& h) override {
    DoubleWells::hessian(x, projected, h);
    if (fault == Fault::kHessian && energies.size() > after) h.block(0)[0] = -1e6;
  }
};

Eigen::VectorXd nearTheHill(std::int32_t nodes, unsigned seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> uniform(-0.6, 0.6);
  return Eigen::VectorXd::NullaryExpr(3 * nodes, [&] { return uniform(random); });
}

}  // namespace

TEST_CASE("Newton's method descends a non-convex energy at every step and ends in a minimum") {
  for (unsigned seed = 0; seed < 8; ++seed) {
    DoubleWells wells(20, 0.3);
    const auto analysis = wells.analysis();
    const auto solved = minimise(wells, analysis, nearTheHill(20, seed), {});
    INFO("seed " << seed << ", " << name(solved.termination) << " after " << solved.iterations);
    REQUIRE(solved.converged());
    CHECK(solved.residual <= 1e-8);
    CHECK(wells.projections > 0);  // the start was not convex
    CHECK(static_cast<int>(wells.energies.size()) == solved.iterations + 1);
    for (std::size_t k = 1; k < wells.energies.size(); ++k) CHECK(wells.energies[k] <= wells.energies[k - 1]);  // the last steps may change it by less than rounding

    Eigen::VectorXd gradient;
    wells.gradient(solved.solution, gradient);
    CHECK(gradient.norm() == Approx(solved.residual).epsilon(1e-6).margin(1e-15));
    SymmetricBlockMatrix hessian(analysis->pattern());
    wells.hessian(solved.solution, false, hessian);
    const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> eigen(Eigen::MatrixXd(hessian.toSparse()));
    CHECK(eigen.eigenvalues().minCoeff() > 0);
  }
}

TEST_CASE("Newton's method converges quadratically near a minimum") {
  DoubleWells wells(12, 0.3);
  wells.rounding = 1e-14;
  const auto analysis = wells.analysis();
  const auto minimum = minimise(wells, analysis, nearTheHill(12, 3), {60, 1e-10, {}});
  REQUIRE(minimum.converged());
  const Eigen::VectorXd start = minimum.solution + 0.01 * Eigen::VectorXd::Ones(36);
  const auto solved = minimise(wells, analysis, start, {60, 1e-10, {}});
  CHECK(solved.converged());
  CHECK(solved.iterations <= 5);
  CHECK((solved.solution - minimum.solution).norm() < 1e-10);
}

TEST_CASE("pinned unknowns stay where they started and do not count in the residual") {
  DoubleWells wells(10, 0.5);
  wells.fixed.pinAll(4);
  wells.fixed.pin(7, 0);
  const Eigen::VectorXd start = nearTheHill(10, 1);
  const auto solved = minimise(wells, wells.analysis(), start, {});
  REQUIRE(solved.converged());
  CHECK((solved.solution.segment<3>(12) - start.segment<3>(12)).norm() == 0);
  CHECK(solved.solution[21] == start[21]);
  Eigen::VectorXd gradient;
  wells.gradient(solved.solution, gradient);
  CHECK(gradient.segment<3>(12).norm() > 1e-3);
  gradient.segment<3>(12).setZero();
  gradient[21] = 0;
  CHECK(gradient.norm() <= 1e-8);
}

TEST_CASE("a solve says truthfully how it ended") {
  const Eigen::VectorXd start = nearTheHill(10, 2);
  using Fault = FailingWells::Fault;
  FailingWells wells(10, 0.3);
  const auto analysis = wells.analysis();

  SECTION("iteration limit: the best iterate, better than the start") {
    const auto solved = minimise(wells, analysis, start, {2, 1e-12, {}});
    CHECK(solved.termination == Termination::kIterationLimit);
    CHECK(solved.iterations == 2);
    CHECK(solved.residual > 1e-12);
    CHECK(wells.energy(solved.solution) < wells.energy(start));
  }
  SECTION("cancelled before the first step: the start, untouched") {
    std::stop_source source;
    source.request_stop();
    const auto solved = minimise(wells, analysis, start, {60, 1e-8, source.get_token()});
    CHECK(solved.termination == Termination::kCancelled);
    CHECK(solved.iterations == 0);
    CHECK(solved.solution == start);
    CHECK(wells.exact_hessians == 0);
  }
  SECTION("cancelled on the way: no further Hessian is formed") {
    std::stop_source source;
    class Stopping : public DoubleWells {
     public:
      Stopping(std::stop_source& stop) : DoubleWells(10, 0.3), stop_(stop) {}
      double gradient(const Eigen::VectorXd& x, Eigen::VectorXd& g) override {
        if (energies.size() == 2) stop_.request_stop();
        return DoubleWells::gradient(x, g);
      }

     private:
      std::stop_source& stop_;
    } stopping(source);
    const auto solved = minimise(stopping, analysis, start, {60, 1e-8, source.get_token()});
    CHECK(solved.termination == Termination::kCancelled);
    CHECK(solved.iterations == 2);
    CHECK(stopping.exact_hessians == 2);
    CHECK(stopping.energy(solved.solution) < stopping.energy(start));
  }
  SECTION("cancelled within a step: it is not taken, and nothing more is computed") {
    class Stopping : public DoubleWells {
     public:
      explicit Stopping(bool in_value) : DoubleWells(10, 0.3), in_value_(in_value) {}
      double value(const Eigen::VectorXd& x) override {
        ++values;
        if (in_value_) stop.request_stop();
        return DoubleWells::value(x);
      }
      void hessian(const Eigen::VectorXd& x, bool projected, SymmetricBlockMatrix& h) override {
        if (!in_value_) stop.request_stop();
        DoubleWells::hessian(x, projected, h);
      }
      std::stop_source stop;
      int values = 0;

     private:
      const bool in_value_;
    };
    for (const bool in_value : {false, true}) {
      Stopping stopping(in_value);
      const auto solved = minimise(stopping, analysis, start, {60, 1e-8, stopping.stop.get_token()});
      CHECK(solved.termination == Termination::kCancelled);
      CHECK(solved.iterations == 0);
      CHECK(solved.solution == start);
      CHECK(stopping.exact_hessians + stopping.projections <= (in_value ? 2 : 1));
      CHECK(stopping.values == (in_value ? 1 : 0));
    }
  }
  SECTION("a converged solve is not called cancelled") {
    const auto solved = minimise(wells, analysis, start, {});
    std::stop_source source;
    source.request_stop();
    CHECK(minimise(wells, analysis, solved.solution, {60, 1e-8, source.get_token()}).converged());
  }
  SECTION("stalled: no step lowers the energy") {
    class Walled : public DoubleWells {  // beyond the third iterate every trial costs more
     public:
      Walled() : DoubleWells(10, 0.3) {}
      double value(const Eigen::VectorXd& x) override {
        return x == wall || energies.size() < 3 ? energy(x) : energy(wall) + 1;
      }
      double gradient(const Eigen::VectorXd& x, Eigen::VectorXd& g) override {
        wall = x;
        return DoubleWells::gradient(x, g);
      }
      Eigen::VectorXd wall;
    } walled;
    const auto solved = minimise(walled, analysis, start, {});
    CHECK(solved.termination == Termination::kStalled);
    CHECK(solved.iterations == 2);
    CHECK(solved.solution == walled.wall);
    CHECK(solved.residual > 1e-8);
  }
  SECTION("numerical failure at once or on the way: the start, unchanged") {
    for (const auto fault : {Fault::kGradient, Fault::kHessian})
      for (const std::size_t after : {0u, 2u}) {
        FailingWells failing(10, 0.3);
        failing.fault = fault;
        failing.after = after;
        const auto solved = minimise(failing, analysis, start, {});
        CHECK(solved.termination == Termination::kNumericalFailure);
        CHECK(solved.solution == start);
        CHECK(solved.iterations == static_cast<int>(after));
      }
  }
}

TEST_CASE("backtracking halves until Armijo's rule holds, treats non-finite values as walls, and gives up with 0") {
  const auto parabola = [](double t) { return (t - 0.3) * (t - 0.3); };
  CHECK(backtrack(parabola, parabola(0), -0.6, 0) == 0.5);
  CHECK(backtrack([](double t) { return -t; }, 0, -1, 0) == 1);
  for (const double wall : {std::numeric_limits<double>::infinity(), std::numeric_limits<double>::quiet_NaN()})
    CHECK(backtrack([&](double t) { return t > 0.2 ? wall : -t; }, 0, -1, 0) == 0.125);
  CHECK(backtrack([](double t) { return t; }, 0, -1, 0) == 0);
  CHECK(backtrack([](double) { return 1e-15; }, 0, -1e-20, 1e-14) == 1);  // hidden in rounding: the full step
}
