#include "core/neural/dense_layers.h"

#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>
#include <limits>
#include <numeric>
#include <random>
#include <thread>

#include "core/numerics/error.h"

using namespace shaped;

namespace {

Eigen::MatrixXf randomMatrix(Eigen::Index rows, Eigen::Index columns, unsigned seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<float> uniform(-1, 1);
  return Eigen::MatrixXf::NullaryExpr(rows, columns, [&] { return uniform(random); });
}

/// Layers of the given widths with weights that keep features near 1.
std::vector<Linear> randomLayers(const std::vector<int>& widths) {
  std::vector<Linear> layers;
  for (std::size_t i = 0; i + 1 < widths.size(); ++i) {
    const auto seed = static_cast<unsigned>(2 * i + 1);
    layers.push_back({randomMatrix(widths[i + 1], widths[i], seed) * 2 / std::sqrt(float(widths[i])),
                      randomMatrix(widths[i + 1], 1, seed + 1)});
  }
  return layers;
}

/// One item through the layers, sum by sum in double precision.
std::vector<double> literal(const std::vector<Linear>& layers, std::vector<double> item, bool relu_at_the_end) {
  for (std::size_t i = 0; i < layers.size(); ++i) {
    std::vector<double> next;
    for (Eigen::Index out = 0; out < layers[i].weight.rows(); ++out) {
      double sum = layers[i].bias[out];
      for (Eigen::Index in = 0; in < layers[i].weight.cols(); ++in) sum += double(layers[i].weight(out, in)) * item[in];
      const bool relu = i + 1 < layers.size() || relu_at_the_end;
      next.push_back(relu ? std::max(sum, 0.0) : sum);
    }
    item = next;
  }
  return item;
}

void checkAgainstLiteral(const Eigen::MatrixXf& items, const Eigen::MatrixXf& answers,
                         const std::vector<Linear>& layers, bool relu_at_the_end) {
  REQUIRE(answers.rows() == items.rows());
  for (Eigen::Index n = 0; n < items.rows(); ++n) {
    std::vector<double> item;
    for (Eigen::Index i = 0; i < items.cols(); ++i) item.push_back(items(n, i));
    const auto expected = literal(layers, item, relu_at_the_end);
    REQUIRE(Eigen::Index(expected.size()) == answers.cols());
    for (Eigen::Index i = 0; i < answers.cols(); ++i)
      CHECK(std::abs(answers(n, i) - expected[i]) < 1e-5 * std::max(1.0, std::abs(expected[i])));
  }
}

}  // namespace

TEST_CASE("a perceptron is its layers, with ReLUs between them alone") {
  const auto layers = randomLayers({17, 128, 128, 128, 9});
  const auto items = randomMatrix(50, 17, 99);
  const Mlp mlp(layers);
  CHECK(mlp.inputs() == 17);
  CHECK(mlp.outputs() == 9);
  const auto answers = mlp(items);
  checkAgainstLiteral(items, answers, layers, false);
  CHECK(answers.minCoeff() < 0);
  const auto features = Mlp(layers, OutputActivation::kRelu)(items);
  checkAgainstLiteral(items, features, layers, true);
  CHECK(features == answers.cwiseMax(0.0F));
}

TEST_CASE("a perceptron of one layer is affine, and of no items gives none") {
  const auto layers = randomLayers({5, 3});
  const Mlp mlp(layers);
  CHECK(mlp(Eigen::MatrixXf::Zero(1, 5)).row(0) == layers[0].bias.transpose());
  const auto items = randomMatrix(2, 5, 4);
  const auto middle = mlp(items.colwise().mean());
  CHECK((middle - mlp(items).colwise().mean()).norm() < 1e-5);
  CHECK(mlp(Eigen::MatrixXf(0, 5)).rows() == 0);
  CHECK(mlp(Eigen::MatrixXf(0, 5)).cols() == 3);
}

TEST_CASE("a PointNet's features are one perceptron's, and their maximum") {
  const auto layers = randomLayers({6, 64, 128, 40});
  const auto points = randomMatrix(200, 6, 5);
  const auto features = PointNet(layers)(points);
  checkAgainstLiteral(points, features.each, layers, true);
  for (Eigen::Index i = 0; i < 40; ++i) {
    float largest = 0;
    for (Eigen::Index n = 0; n < 200; ++n) largest = std::max(largest, features.each(n, i));
    CHECK(features.whole[i] == largest);
  }
}

TEST_CASE("neither order nor repetition of points matters to their whole, other points do") {
  const PointNet net(randomLayers({3, 32, 32}));
  const auto points = randomMatrix(101, 3, 5);
  const auto features = net(points);
  std::vector<int> order(101);
  std::iota(order.begin(), order.end(), 0);
  std::shuffle(order.begin(), order.end(), std::mt19937(1));
  const auto shuffled = net(points(order, Eigen::all));
  CHECK(shuffled.whole.isApprox(features.whole, 1e-6F));
  CHECK(shuffled.each.isApprox(features.each(order, Eigen::all), 1e-6F));
  order.insert(order.end(), {3, 3, 70});
  CHECK(net(points(order, Eigen::all)).whole.isApprox(features.whole, 1e-6F));
  CHECK_FALSE(net(2 * points).whole.isApprox(features.whole, 0.01F));
}

TEST_CASE("several threads may use one network") {
  const Mlp mlp(randomLayers({20, 64, 9}));
  const auto items = randomMatrix(300, 20, 1);
  const auto alone = mlp(items);
  std::vector<int> different(3, 0);
  std::vector<std::thread> threads;
  for (auto& count : different)
    threads.emplace_back([&] {
      for (int i = 0; i < 10; ++i) count += mlp(items) != alone;
    });
  for (auto& thread : threads) thread.join();
  CHECK(different == std::vector<int>(3, 0));
}

TEST_CASE("networks refuse layers that do not fit, by their name and number") {
  auto layers = randomLayers({4, 8, 2});
  CHECK_THROWS_WITH(Mlp({}, OutputActivation::kNone, "decoder"), Catch::Contains("decoder.layers: there is none"));
  layers[1].bias = Eigen::VectorXf::Zero(3);
  CHECK_THROWS_WITH(Mlp(layers), Catch::Contains("mlp.layers[1]: the bias has 3 numbers, want 2"));
  layers[1] = randomLayers({7, 2})[0];
  CHECK_THROWS_WITH(PointNet(layers, "scan"), Catch::Contains("scan.layers[1]: takes 7 features, want 8"));
  layers = randomLayers({4, 8, 2});
  layers[0].weight(1, 1) = std::numeric_limits<float>::infinity();
  CHECK_THROWS_WITH(Mlp(layers), Catch::Contains("mlp.layers[0]: holds a number that is not finite"));
  layers[0].weight.resize(0, 4);
  CHECK_THROWS_WITH(Mlp(layers), Catch::Contains("mlp.layers[0]: the weight is empty"));
}

TEST_CASE("networks refuse items that do not fit") {
  const auto layers = randomLayers({4, 8, 2});
  CHECK_THROWS_WITH(Mlp(layers)(Eigen::MatrixXf::Zero(3, 5)), Catch::Contains("mlp: got 5 features an item, want 4"));
  CHECK_THROWS_WITH(PointNet(layers)(Eigen::MatrixXf(0, 4)), Catch::Contains("pointnet: got no point"));
}
