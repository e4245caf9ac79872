#include "core/statistics/submanifold.h"

#include <catch2/catch.hpp>
#include <thread>

#include "core/numerics/error.h"
#include "core/shell/energy.h"
#include "tests/support/literal_forces.h"
#include "tests/support/training_set.h"

using namespace shaped;
using namespace shaped::test;

namespace {

/// A trained model with the set it comes from.
struct Model {
  TrainingSet set = variedTubes();
  std::shared_ptr<const ShellPga> pga;
  std::shared_ptr<const Submanifold> manifold;
  Spider spider;

  Model(int steps, int modes) : spider(set.spider(steps)) {
    pga = std::make_shared<const ShellPga>(principalVariations(*set.calculus, spider, modes, {}).solution);
    manifold = std::make_shared<const Submanifold>(set.calculus, pga);
  }

  SubmanifoldProjection project(const Vertices& shape, const SubmanifoldOptions& options = {},
                                const SubmanifoldProjection* warm = nullptr) const {
    const auto solved = manifold->project(shape, options, warm);
    INFO(name(solved.termination) << ", residual " << solved.residual << ", " << solved.iterations << " iterations");
    REQUIRE(solved.converged());
    checkWeights(solved.solution.point);
    return solved.solution;
  }
  static void checkWeights(const SubmanifoldPoint& point) {
    CHECK(point.alpha.minCoeff() >= 0);
    CHECK(point.alpha.sum() == Approx(1).epsilon(1e-12));
    CHECK(point.scale > 0);
    CHECK(point.scale <= 1);
  }
  Vertices shapeOf(const SubmanifoldPoint& point) const {
    const auto solved = manifold->shapeOf(point, {});
    REQUIRE(solved.converged());
    return solved.solution.shape;
  }
  /// The distance of a shape from another in units of its distance from the mean.
  double relativeGap(const Vertices& found, const Vertices& shape) const {
    return rigidGap(found, shape) / rigidGap(shape, pga->mean);
  }
};

/// Weights off the faces of the simplex, J = 4.
SubmanifoldPoint somePoint(double scale) {
  Eigen::VectorXd alpha(8);
  alpha << 0.3, 0.05, 0.15, 0.1, 0.1, 0.1, 0.05, 0.15;
  return {alpha, scale};
}

}  // namespace

TEST_CASE("q(alpha) balances (26) by literal forces") {
  const Model model(2, 4);
  const auto alpha = somePoint(1).alpha;
  const auto solved = model.manifold->average(alpha, model.pga->mean, {});
  REQUIRE(solved.converged());
  std::vector<Vertices> forces;
  for (Eigen::Index j = 0; j < 8; ++j)
    forces.push_back(alpha[j] * literalSecondForce(*model.set.mesh.topology,
                                                   model.pga->variations[static_cast<std::size_t>(j)], solved.solution,
                                                   model.set.calculus->bending()));
  CHECK(relativeImbalance(forces) < 2e-8);
}

TEST_CASE("the local projection (18) is optimal: no change of the weights lowers W[s_loc, q(alpha)]") {
  const Model model(2, 3);
  for (const std::size_t i : {0, 1, 4}) {
    const auto projection = model.project(model.set.shapes[i]);
    const auto& alpha = projection.point.alpha;
    const Vertices target = model.set.calculus->at(projection.geodesic, projection.point.scale, {}).solution;
    const auto energy = [&](const Eigen::VectorXd& weights) {
      const auto q = model.manifold->average(weights, projection.local, {}).solution;
      return shellEnergy(*model.set.mesh.topology, target, q, model.set.calculus->bending());
    };
    const double least = energy(alpha),
                 size = shellEnergy(*model.set.mesh.topology, model.pga->mean, target, model.set.calculus->bending());
    CHECK(least == Approx(projection.local_energy).epsilon(1e-6).margin(1e-9 * size));
    for (Eigen::Index a = 0; a < alpha.size(); ++a)
      for (Eigen::Index b = 0; b < alpha.size(); ++b) {
        if (a == b || alpha[a] == 0) continue;
        INFO("shape " << i << ", weight from " << a << " to " << b);
        const double h = std::min(1e-3, alpha[a]);  // one-sided at a face, two-sided inside
        Eigen::VectorXd moved = alpha;
        moved[a] -= h;
        moved[b] += h;
        CHECK(energy(moved) > least - 1e-9 * size);
        if (alpha[b] < h) continue;
        moved = alpha;
        moved[a] += h;
        moved[b] -= h;
        CHECK(energy(moved) > least - 1e-9 * size);
      }
  }
}

