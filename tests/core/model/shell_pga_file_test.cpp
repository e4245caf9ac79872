#include "core/model/shell_pga_file.h"

#include <catch2/catch.hpp>
#include <limits>

#include "core/io/file_error.h"
#include "tests/support/models.h"
#include "tests/support/temporary_folder.h"

using namespace shaped;
using namespace shaped::test;

namespace {

ShellPgaModelPtr throughFile(const ShellPgaModel& model) {
  const TemporaryFolder folder;
  const ModelDirectory directory(folder.path());
  publishShellPga(directory, "m", model);
  return loadShellPga(directory.load("m"));
}

}  // namespace

TEST_CASE("a model comes back from its file bit for bit") {
  const auto& model = *tubeModel();
  const auto loaded = throughFile(model);
  const auto &before = model.parts(), &after = loaded->parts();
  CHECK(after.topology->id() == before.topology->id());
  CHECK(after.coarsening.kept == before.coarsening.kept);
  CHECK(after.coarsening.coarse->faces() == before.coarsening.coarse->faces());
  CHECK(after.template_shape == before.template_shape);
  CHECK(after.reference == before.reference);
  CHECK(Eigen::MatrixXd(after.detail) == Eigen::MatrixXd(before.detail));
  CHECK(after.bending == before.bending);
  CHECK(after.symmetry == before.symmetry);
  CHECK(after.pga.mean == before.pga.mean);
  CHECK(after.pga.eigenvalues == before.pga.eigenvalues);
  CHECK(after.pga.eigenvectors == before.pga.eigenvectors);
  CHECK(after.pga.variations == before.pga.variations);
  CHECK(after.pga.path_steps == before.pga.path_steps);
  CHECK(after.training.mean.iterations == before.training.mean.iterations);
  CHECK(after.training.mean.residual == before.training.mean.residual);
  CHECK(loaded->mean() == model.mean());
}

TEST_CASE("a loaded model's variations lie in its file, which serves them when it has been removed or replaced") {
  const TemporaryFolder folder;
  const ModelDirectory directory(folder.path());
  publishShellPga(directory, "m", *tubeModel());
  const auto stored = directory.load("m");
  const auto loaded = loadShellPga(stored);
  const auto bytes = stored.tensors->bytes();
  const auto* first = reinterpret_cast<const char*>(loaded->pga().variations[0].data());
  CHECK(first == reinterpret_cast<const char*>(stored.tensors->values<double>("variations").data()));
  CHECK(first >= bytes.data());
  CHECK(&loaded->pga() == &loaded->parts().pga);  // one statistics for model and submanifold
  CHECK(loaded->pga().variations.bytes() == bytes.size());
  CHECK(loaded->bytes() >= bytes.size() + loaded->submanifold().bytes());
  directory.remove("m");
  publishShellPga(directory, "m", *tubeModel());
  CHECK(loaded->pga().variations == tubeModel()->pga().variations);
  const auto kept = loaded->submanifoldPtr();
  SubmanifoldPoint point;
  point.alpha = Eigen::VectorXd::Constant(2 * loaded->modes(), 0.5 / loaded->modes());
  CHECK(kept->shapeOf(point, {}).solution.shape == tubeModel()->submanifold().shapeOf(point, {}).solution.shape);
}

TEST_CASE("loading derives nothing of the variations") {
  const auto loaded = throughFile(*tubeModel());
  CHECK(loaded->submanifold().derivedVariations() == 0);
  CHECK(loaded->fineSubmanifold()->derivedVariations() == 0);
}

