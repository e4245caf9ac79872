#include "core/model/body_model_file.h"

#include <catch2/catch.hpp>
#include <limits>

#include "core/io/file_error.h"
#include "tests/support/bodies.h"
#include "tests/support/fields.h"
#include "tests/support/temporary_folder.h"

using namespace shaped;
using namespace shaped::test;

namespace {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

/// A model of tubes with four modes, with limits where wanted.
BodyModel smallBody(bool limits) {
  auto parts = test::tubeModel(3, 8, 4).parts();
  parts.limits.reset();
  if (limits) {
    const auto joints = parts.skeleton.jointCount();
    parts.limits = JointLimits{Vertices::Constant(joints, 3, -0.5), Vertices::Constant(joints, 3, 2.0 / 3)};
  }
  return BodyModel(std::move(parts));
}

BodyTrainingRecord record() {
  return {8, PostureNormalisation::kLocal, 0.07, Eigen::VectorXd::LinSpaced(7, 0.7, 0.1), 1.25};
}

/// The safetensors file of a model, to be changed.
StoredModel published(const ModelDirectory& directory, const BodyModel& model, const BodyTrainingRecord& training) {
  publishBody(directory, "m", model, training, {{"dataset", "tubes"}});
  return directory.load("m");
}

/// A version whose description or tensors `change` has turned into something else.
struct Files {
  ModelManifest manifest;
  std::map<std::string, Eigen::MatrixXd> numbers;
  std::map<std::string, Eigen::MatrixXi> indices;
};

/// Reads the whole version, lets `change` have its way, and loads what that makes.
void loadChanged(const std::function<void(Files&)>& change) {
  const TemporaryFolder folder;
  const ModelDirectory directory(folder.path());
  const auto stored = published(directory, smallBody(true), record());
  Files files{stored.manifest, {}, {}};
  std::map<std::string, std::vector<std::int64_t>> shapes;
  for (const auto& name : stored.tensors->names()) {
    const auto& shape = shapes[name] = stored.tensors->shape(name);
    const Eigen::Index rows = shape[0], columns = shape.size() > 1 ? shape[1] : 1;
    if (stored.tensors->type(name) == TensorType::kFloat64)
      files.numbers[name] =
          Eigen::Map<const RowMajorMatrix<double>>(stored.tensors->values<double>(name).data(), rows, columns);
    else
      files.indices[name] = Eigen::Map<const RowMajorMatrix<std::int32_t>>(
          stored.tensors->values<std::int32_t>(name).data(), rows, columns);
  }
  change(files);
  TensorWriter writer;
  const auto add = [&](const std::string& name, const auto& matrix) {
    using Number = typename std::decay_t<decltype(matrix)>::Scalar;
    const RowMajorMatrix<Number> copy = matrix;
    const std::span<const Number> values(copy.data(), static_cast<std::size_t>(copy.size()));
    shapes[name].size() > 1 ? writer.add(name, {copy.rows(), copy.cols()}, values)
                            : writer.add(name, {copy.rows()}, values);
  };
  for (const auto& [name, matrix] : files.numbers) add(name, matrix);
  for (const auto& [name, matrix] : files.indices) add(name, matrix);
  directory.publish("changed", files.manifest, writer);
  loadBody(directory.load("changed"));
}

}  // namespace