TEST_CASE("shapes of the submanifold are projected to themselves, the better the larger K") {
  std::vector<double> worst;
  for (const int steps : {2, 4, 8}) {
    const Model model(steps, 4);
    double error = 0;
    for (const double scale : {0.03, 0.1}) {
      const Vertices shape = model.shapeOf(somePoint(scale * 4 / steps));
      error = std::max(error, model.relativeGap(model.project(shape).shape, shape));
    }
    worst.push_back(error);
  }
  CHECK(worst[0] < 0.05);
  for (std::size_t k = 1; k < worst.size(); ++k) CHECK(order(worst[k - 1], worst[k]) > 0.8);
}

TEST_CASE("projecting twice changes nothing more: P[P[s]] = P[s]") {
  for (const int modes : {3, 4})
    for (const int steps : {2, 4}) {
      const Model model(steps, modes);
      for (const auto& shape : model.set.shapes) {
        const auto once = model.project(shape);
        INFO("J = " << modes << ", K = " << steps);
        // with fewer modes P[s] is nearer than s, its scale another, and C_J not quite a cone
        CHECK(model.relativeGap(model.project(once.shape).shape, once.shape) < (modes == 4 ? 2e-5 : 2e-3));
      }
    }
}

TEST_CASE("with all n - 1 modes the training shapes are reproduced, to an error that falls with K") {
  std::vector<double> all, fewer;
  for (const int steps : {2, 4, 8}) {
    const Model model(steps, 4);
    double error = 0, error_of_two = 0;
    for (const auto& shape : model.set.shapes) {
      error = std::max(error, model.relativeGap(model.project(shape).shape, shape));
      SubmanifoldOptions two;
      two.modes = 2;
      error_of_two = std::max(error_of_two, model.relativeGap(model.project(shape, two).shape, shape));
    }
    all.push_back(error);
    fewer.push_back(error_of_two);
  }
  CHECK(all[0] < 0.1);
  CHECK(all[2] < 0.03);
  for (std::size_t k = 1; k < all.size(); ++k) CHECK(order(all[k - 1], all[k]) > 0.8);
  CHECK(fewer[2] > 3 * all[2]);  // the control: two modes cannot
}

TEST_CASE("tangent coordinates of the training shapes are centred with the eigenvalues as variances, in the limit") {
  std::vector<double> errors, centres;
  for (const int steps : {2, 4, 8}) {
    const Model model(steps, 4);
    Eigen::MatrixXd coordinates(5, 4);
    for (Eigen::Index i = 0; i < 5; ++i)
      coordinates.row(i) =
          model.manifold->tangentCoordinates(model.project(model.set.shapes[static_cast<std::size_t>(i)]).point);
    const Eigen::VectorXd eigenvalues = model.pga->eigenvalues.head(4);
    const Eigen::VectorXd variance = coordinates.colwise().squaredNorm() / 5;
    errors.push_back((variance.cwiseQuotient(eigenvalues).array() - 1).abs().maxCoeff());
    centres.push_back((coordinates.colwise().mean().transpose().array() / eigenvalues.array().sqrt()).abs().maxCoeff());
    const Eigen::MatrixXd covariance = coordinates.transpose() * coordinates / 5;
    for (Eigen::Index a = 0; a < 4; ++a)
      for (Eigen::Index b = 0; b < a; ++b)
        CHECK(std::abs(covariance(a, b)) < 0.1 * std::sqrt(eigenvalues[a] * eigenvalues[b]));
  }
  CHECK(errors[0] < 0.1);
  CHECK(errors[2] < 0.03);
  CHECK(order(errors[0], errors[2]) > 1.6);  // over two halvings
  CHECK(order(centres[0], centres[2]) > 1.6);
}

