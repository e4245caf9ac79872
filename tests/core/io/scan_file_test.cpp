#include "core/io/scan_file.h"

#include <bit>
#include <catch2/catch.hpp>
#include <cmath>
#include <fstream>
#include <nlohmann/json.hpp>

#include "core/io/byte_reader.h"
#include "core/io/file_error.h"
#include "core/io/mesh_file.h"
#include "core/io/npy.h"
#include "core/numerics/error.h"
#include "tests/support/real_data.h"
#include "tests/support/temporary_folder.h"

using namespace shaped;
using Catch::Contains;

namespace {

/// Three points with numbers that no float holds; normals of unit length to rounding.
Scan smallScan() {
  Scan scan{Vertices(3, 3), Vertices(3, 3), Faces(1, 3)};
  scan.points << 0.1, -1.0 / 3, 1e-17, 1.0000000000000002, 0, 123456.789012345678, 0, 1, -1e-300;
  scan.normals << 0, 0, 1, 0.6, 0.8, 0, 1 / std::sqrt(3), -1 / std::sqrt(3), 1 / std::sqrt(3);
  scan.faces << 2, 0, 1;
  return scan;
}

Scan readText(const test::TemporaryFolder& folder, std::string_view name, std::string_view text) {
  return readScan(folder.file(name, text));
}

/// The small scan as PLY numbers of a type; normals times `length`.
template <class Scalar>
std::string binaryPly(std::endian order, const char* scalar, double length, bool with_normals, bool with_faces) {
  const auto scan = smallScan();
  std::string bytes =
      std::string("ply\nformat binary_") + (order == std::endian::little ? "little" : "big") + "_endian 1.0\n";
  bytes += "element vertex 3\n";
  for (const std::string name : {"x", "y", "z"}) bytes += "property " + std::string(scalar) + " " + name + "\n";
  bytes += "property uchar red\n";
  if (with_normals)
    for (const std::string name : {"nx", "ny", "nz"}) bytes += "property " + std::string(scalar) + " " + name + "\n";
  if (with_faces) bytes += "element face 1\nproperty list uchar int vertex_indices\n";
  bytes += "end_header\n";
  for (int i = 0; i < 3; ++i) {
    for (const double x : scan.points.row(i)) appendNumber(bytes, static_cast<Scalar>(x), order);
    bytes += '\7';
    if (!with_normals) continue;
    for (const double x : scan.normals.row(i)) appendNumber(bytes, static_cast<Scalar>(length * x), order);
  }
  if (!with_faces) return bytes;
  bytes += '\3';
  for (const std::int32_t corner : {2, 0, 1}) appendNumber(bytes, corner, order);
  return bytes;
}

}  // namespace

TEST_CASE("a scan reads back exactly as it was written, with and without normals and faces") {
  const test::TemporaryFolder folder;
  for (const bool normals : {false, true})
    for (const bool faces : {false, true}) {
      auto scan = smallScan();
      if (!normals) scan.normals.resize(0, 3);
      if (!faces) scan.faces.resize(0, 3);
      writeScan(folder / "a.PLY", scan);
      const auto back = readScan(folder / "a.PLY");
      CHECK(back.points == scan.points);
      CHECK(back.normals == scan.normals);
      CHECK(back.faces == scan.faces);
    }
}

TEST_CASE("scans come from PLY of both byte orders and from text, their normals made unit") {
  const test::TemporaryFolder folder;
  const auto scan = smallScan();
  for (const auto order : {std::endian::little, std::endian::big})
    for (const bool normals : {false, true})
      for (const bool faces : {false, true}) {
        const auto doubles = readText(folder, "a.ply", binaryPly<double>(order, "double", 1.01, normals, faces));
        CHECK(doubles.points == scan.points);
        REQUIRE(doubles.normals.rows() == (normals ? 3 : 0));
        REQUIRE(doubles.faces.rows() == (faces ? 1 : 0));
        if (normals) CHECK((doubles.normals - scan.normals).cwiseAbs().maxCoeff() < 1e-15);
        if (faces) CHECK(doubles.faces == scan.faces);
        const auto floats = readText(folder, "a.ply", binaryPly<float>(order, "float", 0.99, normals, faces));
        const Eigen::Matrix<float, 3, 3> rounded = scan.points.cast<float>();
        CHECK(floats.points == rounded.cast<double>());
        for (const auto& normal : floats.normals.rowwise()) CHECK(normal.norm() == Approx(1).epsilon(1e-15));
      }
  const auto text =
      readText(folder, "a.ply",
               "ply\nformat ascii 1.0\nelement vertex 2\nproperty float nx\nproperty float x\nproperty "
               "float y\nproperty float ny\nproperty float z\nproperty float nz\nelement face 0\nproperty "
               "list uchar int vertex_indices\nend_header\n0 1 2 0 3 2\n1e-320 4 5 0 6 0\n");
  Vertices points(2, 3), normals(2, 3);
  points << 1, 2, 3, 4, 5, 6;
  normals << 0, 0, 1, 1, 0, 0;
  CHECK(text.points == points);
  CHECK(text.normals == normals);
  CHECK(text.faces.rows() == 0);
}