TEST_CASE("a body model comes back from its file bit for bit") {
  const bool limits = GENERATE(false, true);
  const auto model = smallBody(limits);
  const TemporaryFolder folder;
  const ModelDirectory directory(folder.path());
  const auto stored = published(directory, model, record());
  const auto [loaded, training, field] = loadBody(stored);
  CHECK_FALSE(field);
  CHECK(stored.manifest.format_version == 1);
  const auto &before = model.parts(), &after = loaded.parts();
  CHECK(after.topology->id() == before.topology->id());
  CHECK(after.mean == before.mean);
  CHECK(after.modes == before.modes);
  CHECK(after.deviations == before.deviations);
  REQUIRE(after.skeleton.jointCount() == before.skeleton.jointCount());
  for (std::int32_t j = 0; j < before.skeleton.jointCount(); ++j) {
    CHECK(after.skeleton.name(j) == before.skeleton.name(j));
    CHECK(after.skeleton.parent(j) == before.skeleton.parent(j));
  }
  CHECK(Eigen::MatrixXd(after.weights) == Eigen::MatrixXd(before.weights));
  CHECK(Eigen::MatrixXd(after.regressor) == Eigen::MatrixXd(before.regressor));
  REQUIRE(after.limits.has_value() == limits);
  if (limits) {
    CHECK(after.limits->low == before.limits->low);
    CHECK(after.limits->high == before.limits->high);
  }
  CHECK(training.registrations == 8);
  CHECK(training.posture == PostureNormalisation::kLocal);
  CHECK(training.reach == 0.07);
  CHECK(training.variances == record().variances);
  CHECK(training.seconds == 1.25);
  CHECK(stored.manifest.description.at("provenance").at("dataset") == "tubes");

  BodyState state{randomIdentity(model, 3), randomPose(model.skeleton(), 0.4, 4)};
  CHECK(loaded.posed(state).vertices() == model.posed(state).vertices());
}