TEST_CASE("shapeOf returns the projection of its point, and agrees with plain repeated extrapolation") {
  const Model model(4, 4);
  for (const auto& shape : model.set.shapes) {
    const auto projection = model.project(shape);
    CHECK(model.relativeGap(model.shapeOf(projection.point), projection.shape) < 1e-6);
  }
  const auto q = model.manifold->average(somePoint(1).alpha, model.pga->mean, {}).solution;
  CHECK(rigidGap(model.shapeOf(somePoint(1)), q) < 1e-9);
  for (const double factor : {1.0, 1.7, 2.0, 3.5, 4.0, 8.0, 13.0, 30.0}) {
    const Vertices shape = model.shapeOf(somePoint(1 / factor));
    const auto plain = model.set.calculus->at({model.pga->mean, q}, factor, {});
    REQUIRE(plain.converged());
    INFO("factor " << factor);
    CHECK(rigidGap(shape, plain.solution) < 0.03 * rigidGap(shape, model.pga->mean));
    CHECK(rigidGap(shape, model.pga->mean) == Approx(factor * rigidGap(q, model.pga->mean)).epsilon(0.15));
  }
}

TEST_CASE("points far beyond the training shapes are still reached, in as many steps as that takes") {
  const Model model(2, 4);
  const auto point = somePoint(0.04);  // 3.5 standard deviations along the first mode
  const Vertices shape = model.shapeOf(point);
  const auto q = model.manifold->average(point.alpha, model.pga->mean, {}).solution;
  CHECK(rigidGap(shape, model.pga->mean) > 20 * rigidGap(q, model.pga->mean));
  CHECK(measure(*model.set.mesh.topology, shape).area.minCoeff() > 0.03);
  const auto plain = model.set.calculus->at({model.pga->mean, q}, 25, {});
  REQUIRE(plain.converged());
  CHECK(rigidGap(shape, plain.solution) < 0.05 * rigidGap(shape, model.pga->mean));
}

TEST_CASE("pointOf inverts the tangent coordinates with weights on the simplex") {
  const Model model(2, 4);
  for (const double size : {0.0, 1e-3, 0.5, 2.0}) {
    const Eigen::VectorXd y = size * (Eigen::VectorXd(4) << 0.5, -0.2, 0, 0.03).finished();
    const auto point = model.manifold->pointOf(y);
    CHECK(point.alpha.minCoeff() >= 0);
    CHECK(point.alpha.sum() == Approx(1).epsilon(1e-14));
    CHECK(point.scale > 0);
    CHECK((model.manifold->tangentCoordinates(point) - y).norm() < 1e-14);
  }
  CHECK(rigidGap(model.shapeOf(model.manifold->pointOf(Eigen::VectorXd::Zero(4))), model.pga->mean) < 3e-3);
  // through the shape and back: the coordinates of a synthesised shape are those it was made of
  const Eigen::VectorXd y = (Eigen::VectorXd(4) << 0.6, -0.3, 0.2, 0.05).finished();
  const auto projection = model.project(model.shapeOf(model.manifold->pointOf(y)));
  CHECK((model.manifold->tangentCoordinates(projection.point) - y).norm() < 0.05 * y.norm());
}

TEST_CASE("every vertex of the polyhedron is its own projection") {
  const Model model(4, 4);
  for (Eigen::Index j = 0; j < 8; ++j) {
    const SubmanifoldPoint corner{Eigen::VectorXd::Unit(8, j), 1};
    const auto& variation = model.pga->variations[static_cast<std::size_t>(j)];
    CHECK(rigidGap(model.shapeOf(corner), variation) < 1e-8);
    const auto projection = model.project(variation);
    INFO("variation " << j);
    CHECK(model.relativeGap(projection.shape, variation) < 0.03);
    const auto y = model.manifold->tangentCoordinates(projection.point);
    Eigen::Index largest;
    y.cwiseAbs().maxCoeff(&largest);
    CHECK(largest == j % 4);
    CHECK((y[largest] > 0) == (j < 4));
  }
}

TEST_CASE("the mean and shapes next to it are projected to themselves") {
  for (const int modes : {2, 4}) {
    const Model model(4, modes);
    CHECK(rigidGap(model.project(model.pga->mean).shape, model.pga->mean) < 3e-3);
    CHECK(rigidGap(model.project(moveRigidly(model.pga->mean, 3)).shape, model.pga->mean) < 3e-3);
    for (const double t : {1e-8, 1e-6, 1e-4, 1e-2}) {
      const Vertices shape = model.set.calculus->at(model.spider.arms[0], t, {}).solution;
      const auto projection = model.project(shape);
      INFO("t = " << t);
      CHECK(rigidGap(projection.shape, shape) < 3e-3);
    }
  }
}