TEST_CASE("a model keeps its path energy, and one from before there was a choice is directed") {
  auto parts = tubeModel()->parts();
  parts.symmetry = EnergySymmetry::kDirected;
  CHECK(throughFile(ShellPgaModel(parts))->parts().symmetry == EnergySymmetry::kDirected);

  const TemporaryFolder folder;
  const ModelDirectory directory(folder.path());
  publishShellPga(directory, "m", *tubeModel());
  auto stored = directory.load("m");
  stored.manifest.description.erase("path_energy");
  CHECK(loadShellPga(stored)->parts().symmetry == EnergySymmetry::kDirected);
  stored.manifest.description["path_energy"] = "sideways";
  CHECK_THROWS_WITH(loadShellPga(stored), Catch::Contains("model m version 1") && Catch::Contains("path_energy"));
}

TEST_CASE("a model whose training ended without a finite residual can be loaded again") {
  auto parts = tubeModel()->parts();
  parts.training.mean = {Termination::kNumericalFailure, 3, std::numeric_limits<double>::quiet_NaN()};
  const auto loaded = throughFile(ShellPgaModel(parts));
  CHECK(loaded->parts().training.mean.termination == Termination::kNumericalFailure);
  CHECK(!std::isfinite(loaded->parts().training.mean.residual));
}

TEST_CASE("a model whose numbers make no shapes is refused by the tensor at fault") {
  const auto refused = [](const std::function<void(ShellPgaParts&)>& change, const std::string& reason) {
    auto parts = tubeModel()->parts();
    change(parts);
    CHECK_THROWS_AS(throughFile(ShellPgaModel(parts)), FileError);
    CHECK_THROWS_WITH(throughFile(ShellPgaModel(parts)),
                      Catch::Contains("model m version 1") && Catch::Contains(reason));
  };
  constexpr double nan = std::numeric_limits<double>::quiet_NaN();
  refused([](ShellPgaParts& parts) { parts.template_shape(3, 1) = nan; }, "template: vertex 3");
  const auto changeVariation = [](ShellPgaParts& parts, const std::function<void(Vertices&)>& change) {
    auto shapes = parts.pga.variations.shapes();
    change(shapes[1]);
    parts.pga.variations = ShapeStack(shapes);
  };
  refused([&](ShellPgaParts& parts) { changeVariation(parts, [](Vertices& shape) { shape.setZero(); }); },
          "variations[1]: face 0 is degenerate");
  refused([&](ShellPgaParts& parts) { changeVariation(parts, [](Vertices& shape) { shape(7, 2) = nan; }); },
          "variations[1]: vertex 7 has a coordinate that is not a finite number");
  refused([](ShellPgaParts& parts) { parts.pga.eigenvalues[0] = nan; }, "eigenvalues");
  refused([](ShellPgaParts& parts) { parts.pga.eigenvectors(1, 0) = nan; }, "eigenvectors");
}

TEST_CASE("files of another kind or version, and faulty descriptions, are refused by name") {
  const TemporaryFolder folder;
  const ModelDirectory directory(folder.path());
  publishShellPga(directory, "m", *tubeModel());
  const auto stored = directory.load("m");
  const auto refused = [&](const std::function<void(StoredModel&)>& change, const std::string& reason) {
    auto changed = stored;
    change(changed);
    CHECK_THROWS_AS(loadShellPga(changed), FileError);
    CHECK_THROWS_WITH(loadShellPga(changed), Catch::Contains("model m version 1") && Catch::Contains(reason));
  };
  refused([](StoredModel& m) { m.manifest.kind = "linear"; }, "linear");
  refused([](StoredModel& m) { m.manifest.format_version = 99; }, "format version 99");
  refused([](StoredModel& m) { m.manifest.description.erase("bending"); }, "bending");
  refused([](StoredModel& m) { m.manifest.description["path_steps"] = "four"; }, "path_steps: must be a whole number");
  refused([](StoredModel& m) { m.manifest.description["path_steps"] = 0; }, "path_steps");
  refused([](StoredModel& m) { m.manifest.description["training_shapes"] = 1e300; }, "training_shapes");
  refused([](StoredModel& m) { m.manifest.description["bending"] = -1; }, "bending: must be positive");
}