TEST_CASE("OBJ gives normals where every vertex has one") {
  const test::TemporaryFolder folder;
  const std::string points = "v 0 0 0\nv 1 0 0\nv 0 1 0\n";
  Vertices straight(3, 3), three(3, 3);
  straight << 0, 0, 1, 0, 0, 1, 0, 0, 1;
  three << 1, 0, 0, 0, 1, 0, 0, 0, 1;
  const std::string list = "vn 3 0 0\nvn 0 3 0\nvn 0 0 3\n";
  CHECK(readText(folder, "a.obj", points + list).normals == three);
  CHECK(readText(folder, "a.obj", points + list + "f 3 2 1\n").normals == three);
  CHECK(readText(folder, "a.obj", points + list + "f 1//1 2//2 3/8/3\n").normals == three);
  CHECK(readText(folder, "a.obj", points + "vn 0 0 3\nf 1//1 2//-1 3/1/1\n").normals == straight);
  Vertices turned = three;
  turned.row(0).swap(turned.row(2));
  CHECK(readText(folder, "a.obj", points + list + "f 1//3 2//2 3//1\n").normals == turned);
  CHECK(readText(folder, "a.obj", points + "f 1//1 2//1 3//1\nvn 0 0 1\n").normals == straight);
  // Two normals of the same direction are one; hard edges and loose vertices leave the question open.
  CHECK(readText(folder, "a.obj", points + "vn 0 0 1\nvn 0 0 1\nf 1//1 2//2 3//1\nf 3//2 2//1 1//1\n").normals ==
        straight);
  CHECK(readText(folder, "a.obj", points + list + "f 1//1 2//2 3//3\nf 3//1 2//2 1//1\n").normals.rows() == 0);
  CHECK(readText(folder, "a.obj", points + "v 9 9 9\nvn 0 0 1\nf 1//1 2//1 3//1\n").normals.rows() == 0);
  const auto bare = readText(folder, "a.obj", points + "f 1/1 2/2 3/3\n");
  CHECK(bare.normals.rows() == 0);
  CHECK(bare.faces == Eigen::RowVector3i(0, 1, 2));
}

TEST_CASE("scans come from OFF, STL, .npy and .xyz") {
  const test::TemporaryFolder folder;
  const auto off = readText(folder, "a.off", "CNOFF\n2 0 0\n1 2 3 0 0 5 255 0 0 255\n4 5 6 0 2 0 0 0 0 0\n");
  Vertices points(2, 3), normals(2, 3);
  points << 1, 2, 3, 4, 5, 6;
  normals << 0, 0, 1, 0, 1, 0;
  CHECK(off.points == points);
  CHECK(off.normals == normals);
  CHECK(readText(folder, "a.off", "COFF\n2 0 0\n1 2 3 9 9 9\n4 5 6 9 9 9\n").normals.rows() == 0);

  const auto stl = readText(folder, "a.stl",
                            "solid\nfacet normal 0 0 1 outer loop vertex 0 0 0 vertex 1 0 0 vertex 0 1 0 endloop "
                            "endfacet\nendsolid\n");
  CHECK(stl.points.rows() == 3);
  CHECK(stl.faces.rows() == 1);
  CHECK(stl.normals.rows() == 0);

  const std::vector<double> numbers{1, 2, 3, 0, 0, 5, 4, 5, 6, 0, 2, 0};
  writeNpy(folder / "a.npy", {2, 6}, numbers);
  CHECK(readScan(folder / "a.npy").points == points);
  CHECK(readScan(folder / "a.npy").normals == normals);
  writeNpy(folder / "b.npy", {4, 3}, numbers);
  CHECK(readScan(folder / "b.npy").points.rows() == 4);
  CHECK(readScan(folder / "b.npy").normals.rows() == 0);

  const auto xyz = readText(folder, "a.xyz", "# x y z\n1 2 3\t0 0 5\n\n4 5 6 0 2 0\n");
  CHECK(xyz.points == points);
  CHECK(xyz.normals == normals);
  CHECK(readText(folder, "a.xyz", "1 2 3\r\n4 5 6").points == points);
}

