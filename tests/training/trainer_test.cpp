#include "server/trainer/trainer.h"

#include <catch2/catch.hpp>
#include <nlohmann/json.hpp>

#include "core/io/tensor_file.h"
#include "core/mesh/quality.h"
#include "core/neural/jacobian_field_file.h"
#include "core/numerics/error.h"
#include "server/trainer/job_inputs.h"
#include "tests/support/shapes.h"
#include "tests/support/temporary_folder.h"

using namespace shaped;
using namespace shaped::server;
using namespace shaped::test;
using nlohmann::json;

namespace {

void writeReference(const std::filesystem::path& path, const Mesh& mesh) {
  TensorWriter file;
  file.addMatrix("faces", mesh.topology->faces());
  file.addMatrix("shape", mesh.vertices);
  file.write(path);
}

void writePair(const std::filesystem::path& path, const Mesh& mesh, bool normals) {
  const Vertices target = bend(1.05 * mesh.vertices, 0.2);
  TensorWriter file;
  file.addMatrix("source", mesh.vertices);
  file.addMatrix("target", target.cast<float>());
  file.addMatrix("scan", jitter(target, 0.01, 1).cast<float>());
  if (normals) file.addMatrix("scan_normals", vertexNormals(mesh.topology->faces(), target));
  file.write(path);
}

json jobOf(int epochs) {
  return {{"kind", "jacobian_field"},
          {"references", {{"tube", "tube.safetensors"}, {"ball", "ball.safetensors"}}},
          {"pairs",
           {{{"reference", "tube"}, {"file", "pair_0.safetensors"}},
            {{"reference", "ball"}, {"file", "pair_1.safetensors"}}}},
          {"architecture", {{"source_net", {8}}, {"scan_net", {8}}, {"mlp", {16, 16}}, {"offsets", true}}},
          {"options", {{"epochs", epochs}, {"batch", 1}}},
          {"checkpoint_seconds", 0}};
}

class Job {
 public:
  explicit Job(const json& spec = jobOf(4)) {
    const auto cylinder = tube(7, 6), ball = icosphere(1);
    writeReference(folder_ / "tube.safetensors", cylinder);
    writeReference(folder_ / "ball.safetensors", ball);
    writePair(folder_ / "pair_0.safetensors", cylinder, true);
    writePair(folder_ / "pair_1.safetensors", ball, false);
    write(spec);
  }

  void write(const json& spec) const { folder_.file("job.json", spec.dump()); }
  const std::filesystem::path& path() const { return folder_.path(); }

  /// Runs it; stops after that many epochs where it is asked to.
  JobEnd run(int stop_after = 0) {
    std::stop_source stop;
    events.clear();
    const auto tell = [&](const json& event) {
      events.push_back(event);
      if (event["event"] == "epoch" && event["epoch"] == stop_after) stop.request_stop();
    };
    return train(path(), tell, stop.get_token());
  }

  std::string field() const { return bytesOf(path() / "field.safetensors"); }
  int count(const char* event) const {
    return static_cast<int>(
        std::count_if(events.begin(), events.end(), [&](const json& e) { return e["event"] == event; }));
  }

  std::vector<json> events;

 private:
  TemporaryFolder folder_;
};

/// The error of a job whose description was changed at a JSON pointer.
std::string errorOf(const char* pointer, const json& value) {
  auto spec = jobOf(1);
  spec[json::json_pointer(pointer)] = value;
  try {
    Job(spec).run();
  } catch (const InvalidInput& error) {
    return error.what();
  }
  return "none";
}

}  // namespace

TEST_CASE("a job's folder is trained on, and the field is left in it") {
  Job job;
  CHECK(job.run() == JobEnd::kDone);
  CHECK(job.events.front()["event"] == "start");
  CHECK(job.events.front()["pairs"] == 2);
  CHECK(job.count("epoch") == 4);
  CHECK(job.count("checkpoint") == 5);
  CHECK(job.events.back() == json{{"event", "done"}, {"step", 8}});
  const auto& epoch = job.events[1];
  CHECK(epoch["epochs"] == 4);
  CHECK(epoch["loss"].get<double>() ==
        Approx(10 * epoch["vertex"].get<double>() + epoch["jacobian"].get<double>()).epsilon(1e-9));
  const auto weights = readJacobianField(TensorFile(job.path() / "field.safetensors"), "field");
  CHECK(weights.offsets);
  CHECK(JacobianField(weights).weights().mlp.size() == 3);
  CHECK(job.events.front()["parameters"] == 8 * 57 + 8 * 7 + 16 * (65 + 15 + 4 * 8 + 1) + 16 * 17 + 9 * 17);
}

