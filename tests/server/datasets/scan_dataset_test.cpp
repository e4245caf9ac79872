#include <catch2/catch.hpp>

#include "core/io/file.h"
#include "core/numerics/error.h"
#include "server/datasets/dataset_store.h"
#include "server/errors/errors.h"
#include "tests/support/shapes.h"
#include "tests/support/temporary_folder.h"

using namespace shaped;
using namespace shaped::server;
using Catch::Contains;

namespace {

const auto sphere = test::icosphere(2);  // 162 vertices

/// Points, normals and faces; another one for each seed.
Scan scanOf(int seed) {
  const auto points = test::jitter(sphere.vertices, 0.01, static_cast<unsigned>(seed));
  return {points, points.rowwise().normalized(), sphere.topology->faces()};
}

DatasetInfo put(DatasetStore& store, const std::string& name, const std::vector<Scan>& scans) {
  auto upload = store.beginScans(name, std::ssize(scans));
  for (std::size_t i = 0; i < scans.size(); ++i)
    upload->append(scans[i], i == 0 ? "" : "scan " + std::to_string(i) + ".ply");
  return upload->commit();
}

bool empty(const std::filesystem::path& folder) { return std::filesystem::is_empty(folder); }

}  // namespace

TEST_CASE("raw scans outlive the store object, each with what it has") {
  const test::TemporaryFolder folder;
  const Scan points{scanOf(2).points, {}, {}};
  {
    DatasetStore store(folder.path());
    const auto info = put(store, "people", {scanOf(1), points});
    CHECK(info.kind == DatasetKind::kScans);
    CHECK(info.frames == 2);
  }
  const DatasetStore store(folder.path());
  REQUIRE(store.list().size() == 1);
  CHECK(store.getScans("people", "scans").frames == 2);
  store.keep("people", folder.path() / "kept");
  const DatasetScans scans(folder.path() / "kept");
  REQUIRE(scans.count() == 2);
  CHECK(scans.name(0) == "0");
  CHECK(scans.name(1) == "scan 1.ply");
  CHECK(scans.scan(0).points == scanOf(1).points.cast<float>().cast<double>());
  CHECK(scans.scan(0).normals == scanOf(1).normals.cast<float>().cast<double>());
  CHECK(scans.scan(0).faces == scanOf(1).faces);
  CHECK(scans.scan(1).normals.rows() == 0);
  CHECK(scans.scan(1).faces.rows() == 0);
}

TEST_CASE("faulty scans are refused by name, and nothing is kept") {
  const test::TemporaryFolder folder;
  DatasetStore store(folder.path());
  const auto refuse = [&](const Scan& scan, const std::string& text, const std::string& name = "bad.ply") {
    auto upload = store.beginScans("people", 2);
    upload->append(scanOf(1), "good.ply");
    CHECK_THROWS_WITH(upload->append(scan, name), Contains(text));
  };
  auto broken = scanOf(1);
  broken.points(5, 2) = std::nan("");
  refuse(broken, "scans[1] (bad.ply).points[5]: has a coordinate that is not a finite number");
  refuse({}, "scans[1] (bad.ply): has no points");
  refuse({scanOf(1).points.topRows(50), {}, {}}, "scans[1] (bad.ply): has 50 points, want at least 100");
  refuse(scanOf(1), "scans[1]: has a name of 256 bytes, want at most 255", std::string(256, 'x'));
  CHECK_THROWS_WITH(store.beginScans("people", 0), Contains("scans: = 0, want >= 1"));
  CHECK_THROWS_WITH(store.beginScans("../up", 1), Contains("name: want 1 to 100"));
  auto upload = store.beginScans("people", 2);
  upload->append(scanOf(1), "");
  CHECK_THROWS_WITH(upload->commit(), Contains("scans: the header announced 2, 1 came"));
  upload->append(scanOf(2), "");
  CHECK_THROWS_WITH(upload->append(scanOf(3), ""), Contains("scans[2]: is one too many"));
  upload.reset();
  CHECK(store.list().empty());
  CHECK(empty(folder.path()));
}

TEST_CASE("the same scans may come again under their name, others not") {
  const test::TemporaryFolder folder;
  DatasetStore store(folder.path());
  put(store, "people", {scanOf(1), scanOf(2)});
  CHECK_NOTHROW(put(store, "people", {scanOf(1), scanOf(2)}));
  CHECK_THROWS_AS(put(store, "people", {scanOf(1), scanOf(3)}), AlreadyExists);
  CHECK_THROWS_AS(put(store, "people", {scanOf(1)}), AlreadyExists);
  CHECK(store.list().size() == 1);
}

TEST_CASE("shapes and scans are told apart, under one set of names") {
  const test::TemporaryFolder folder;
  DatasetStore store(folder.path());
  put(store, "people", {scanOf(1)});
  auto shapes = store.begin("bodies", sphere.topology->vertexCount(), sphere.topology->faces(), 1);
  shapes->append(sphere.vertices, "");
  shapes->commit();
  CHECK_THROWS_WITH(store.get("people"), Contains("dataset: \"people\" holds raw scans, want shapes"));
  CHECK_THROWS_WITH(store.load("people"), Contains("dataset: \"people\" holds raw scans, want shapes"));
  CHECK_THROWS_WITH(store.getScans("bodies", "bootstrap.scans"),
                    Contains("bootstrap.scans: \"bodies\" holds shapes of one connectivity, want raw scans"));
  CHECK_THROWS_AS(store.getScans("nobody", "bootstrap.scans"), NotFound);
  CHECK_THROWS_AS(put(store, "bodies", {scanOf(1)}), AlreadyExists);
}

TEST_CASE("what is kept of a dataset stays when its name goes") {
  const test::TemporaryFolder folder, job;
  DatasetStore store(folder.path());
  put(store, "people", {scanOf(1), scanOf(2)});
  auto shapes = store.begin("bodies", sphere.topology->vertexCount(), sphere.topology->faces(), 1);
  shapes->setTemplate(2 * sphere.vertices);
  shapes->append(sphere.vertices, "");
  shapes->commit();
  for (const auto* name : {"people", "bodies"}) {
    store.keep(name, job.path() / name);
    store.remove(name);
    CHECK_NOTHROW(store.keep("nobody", job.path() / name));  // there already
    CHECK_THROWS_AS(store.keep(name, job.path() / "again"), NotFound);
  }
  CHECK(empty(folder.path()));
  CHECK(DatasetScans(job.path() / "people").scan(1).points == scanOf(2).points.cast<float>().cast<double>());
  const auto kept = readDataset(job.path() / "bodies");
  CHECK(kept.shapes.size() == 1);
  CHECK(kept.template_shape.has_value());
  CHECK_FALSE(std::filesystem::exists(job.path() / "again"));
}

TEST_CASE("damaged files of scans are found out") {
  const test::TemporaryFolder folder;
  DatasetStore store(folder.path());
  put(store, "people", {scanOf(1), scanOf(2)});
  const auto people = folder.path() / "people";
  writeFile(people / "scan_000001.safetensors", readFile(people / "scan_000001.safetensors").substr(0, 300));
  const DatasetScans scans(people);
  CHECK_NOTHROW(scans.scan(0));
  CHECK_THROWS_AS(scans.scan(1), Corrupted);
  writeFile(people / "names.json", "{}");
  CHECK_THROWS_AS(DatasetScans(people), Corrupted);
}