TEST_CASE("a mesh is read without its normals, sound or not") {
  const test::TemporaryFolder folder;
  const std::string obj = "v 0 0 0\nv 1 0 0\nv 0 1 0\nvn 0 0 0\nvn junk\nf 1//1 2//7 3//x\n";
  CHECK(readMesh(folder.file("a.obj", obj)).faces.rows() == 1);
  CHECK(readMesh(folder.file("a.ply", binaryPly<double>(std::endian::big, "double", 0, true, true))).faces.rows() == 1);
  CHECK(readMesh(folder.file("a.off", "NOFF\n3 1 0\n0 0 0 0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n")).faces.rows() == 1);
}

TEST_CASE("faulty scan files are refused with the file, the place and the reason") {
  const test::TemporaryFolder folder;
  const std::string
      head = "ply\nformat ascii 1.0\nelement vertex 2\nproperty float x\nproperty float y\nproperty float z\n",
      normal = "property float nx\nproperty float ny\nproperty float nz\n", end = "end_header\n";
  struct Case {
    std::string name, bytes, error;
  };
  const std::vector<Case> cases{
      {"a.ply", "", "a.ply: is empty"},
      {"a.pcd", "x", "a.pcd: is no scan by its extension '.pcd'; want .ply, .obj, .off, .stl, .npy or .xyz"},
      {"a.ply", "ply\nformat ascii 1.0\nelement vertex 0\nproperty float x\nproperty float y\nproperty float z\n" + end,
       "a.ply: has no points"},
      {"a.ply", "ply\nformat ascii 1.0\n" + end, "a.ply: has no points"},
      {"a.ply", head + end + "0 0 0\n0 nan 0\n", "a.ply: vertex 1 has a coordinate that is not a finite number"},
      {"a.ply", head + normal + end + "0 0 0 0 0 1\n0 0 0 0 0 0\n", "a.ply: vertex 1 has a normal of length zero"},
      {"a.ply", head + normal + end + "0 0 0 inf 0 1\n0 0 0 0 0 1\n",
       "a.ply: vertex 0 has a normal that is not finite"},
      {"a.ply", head + "property float nx\nproperty float nz\n" + end + "0 0 0 0 1\n0 0 0 0 1\n",
       "a.ply: has vertices without the property ny"},
      {"a.ply", head + end + "0 0 0\n", "a.ply: is truncated"},
      {"a.ply", head + end + "0 0 0\n0 0 0\n1\n", "a.ply: goes on with '1'"},
      {"a.ply", head + "element face 1\nproperty list uchar int vertex_index\n" + end + "0 0 0\n0 0 0\n3 0 1 2\n",
       "a.ply: face 0 has vertex index 2 (counted from 0), outside the file's 2 vertices"},
      {"a.obj", "# nothing\n", "a.obj: has no points"},
      {"a.obj", "v 0 0 0\nvn 0 0\n", "a.obj:2: nothing stands where nz should"},
      {"a.obj", "v 0 0 0\nvn 0 0 0\n", "a.obj: vertex 0 has a normal of length zero"},
      {"a.obj", "v 0 0 0\nvn 0 0 1\nf 1//1 1//1 1//2\n", "a.obj: a face has normal 2 of the file's 1"},
      {"a.obj", "v 0 0 0\nvn 0 0 1\nf 1//1 1//1 1//-2\n", "a.obj:3: '1//-2' names none of the file's normals"},
      {"a.obj", "v 0 0 0\nvn 0 0 1\nf 1//1 1//1 1//x\n", "a.obj:3: '1//x' names none of the file's normals"},
      {"a.obj", "v 0 0 0\nvn 0 0 1\nf 1//1 1//1 4//1\n", "a.obj: face 0 has vertex index 3"},
      {"a.off", "OFF\n0 0 0\n", "a.off: has no points"},
      {"a.off", "NOFF\n1 0 0\n0 0 0\n", "a.off:3: nothing stands where nx should"},
      {"a.stl", "solid a\nendsolid a\n", "a.stl: has no points"},
      {"a.xyz", "# nothing\n", "a.xyz: has no points"},
      {"a.xyz", "0 0\n", "a.xyz:1: 2 numbers stand here; want x y z, or x y z nx ny nz, in every line"},
      {"a.xyz", "0 0 0\n0 0 0 1 0 0\n", "a.xyz:2: 6 numbers stand here"},
      {"a.xyz", "0 0 0\n0 a 0\n", "a.xyz:2: 'a' is not a number"},
      {"a.npy", "x", "a.npy"}};
  for (const auto& [name, bytes, error] : cases) {
    INFO(bytes);
    const auto path = folder.file(name, bytes);
    CHECK_THROWS_AS(readScan(path), InvalidInput);
    CHECK_THROWS_WITH(readScan(path), Contains(error));
  }
  CHECK_THROWS_WITH(readScan(folder / "none.ply"), Contains("none.ply: cannot be opened"));
  const std::vector<double> numbers{1, 2, 3, 4, 5, 6, 7, 8};
  writeNpy(folder / "four.npy", {2, 4}, numbers);
  CHECK_THROWS_WITH(readScan(folder / "four.npy"), Contains("four.npy: is no list of points; want an array N x 3, or"));
  writeNpy(folder / "none.npy", {0, 3}, std::span<const double>());
  CHECK_THROWS_WITH(readScan(folder / "none.npy"), Contains("none.npy: has no points"));
}