TEST_CASE("a job that was stopped goes on from its checkpoint, and ends as if it had not been") {
  Job whole, stopped;
  whole.run();
  CHECK(stopped.run(2) == JobEnd::kStopped);
  CHECK(stopped.events.back() == json{{"event", "stopped"}, {"step", 4}});
  CHECK_FALSE(std::filesystem::exists(stopped.path() / "field.safetensors"));
  CHECK(stopped.run() == JobEnd::kDone);
  CHECK(stopped.events.front()["step"] == 4);
  CHECK(stopped.count("epoch") == 2);
  CHECK(stopped.field() == whole.field());
}

TEST_CASE("a job that is done writes its field again; the number of threads is no other training") {
  Job job;
  job.run();
  const auto before = job.field();
  auto spec = jobOf(4);
  spec["threads"] = 2;
  job.write(spec);
  CHECK(job.run() == JobEnd::kDone);
  CHECK(job.count("epoch") == 0);
  CHECK(job.field() == before);
}

TEST_CASE("a checkpoint of another training or of other inputs is refused") {
  Job job;
  job.run(1);
  auto spec = jobOf(4);
  spec["options"]["seed"] = 7;
  job.write(spec);
  CHECK_THROWS_WITH(job.run(), Catch::Contains("checkpoint.safetensors: is of another training or of other inputs"));
  job.write(jobOf(4));
  writePair(job.path() / "pair_0.safetensors", tube(7, 6), false);
  CHECK_THROWS_WITH(job.run(), Catch::Contains("checkpoint.safetensors: is of another training or of other inputs"));
}

TEST_CASE("a job that has been stopped before it began leaves nothing") {
  const Job job;
  std::stop_source stop;
  stop.request_stop();
  CHECK(train(
            job.path(), [](const json&) {}, stop.get_token()) == JobEnd::kStopped);
  CHECK_FALSE(std::filesystem::exists(job.path() / "checkpoint.safetensors"));
}

TEST_CASE("a job that diverges says so") {
  auto spec = jobOf(4);
  spec["options"]["learning_rate"] = 1e20;
  spec["options"]["last_learning_rate"] = 1e20;
  spec["options"]["warm_up"] = 0;
  Job job(spec);
  CHECK(job.run() == JobEnd::kDiverged);
  CHECK(job.events.back()["event"] == "diverged");
}

TEST_CASE("descriptions of jobs are refused by file, field and what would be accepted") {
  CHECK_THAT(errorOf("/kind", "pga"), Catch::Contains("job.json: kind: is \"pga\", want \"jacobian_field\""));
  CHECK_THAT(errorOf("/references", json::object()), Catch::Contains("references: must be an object of at least one"));
  CHECK_THAT(errorOf("/references/tube", "../tube"),
             Catch::Contains("references.tube: must be the name of a file in the folder"));
  CHECK_THAT(errorOf("/pairs", json::array()), Catch::Contains("pairs: must be an array of at least one pair"));
  CHECK_THAT(errorOf("/pairs/1/reference", "cube"),
             Catch::Contains("pairs[1].reference: \"cube\" is none of the references"));
  CHECK_THAT(errorOf("/pairs/0/weight", 2), Catch::Contains("pairs[0].weight: is no field of a job"));
  CHECK_THAT(errorOf("/scaling", "cube"), Catch::Contains("scaling: \"cube\" is none of the references"));
  CHECK_THAT(errorOf("/architecture/mlp", {16, -1}), Catch::Contains("architecture.mlp: must be an array of whole"));
  CHECK_THAT(errorOf("/architecture/offsets", 1), Catch::Contains("architecture.offsets: must be true or false"));
  CHECK_THAT(errorOf("/options/epochs", 0), Catch::Contains("options: epochs = 0, want >= 1"));
  CHECK_THAT(errorOf("/options/epochs", 1.5), Catch::Contains("options.epochs: must be a whole number"));
  CHECK_THAT(errorOf("/options/learning_rate", "fast"), Catch::Contains("options.learning_rate: must be a number"));
  CHECK_THAT(errorOf("/options/momentum", 0.9), Catch::Contains("options.momentum: is no field of a job"));
  CHECK_THAT(errorOf("/threads", 0), Catch::Contains("threads: must be >= 1"));
  CHECK_THAT(errorOf("/checkpoint_seconds", -1), Catch::Contains("checkpoint_seconds: must be >= 0"));
  const Job job;
  std::filesystem::remove(job.path() / "job.json");
  CHECK_THROWS_WITH(readJobSpec(job.path()), Catch::Contains("job.json"));
}

TEST_CASE("inputs of jobs are refused by their file") {
  Job job;
  writePair(job.path() / "pair_1.safetensors", tube(7, 6), false);
  CHECK_THROWS_WITH(job.run(), Catch::Contains("pair_1.safetensors: source: has 44 vertices, want 42"));
  writeReference(job.path() / "pair_1.safetensors", icosphere(1));
  CHECK_THROWS_WITH(job.run(), Catch::Contains("pair_1.safetensors") && Catch::Contains("scan"));
  std::filesystem::remove(job.path() / "tube.safetensors");
  CHECK_THROWS_WITH(job.run(), Catch::Contains("tube.safetensors"));
}