TEST_CASE("body files that hold no body are refused by what is wrong with them") {
  CHECK_NOTHROW(loadChanged([](Files&) {}));
  const auto refused = [](const std::function<void(Files&)>& change, const std::string& reason) {
    CHECK_THROWS_AS(loadChanged(change), FileError);
    CHECK_THROWS_WITH(loadChanged(change), Catch::Contains("model changed version 1") && Catch::Contains(reason));
  };
  refused([](Files& f) { f.manifest.kind = "shell_pga"; }, "is of kind \"shell_pga\", want \"body\"");
  refused([](Files& f) { f.manifest.format_version = 3; }, "has format version 3, want 1 or 2");
  refused([](Files& f) { f.manifest.format_version = 2; }, "field.");
  refused([](Files& f) { f.manifest.description["joined"] = "many"; }, "faulty description");
  refused([](Files& f) { f.manifest.description.erase("joints"); }, "faulty description");
  refused([](Files& f) { f.manifest.description["joints"] = nlohmann::json::array(); }, "joints");
  refused([](Files& f) { f.manifest.description["joints"] = std::vector<int>(1001, 1); },
          "joints: want a list of at most 1000");
  refused([](Files& f) { f.manifest.description["joints"][1]["parent"] = 2; }, "joints[1]");
  refused([](Files& f) { f.manifest.description["joints"][1]["name"] = ""; }, "joints[1]");
  refused([](Files& f) { f.manifest.description["joints"].erase(1); }, "joints");
  refused([](Files& f) { f.manifest.description["posture"] = "upright"; },
          "posture: is \"upright\", want none, skeleton or local");
  refused([](Files& f) { f.manifest.description["training_shapes"] = -1; }, "training_shapes");
  refused([](Files& f) { f.manifest.description["limits"] = 1; }, "faulty description");

  refused([](Files& f) { f.numbers.erase("mean"); }, "mean");
  refused([](Files& f) { f.numbers["mean"](5, 1) = kNan; }, "mean: vertex 5");
  refused([](Files& f) { f.numbers["mean"].setZero(); }, "mean: face 0");
  refused([](Files& f) { f.indices["faces"](3, 0) = 100'000; }, "face");
  refused([](Files& f) { f.numbers["modes"](2, 1) = kNan; }, "modes: is not finite");
  refused([](Files& f) { f.numbers["modes"] *= 1.001; }, "modes: are not orthonormal");
  refused([](Files& f) { f.numbers["modes"].conservativeResize(f.numbers["modes"].rows() - 1, 4); }, "modes");
  refused([](Files& f) { f.numbers["deviations"](1) = 0; }, "deviations[1]: is 0");
  refused([](Files& f) { f.numbers["deviations"].reverseInPlace(); }, "deviations[1]");
  refused([](Files& f) { f.numbers["deviations"].conservativeResize(3, 1); }, "modes: is ");
  refused([](Files& f) { f.numbers["variances"](2) = 9; }, "variances[2]");
  refused([](Files& f) { f.numbers["variances"](2) = kNan; }, "variances[2]");
  refused([](Files& f) { f.numbers["weights.values"](7) += 0.1; }, "weights[");
  refused([](Files& f) { f.numbers["weights.values"](7) = kNan; }, "weights: has a number that is not finite");
  refused([](Files& f) { f.indices["weights.columns"](7) = 99; }, "weights: has a column out of range");
  refused([](Files& f) { f.indices["weights.row_begin"](2) = 1 << 20; }, "weights: has broken row limits");
  refused([](Files& f) { f.numbers["regressor.values"](0) += 1; }, "regressor[0]");
  refused([](Files& f) { f.indices["regressor.row_begin"].conservativeResize(2, 1); }, "regressor: has the wrong size");
  refused([](Files& f) { f.numbers["limits.low"](1, 2) = 3; }, "limits[1]: has a lower limit above the upper one");
  refused([](Files& f) { f.numbers["limits.low"](1, 2) = kNan; }, "limits[1]");
  refused([](Files& f) { f.numbers.erase("limits.high"); }, "limits.high");
}

TEST_CASE("a body model takes its field and how it grew along") {
  const auto model = smallBody(false);
  const auto field = constantField(scalingOf(*makeFieldReference(model.topology(), model.parts().mean)),
                                   Eigen::Vector3d(0.1, 0, -0.2).asDiagonal());
  auto grown = record();
  grown.joined = {3, 1};
  const TemporaryFolder folder;
  const ModelDirectory directory(folder.path());
  publishBody(directory, "m", model, grown, {}, &field);
  const auto stored = directory.load("m");
  CHECK(stored.manifest.format_version == 2);  // a daemon that knows of no field refuses it
  const auto loaded = loadBody(stored);
  CHECK(loaded.training.joined == std::vector<int>{3, 1});
  REQUIRE(loaded.field);
  CHECK(loaded.field->mlp[0].bias == field.mlp[0].bias);
  CHECK(loaded.field->mlp[0].weight == field.mlp[0].weight);
  CHECK(loaded.field->scaling.signature_mean == field.scaling.signature_mean);

  auto regressing = field;
  const auto vertices = model.topology()->vertexCount(), turns = 3 * (model.skeleton().jointCount() - 1);
  regressing.regression = ResidualRegressionWeights{
      Eigen::MatrixXf::Random(vertices, 2), Eigen::MatrixXf::Random(model.modeCount() + turns, 2),
      Eigen::VectorXf::Random(3 * vertices), Eigen::MatrixXf::Random(3 * vertices, 2)};
  regressing.smoothness = SmoothPrior{0.21, 3e-4};
  publishBody(directory, "regressing", model, grown, {}, &regressing);
  const auto again = loadBody(directory.load("regressing"));
  REQUIRE(again.field->regression);
  CHECK(again.field->regression->offset_weights == regressing.regression->offset_weights);
  CHECK(again.field->regression->state_weights == regressing.regression->state_weights);
  CHECK(again.field->regression->mean == regressing.regression->mean);
  CHECK(again.field->regression->modes == regressing.regression->modes);
  REQUIRE(again.field->smoothness);
  CHECK(again.field->smoothness->reach == 0.21);
  CHECK(again.field->smoothness->noise == 3e-4);
  CHECK_FALSE(loaded.field->regression);
  CHECK_FALSE(loaded.field->smoothness);
  regressing.regression->state_weights.conservativeResize(turns, 2);
  publishBody(directory, "other", model, grown, {}, &regressing);
  CHECK_THROWS_WITH(loadBody(directory.load("other")), Catch::Contains("field.regression"));

  auto damaged = field;
  damaged.mlp[0].bias.conservativeResize(8);
  publishBody(directory, "damaged", model, grown, {}, &damaged);
  CHECK_THROWS_WITH(loadBody(directory.load("damaged")), Catch::Contains("mlp") && Catch::Contains("damaged"));
}