TEST_CASE("rigid motions and units change no projection") {
  const Model model(3, 3);
  const auto still = model.project(model.set.shapes[0]);
  const auto moved = model.project(moveRigidly(model.set.shapes[0], 60));
  CHECK(rigidGap(moved.shape, still.shape) < 1e-5);
  CHECK((moved.point.alpha - still.point.alpha).norm() < 1e-4);
  CHECK(moved.point.scale == Approx(still.point.scale).epsilon(1e-8));

  const double s = 1e3;
  auto pga = *model.pga;
  pga.mean *= s;
  pga.eigenvalues *= s * s;
  auto variations = pga.variations.shapes();
  for (auto& variation : variations) variation *= s;
  pga.variations = ShapeStack(variations);
  const auto calculus =
      std::make_shared<const GeodesicCalculus>(model.set.calculus->structure(), s * s * model.set.calculus->bending());
  const Submanifold scaled(calculus, std::make_shared<const ShellPga>(pga));
  const auto solved = scaled.project(s * model.set.shapes[0], {});
  REQUIRE(solved.converged());
  CHECK(rigidGap(solved.solution.shape / s, still.shape) < 1e-5);
  CHECK(
      (scaled.tangentCoordinates(solved.solution.point) - s * model.manifold->tangentCoordinates(still.point)).norm() <
      1e-3 * s);
}

TEST_CASE("a warm start gives the same answer, also from a projection with other modes") {
  const Model model(4, 4);
  const Vertices shape = model.set.shapes[3], nearby = jitter(shape, 0.01, 7);
  const auto before = model.project(shape);
  const auto cold = model.project(nearby), warm = model.project(nearby, {}, &before);
  CHECK(model.relativeGap(warm.shape, cold.shape) < 1e-4);
  CHECK(warm.local_energy == Approx(cold.local_energy).epsilon(1e-4));
  CHECK(model.manifold->project(shape, {}, &before).iterations < model.manifold->project(shape, {}).iterations);

  SubmanifoldOptions one;
  one.modes = 1;
  auto other = before;
  other.point.alpha.setZero();
  other.point.alpha[3] = 1;  // nothing of the first mode
  CHECK(model.relativeGap(model.project(nearby, one, &other).shape, model.project(nearby, one).shape) < 1e-4);
}

TEST_CASE("fewer modes leave the other weights at zero and a larger residual") {
  const Model model(4, 4);
  double before = 0;
  for (const int modes : {4, 3, 2, 1}) {
    SubmanifoldOptions options;
    options.modes = modes;
    const auto projection = model.project(model.set.shapes[1], options);
    for (int j = modes; j < 4; ++j) {
      CHECK(projection.point.alpha[j] == 0);
      CHECK(projection.point.alpha[4 + j] == 0);
    }
    const double residual = rigidGap(projection.shape, model.set.shapes[1]);
    CHECK(residual > before);
    before = residual;
  }
}

TEST_CASE("the submanifold refuses points and modes that are none, and says when it was cancelled") {
  const Model model(2, 2);
  const auto shape = model.set.shapes[0];
  const auto refused = [&](const Eigen::VectorXd& alpha, double scale, const std::string& field) {
    CHECK_THROWS_WITH(model.manifold->shapeOf({alpha, scale}, {}), Catch::Contains(field));
  };
  const Eigen::VectorXd good = Eigen::VectorXd::Constant(4, 0.25);
  refused(Eigen::VectorXd::Constant(3, 1.0 / 3), 1, "alpha");
  refused(2 * good, 1, "alpha");
  refused((Eigen::VectorXd(4) << 0.5, -0.25, 0.5, 0.25).finished(), 1, "alpha[1]");
  refused((Eigen::VectorXd(4) << 0.5, 0.25, std::nan(""), 0.25).finished(), 1, "alpha[2]");
  for (const double scale : {0.0, -1.0, std::nan("")}) refused(good, scale, "scale");
  SubmanifoldOptions options;
  for (const int modes : {-1, 3}) {
    options.modes = modes;
    CHECK_THROWS_WITH(model.manifold->project(shape, options), Catch::Contains("modes"));
  }
  options.modes = 0;
  std::stop_source source;
  source.request_stop();
  options.stop = source.get_token();
  const auto solved = model.manifold->project(shape, options);
  CHECK(solved.termination == Termination::kCancelled);
  CHECK(solved.solution.shape.allFinite());
}

