#include "server/field_training/trainer_process.h"

#include <catch2/catch.hpp>
#include <nlohmann/json.hpp>

#include "core/io/file.h"
#include "core/io/file_error.h"
#include "core/io/tensor_file.h"
#include "core/neural/jacobian_field_file.h"
#include "server/errors/errors.h"
#include "tests/support/fields.h"
#include "tests/support/shapes.h"
#include "tests/support/temporary_folder.h"

using namespace shaped;
using namespace shaped::server;
using Catch::Contains;

namespace {

const auto sphere = test::icosphere(2);

FieldTrainingSet trainingSet(int number) {
  FieldTrainingSet set;
  set.training = number;
  set.reference = std::make_shared<const FieldReference>(*makeFieldReference(sphere.topology, sphere.vertices));
  set.scaling = scalingOf(*set.reference);
  const Scan scan{1.1 * sphere.vertices, sphere.vertices.rowwise().normalized(), {}};
  set.pairs.push_back({sphere.vertices, 1.1 * sphere.vertices, scan});
  set.pairs.push_back({sphere.vertices, 1.2 * sphere.vertices, {1.2 * sphere.vertices, {}, {}}});
  return set;
}

/// A stand-in for shaped-trainer: a script, and where its trainings lie.
struct Trainer {
  test::TemporaryFolder folder;
  std::vector<std::string> told, log;

  TrainerProcess process(const std::string& script) {
    const auto program = folder / "trainer";
    writeFile(program, "#!/bin/sh\nfolder=$3\n" + script);
    std::filesystem::permissions(program, std::filesystem::perms::owner_all);
    std::filesystem::create_directories(folder / "job");
    return {program,
            folder / "job",
            {},
            {},
            [this](const FieldProgress& at) {
              told.push_back(std::to_string(at.epoch) + " of " + std::to_string(at.epochs));
            },
            [this](const std::string& text) { log.push_back(text); }};
  }

  auto train(const std::string& script, int number = 1, const std::stop_token& stop = {}) {
    return fieldTrainer(process(script))(trainingSet(number), stop);
  }

  /// A field for the script to hand over.
  std::string field() {
    TensorWriter file;
    addJacobianField("field", test::constantField(trainingSet(1).scaling), file);
    file.write(folder / "made.safetensors");
    return (folder / "made.safetensors").string();
  }
};

}  // namespace

TEST_CASE("a job folder says what is to be trained, and the field that comes back is taken") {
  Trainer trainer;
  const auto script =
      "echo '{\"event\": \"start\", \"step\": 0}'\necho nonsense\n"
      "echo '{\"event\": \"epoch\", \"epoch\": 1, \"epochs\": 100, \"loss\": 0.5}'\n"
      "cp " +
      trainer.field() + " $folder/field.safetensors\n";
  const auto weights = trainer.train(script);
  REQUIRE(weights);
  CHECK(weights->scaling.extent == trainingSet(1).scaling.extent);
  CHECK(trainer.told == std::vector<std::string>{"0 of 100", "1 of 100"});
  const auto job = nlohmann::json::parse(readFile(trainer.folder / "job/field-1/job.json"));
  CHECK(job.at("kind") == "jacobian_field");
  CHECK(job.at("architecture").at("offsets") == true);
  CHECK(job.at("options").at("epochs") == 100);
  REQUIRE(job.at("pairs").size() == 2);
  const TensorFile pair(trainer.folder / "job/field-1" / job.at("pairs")[0].at("file").get<std::string>());
  CHECK(pair.matrix<double>("target", -1, 3) == 1.1 * sphere.vertices);
  CHECK(pair.has("scan_normals"));
  CHECK_FALSE(TensorFile(trainer.folder / "job/field-1" / job.at("pairs")[1].at("file").get<std::string>())
                  .has("scan_normals"));
  CHECK(trainer.train(script, 2));
  CHECK_FALSE(std::filesystem::exists(trainer.folder / "job/field-1"));
}

TEST_CASE("how a trainer ends is said in our words") {
  Trainer trainer;
  const auto fails = [&](const std::string& script, const std::string& text) {
    CHECK_THROWS_WITH(trainer.train(script), Contains(text));
  };
  fails("echo 'job.json: is odd' >&2; exit 2",
        "shaped-trainer could not train the field, exit code 2: job.json: is odd");
  fails("exit 0", "what shaped-trainer has left cannot be read");
  fails("echo '{\"event\": \"diverged\"}'; exit 1",
        "the training of the field diverged: ask for a lower learning_rate");
  CHECK_THROWS_AS(trainer.train("echo '{\"event\": \"diverged\"}'; exit 1"), WrongState);
  CHECK_THROWS_AS(trainer.train("echo 'a: cannot be written: No space left on device' >&2; exit 1"), FileError);
  auto missing = trainer.process("");
  missing.program = trainer.folder / "nothing";
  CHECK_THROWS_AS(fieldTrainer(missing)(trainingSet(1), {}), WrongState);
  CHECK_THROWS_WITH(requireTrainer(missing.program), Contains("there is no program") && Contains("--trainer"));
}

TEST_CASE("a trainer that something killed is started again, a few times") {
  Trainer trainer;
  const auto count = (trainer.folder / "starts").string();
  const auto again = "echo x >> " + count + "\n[ $(wc -l < " + count + ") = 3 ] || kill -9 $$\ncp " + trainer.field() +
                     " $folder/field.safetensors\n";
  CHECK(trainer.train(again));
  CHECK(trainer.log.size() == 2);
  CHECK_THROWS_WITH(trainer.train("kill -9 $$"), Contains("was killed 3 times by signal 9"));
}

TEST_CASE("a checkpoint of another training is removed, and the training begins anew") {
  Trainer trainer;
  std::filesystem::create_directories(trainer.folder / "job/field-1");
  const auto checkpoint = fieldCheckpoint(trainer.folder / "job/field-1");
  writeFile(checkpoint, "of another");
  CHECK(trainer.train("[ ! -e $folder/checkpoint.safetensors ] || exit 2\ncp " + trainer.field() +
                      " $folder/field.safetensors\n"));
  CHECK_FALSE(std::filesystem::exists(checkpoint));
  CHECK(trainer.log.size() == 1);
}

TEST_CASE("a training that is stopped leaves no field, and what it keeps stays") {
  Trainer trainer;
  std::stop_source stop;
  auto process = trainer.process(
      "trap 'echo kept > $folder/checkpoint.safetensors; exit 3' TERM\n"
      "echo '{\"event\": \"start\", \"step\": 0}'\nwhile :; do sleep 0.05; done\n");
  process.progress = [&](const FieldProgress&) { stop.request_stop(); };
  CHECK_FALSE(fieldTrainer(process)(trainingSet(1), stop.get_token()));
  CHECK(readFile(fieldCheckpoint(trainer.folder / "job/field-1")) == "kept\n");
}

TEST_CASE("options of a field's training are refused by name") {
  CHECK(FieldJobOptions{}.firstViolation() == std::nullopt);
  CHECK(*FieldJobOptions{.epochs = 0}.firstViolation() == "epochs = 0, want >= 1");
  CHECK(*FieldJobOptions{.batch = 0}.firstViolation() == "batch = 0, want >= 1");
  CHECK(*FieldJobOptions{.learning_rate = -1}.firstViolation() == "learning_rate = -1, want > 0 and <= 1");
}
