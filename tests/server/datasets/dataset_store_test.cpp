#include "server/datasets/dataset_store.h"

#include <catch2/catch.hpp>

#include "core/numerics/error.h"
#include "server/datasets/name.h"
#include "server/errors/errors.h"
#include "tests/support/shapes.h"
#include "tests/support/temporary_folder.h"

using namespace shaped;
using namespace shaped::server;
using Catch::Contains;

namespace {

const auto sphere = test::icosphere(1);

DatasetInfo put(DatasetStore& store, const std::string& name, const std::vector<Vertices>& shapes) {
  auto upload = store.begin(name, sphere.topology->vertexCount(), sphere.topology->faces(), std::ssize(shapes));
  for (const auto& shape : shapes) upload->append(shape, "");
  return upload->commit();
}

std::size_t entries(const std::filesystem::path& folder) {
  return static_cast<std::size_t>(std::distance(std::filesystem::directory_iterator(folder), {}));
}

}  // namespace

TEST_CASE("a dataset outlives the store object") {
  const test::TemporaryFolder folder;
  const auto other = test::jitter(sphere.vertices, 0.01, 1);
  {
    DatasetStore store(folder.path());
    const auto info = put(store, "spheres", {sphere.vertices, other});
    CHECK(info.frames == 2);
    CHECK(info.topology_id == sphere.topology->id());
  }
  DatasetStore store(folder.path());
  REQUIRE(store.list().size() == 1);
  const auto dataset = store.load("spheres");
  CHECK(dataset.topology->id() == sphere.topology->id());
  REQUIRE(dataset.shapes.size() == 2);
  CHECK((dataset.shapes[1] - other).cwiseAbs().maxCoeff() < 1e-6);
  store.remove("spheres");
  CHECK_THROWS_AS(store.load("spheres"), NotFound);
  CHECK_THROWS_AS(store.remove("spheres"), NotFound);
  CHECK(entries(folder.path()) == 0);
}

TEST_CASE("faulty shapes are refused by frame, and nothing is kept") {
  const test::TemporaryFolder folder;
  DatasetStore store(folder.path());
  const auto refuse = [&](const Vertices& shape, const std::string& text) {
    auto upload = store.begin("bad", sphere.topology->vertexCount(), sphere.topology->faces(), 2);
    upload->append(sphere.vertices, "good.ply");
    CHECK_THROWS_WITH(upload->append(shape, "bad.ply"), Contains(text));
  };
  Vertices broken = sphere.vertices;
  broken(5, 2) = std::nan("");
  refuse(broken, "frames[1] (bad.ply): vertex 5");
  broken = sphere.vertices;
  broken.row(sphere.topology->faces()(7, 0)) = broken.row(sphere.topology->faces()(7, 1));
  refuse(broken, "frames[1] (bad.ply): face");
  refuse(sphere.vertices.topRows(41), "frames[1] (bad.ply): has 41 vertices, want 42");
  CHECK(store.list().empty());
  CHECK(entries(folder.path()) == 0);
}

TEST_CASE("faulty connectivity is refused") {
  const test::TemporaryFolder folder;
  DatasetStore store(folder.path());
  Faces two(sphere.topology->faces().rows() * 2, 3);
  two << sphere.topology->faces(), sphere.topology->faces().array() + 42;
  CHECK_THROWS_WITH(store.begin("two", 84, two, 1), Contains("faces: has 2 connected components"));
  two.bottomRows(80) = sphere.topology->faces();
  CHECK_THROWS_WITH(store.begin("thick", 42, two, 1), Contains("edge"));
  CHECK_THROWS_WITH(store.begin("none", 42, sphere.topology->faces(), 0), Contains("frames: = 0"));
  CHECK_THROWS_WITH(store.begin("../up", 42, sphere.topology->faces(), 1), Contains("name: want 1 to 100"));
  CHECK(entries(folder.path()) == 0);
}

TEST_CASE("an upload is complete or it is nothing") {
  const test::TemporaryFolder folder;
  DatasetStore store(folder.path());
  auto upload = store.begin("half", 42, sphere.topology->faces(), 2);
  upload->append(sphere.vertices, "");
  CHECK_THROWS_WITH(upload->commit(), Contains("announced 2, 1 came"));
  upload->append(sphere.vertices, "");
  CHECK_THROWS_WITH(upload->append(sphere.vertices, ""), Contains("frames[2]: is one too many"));
}

TEST_CASE("the same shapes again are welcome, others under the same name are not") {
  const test::TemporaryFolder folder;
  DatasetStore store(folder.path());
  const auto first = put(store, "spheres", {sphere.vertices});
  CHECK(put(store, "spheres", {sphere.vertices}).created == first.created);
  CHECK_THROWS_AS(put(store, "spheres", {test::jitter(sphere.vertices, 0.01, 1)}), AlreadyExists);
  CHECK(entries(folder.path()) == 1);
}

TEST_CASE("what a crash leaves behind is cleared, what a disk damages is reported") {
  const test::TemporaryFolder folder;
  {
    DatasetStore store(folder.path());
    put(store, "spheres", {sphere.vertices});
  }
  std::filesystem::create_directory(folder / ".scratch-7");
  std::filesystem::resize_file(folder.path() / "spheres" / "frames.npy", 400);
  DatasetStore store(folder.path());
  CHECK(entries(folder.path()) == 1);
  CHECK_THROWS_AS(store.load("spheres"), Corrupted);
}

TEST_CASE("names are safe folder names") {
  for (const auto* good : {"a", "A-1_b.c", "9"}) CHECK_NOTHROW(requireName(good, "name"));
  for (const auto& bad : {std::string(), std::string("."), std::string(".."), std::string(".a"), std::string("a/b"),
                          std::string("a b"), std::string("a\0b", 3), std::string("-a"), std::string(101, 'a')})
    CHECK_THROWS_AS(requireName(bad, "name"), InvalidInput);
}

TEST_CASE("a dataset is read frame by frame, also when it is deleted meanwhile") {
  const test::TemporaryFolder folder;
  DatasetStore store(folder.path());
  const auto other = test::jitter(sphere.vertices, 0.01, 1);
  put(store, "spheres", {sphere.vertices, other});
  CHECK(store.topology("spheres")->id() == sphere.topology->id());
  const auto frames = store.open("spheres");
  CHECK(frames.count() == 2);
  CHECK(frames.topology()->id() == sphere.topology->id());
  store.remove("spheres");
  CHECK((frames.frame(1) - other).cwiseAbs().maxCoeff() < 1e-6);
  CHECK_THROWS_AS(store.open("spheres"), NotFound);
  CHECK_THROWS_AS(store.topology("spheres"), NotFound);
}

TEST_CASE("a dataset whose frames were spoiled on the disk says so when it is read") {
  const test::TemporaryFolder folder;
  DatasetStore store(folder.path());
  put(store, "spheres", {sphere.vertices, sphere.vertices});
  auto spoiled = sphere.vertices;
  spoiled.row(sphere.topology->faces()(0, 0)) = spoiled.row(sphere.topology->faces()(0, 1));
  writeFrames(folder.path() / "spheres" / "frames.npy", {sphere.vertices, spoiled});
  const auto frames = store.open("spheres");
  CHECK_NOTHROW(frames.frame(0));
  CHECK_THROWS_AS(frames.frame(1), Corrupted);
  writeFrames(folder.path() / "spheres" / "frames.npy", {sphere.vertices});
  CHECK_THROWS_AS(store.open("spheres"), Corrupted);
}