TEST_CASE("what is derived of a variation is computed once it is used, and the answers are the same to the bit") {
  const Model model(4, 4);
  const auto fresh = [&] { return Submanifold(model.set.calculus, model.pga); };
  const auto& shape = model.set.shapes[2];
  SubmanifoldOptions two;
  two.modes = 2;
  const Eigen::VectorXd y = (Eigen::VectorXd(4) << 0, -0.3, 0, 0.05).finished();

  // everything is derived beforehand, as by a request with all modes
  const auto eager = fresh();
  eager.average(Eigen::VectorXd::Constant(8, 0.125), model.pga->mean, {});
  REQUIRE(eager.derivedVariations() == 8);

  const auto projecting = fresh();
  CHECK(projecting.derivedVariations() == 0);
  const auto lazy = projecting.project(shape, two), whole = eager.project(shape, two);
  CHECK(projecting.derivedVariations() == 4);
  CHECK(lazy.solution.shape == whole.solution.shape);
  CHECK(lazy.solution.point.alpha == whole.solution.point.alpha);
  CHECK(lazy.solution.point.scale == whole.solution.point.scale);
  CHECK(lazy.solution.local_energy == whole.solution.local_energy);
  CHECK(lazy.residual == whole.residual);
  CHECK(projecting.tangentCoordinates(lazy.solution.point) == eager.tangentCoordinates(whole.solution.point));
  CHECK(projecting.derivedVariations() == 4);

  const auto synthesising = fresh();
  const auto point = synthesising.pointOf(y), same = eager.pointOf(y);
  CHECK(point.alpha == same.alpha);
  CHECK(point.scale == same.scale);
  CHECK(synthesising.shapeOf(point, {}).solution.shape == eager.shapeOf(same, {}).solution.shape);
  CHECK(synthesising.derivedVariations() == 3);  // p_2 and p_4 for their distances, p_-2 and p_4 for their measures

  // the literal definitions, for all
  for (std::size_t j = 0; j < 4; ++j) {
    const double distance = eager.pointOf(Eigen::VectorXd::Unit(4, static_cast<Eigen::Index>(j))).scale;
    const double energy =
        model.set.calculus->energy().value(*model.set.mesh.topology, measure(*model.set.mesh.topology, model.pga->mean),
                                           measure(*model.set.mesh.topology, model.pga->variations[j]));
    CHECK(distance == Approx(std::sqrt(energy)).epsilon(1e-14));
  }
  CHECK(eager.bytes() == fresh().bytes());
}

TEST_CASE("many threads that want the variations of one model at once get the same answers") {
  const Model model(2, 4);
  const auto expected = model.manifold->project(model.set.shapes[1], {}).solution;
  const Submanifold shared(model.set.calculus, model.pga);
  std::vector<Vertices> shapes(4);
  {
    std::vector<std::jthread> threads;
    for (auto& shape : shapes)
      threads.emplace_back([&] { shape = shared.project(model.set.shapes[1], {}).solution.shape; });
  }
  for (const auto& shape : shapes) CHECK(shape == expected.shape);
  CHECK(shared.derivedVariations() == 8);
}

TEST_CASE("a request that is stopped derives no more variations") {
  const Model model(2, 4);
  std::stop_source stop;
  stop.request_stop();
  SubmanifoldOptions options;
  options.stop = stop.get_token();
  const Submanifold manifold(model.set.calculus, model.pga);
  const auto projected = manifold.project(model.set.shapes[1], options);
  CHECK(projected.termination == Termination::kCancelled);
  CHECK(projected.solution.shape == model.pga->mean);
  CHECK(projected.solution.point.alpha.sum() == Approx(1));
  CHECK(manifold.average(somePoint(1).alpha, model.pga->mean, options).termination == Termination::kCancelled);
  CHECK(manifold.derivedVariations() == 0);
}