TEST_CASE("a scan cut anywhere is refused, never half-read and never a crash") {
  const test::TemporaryFolder folder;
  const auto whole = binaryPly<float>(std::endian::big, "float", 1, true, true);
  for (std::size_t size = 1; size < whole.size(); ++size)
    CHECK_THROWS_AS(readText(folder, "cut.ply", whole.substr(0, size)), InvalidInput);
}

TEST_CASE("a scan that is none is not written") {
  const test::TemporaryFolder folder;
  const auto refused = [&](const Scan& scan, const char* error) {
    CHECK_THROWS_WITH(writeScan(folder / "a.ply", scan), Contains(error));
    CHECK_FALSE(std::filesystem::exists(folder / "a.ply"));
  };
  CHECK_THROWS_WITH(writeScan(folder / "a.xyz", smallScan()), Contains("a.xyz: a scan is written as PLY"));
  refused({}, "a.ply: no points to write");
  auto scan = smallScan();
  scan.points(1, 1) = std::nan("");
  refused(scan, "a.ply: vertex 1 has a coordinate that is not a finite number");
  scan = smallScan();
  scan.normals.conservativeResize(2, 3);
  refused(scan, "a.ply: 2 normals for 3 points; want one for each, or none");
  scan = smallScan();
  scan.normals.row(2) *= 2;
  refused(scan, "a.ply: the normal of point 2 has length 2; want 1");
  scan.normals(2, 0) = std::nan("");
  refused(scan, "a.ply: the normal of point 2 has length");
  scan = smallScan();
  scan.faces(0, 1) = 3;
  refused(scan, "a.ply: face 0 has a vertex index outside [0, 3)");
}

TEST_CASE("the scans of the body data set are read whole", "[data]") {
  const auto folder = test::realData("body_scans");
  if (!folder) return;
  const auto description = nlohmann::json::parse(std::ifstream(*folder / "scans.json"));
  for (const auto& entry : description["scans"]) {
    const auto scan = readScan(*folder / entry["scan"].get<std::string>());
    CHECK(scan.points.rows() == entry["points"].get<Eigen::Index>());
    REQUIRE(scan.normals.rows() == scan.points.rows());
    CHECK(scan.faces.rows() == 0);
    CHECK((scan.normals.rowwise().norm().array() - 1).abs().maxCoeff() < 1e-14);
  }
  const auto file = *folder / "gt" / "scan_00_gt.ply";
  CHECK(readScan(file).points == readMesh(file).vertices);
  CHECK(readScan(file).faces == readMesh(file).faces);
}
