#include "core/io/mesh_file.h"

#include <OpenMesh/Core/IO/MeshIO.hh>
#include <OpenMesh/Core/Mesh/PolyMesh_ArrayKernelT.hh>
#include <bit>
#include <catch2/catch.hpp>

#include "core/io/byte_reader.h"
#include "core/io/file_error.h"
#include "core/mesh/topology.h"
#include "core/numerics/error.h"
#include "tests/support/real_data.h"
#include "tests/support/temporary_folder.h"

using namespace shaped;
using Catch::Contains;

namespace {

/// A tetrahedron with coordinates that no float holds, and a spare digit of every kind.
MeshFile tetrahedron() {
  MeshFile mesh{Vertices(4, 3), Faces(4, 3)};
  mesh.vertices << 0.1, -1.0 / 3, 1e-17, 1.0000000000000002, 0, 123456.789012345678, 0, 1, -0.0, 1e-300, 2, 3;
  mesh.faces << 0, 2, 1, 0, 1, 3, 1, 2, 3, 0, 3, 2;
  return mesh;
}

MeshFile readText(const test::TemporaryFolder& folder, std::string_view name, std::string_view text) {
  return readMesh(folder.file(name, text));
}

template <class Scalar>
std::string binaryPly(std::endian order, const char* scalar_name) {
  const auto mesh = tetrahedron();
  std::string bytes = std::string("ply\nformat binary_") + (order == std::endian::little ? "little" : "big") +
                      "_endian 1.0\ncomment x\nelement vertex 4\nproperty uchar quality\nproperty " + scalar_name +
                      " x\nproperty " + scalar_name + " y\nproperty " + scalar_name +
                      " z\nelement face 4\nproperty list uchar uint vertex_index\nproperty list int short tags\n"
                      "element extra 2\nproperty short a\nend_header\n";
  for (const auto& v : mesh.vertices.rowwise()) {
    bytes += '\7';
    for (const double x : v) appendNumber(bytes, static_cast<Scalar>(x), order);
  }
  for (const auto& f : mesh.faces.rowwise()) {
    bytes += '\3';
    for (const int v : f) appendNumber(bytes, static_cast<std::uint32_t>(v), order);
    appendNumber(bytes, std::int32_t{2}, order);
    bytes += "abcd";
  }
  return bytes + "wxyz";
}

}  // namespace

TEST_CASE("OBJ, OFF and PLY read back exactly what was written") {
  const test::TemporaryFolder folder;
  const auto mesh = tetrahedron();
  for (const char* name : {"a.obj", "a.off", "a.ply", "a.PLY", "a.Obj"}) {
    writeMesh(folder / name, mesh.vertices, mesh.faces);
    const auto back = readMesh(folder / name);
    INFO(name);
    CHECK(back.vertices == mesh.vertices);
    CHECK(back.faces == mesh.faces);
  }
}

TEST_CASE("STL reads back in float precision, its corners welded in order of appearance") {
  const test::TemporaryFolder folder;
  auto mesh = tetrahedron();
  writeMesh(folder / "a.stl", mesh.vertices, mesh.faces);
  const auto back = readMesh(folder / "a.stl");
  REQUIRE(back.vertices.rows() == 4);
  REQUIRE(back.faces.rows() == 4);
  const Eigen::Matrix<float, 4, 3> floats = mesh.vertices.cast<float>();
  for (int f = 0; f < 4; ++f)
    for (int c = 0; c < 3; ++c)
      CHECK(back.vertices.row(back.faces(f, c)) == floats.row(mesh.faces(f, c)).cast<double>());
  CHECK(back.faces.row(0) == Eigen::RowVector3i(0, 1, 2));
  CHECK(Topology(4, back.faces).closed());
}

TEST_CASE("polygons become fans and corner attributes are skipped") {
  const test::TemporaryFolder folder;
  Faces fan(3, 3);
  fan << 0, 1, 2, 0, 2, 3, 0, 3, 4;
  const std::string points = "v 0 0 0\r\nv 1 0 0 1 0.5 0\r\nv 1 1 0\r\nv\t0.5 1.5 0\r\nv 0 1 0\r\n";
  for (const std::string face : {"f 1 2 3 4 5", "f 1/1 2/2 3/3 4/4 5/5", "f 1//1 2//1 3//1 4//1 5//1",
                                 "f -5 -4 -3 -2 -1", "f 1/7/9 2/7/9 3/7/9 \\\r\n 4/7/9 5/7/9"}) {
    const auto mesh = readText(folder, "a.obj", "# c\r\nmtllib none.mtl\r\n" + points + "vn 0 0 1\r\n" + face + "\r\n");
    INFO(face);
    CHECK(mesh.faces == fan);
    CHECK(mesh.vertices(1, 0) == 1);
    CHECK(mesh.vertices(3, 1) == 1.5);
  }
  CHECK(readText(folder, "a.off", "OFF 5 1 0\n0 0 0\n1 0 0 255 0 0\n1 1 0\n\n# c\n.5 1.5 0\n0 1 0\n5 0 1 2 3 4 9 9 9\n")
            .faces == fan);
  CHECK(readText(folder, "a.off", "STCNOFF\n5 1 0\n0 0 0 0 0 1\n1 0 0\n1 1 0\n.5 1.5 0\n0 1 0\n5 0 1 2 3 4\n").faces ==
        fan);
  CHECK(readText(folder, "a.ply",
                 "ply\nformat ascii 1.0\nelement vertex 5\nproperty float y\nproperty list uchar int junk\nproperty "
                 "double x\nproperty double z\nelement face 1\nproperty uchar red\nproperty list uchar int "
                 "vertex_indices\nend_header\n0 0 0 0\n0 1 7 1 0\n1 0 1 0\n1.5 0 .5 0\n1 0 0 0\n9 5 0 1 2 3 4\n")
            .faces == fan);
}

TEST_CASE("PLY reads both byte orders, floats and doubles, and walks over what it does not know") {
  const test::TemporaryFolder folder;
  const auto mesh = tetrahedron();
  for (const auto order : {std::endian::little, std::endian::big}) {
    const auto doubles = readText(folder, "a.ply", binaryPly<double>(order, "double"));
    CHECK(doubles.vertices == mesh.vertices);
    CHECK(doubles.faces == mesh.faces);
    const auto floats = readText(folder, "a.ply", binaryPly<float>(order, "float32"));
    const Eigen::Matrix<float, 4, 3> rounded = mesh.vertices.cast<float>();
    CHECK(floats.vertices == rounded.cast<double>());
    CHECK(floats.faces == mesh.faces);
  }
}

TEST_CASE("STL text reads keywords in any case and several solids") {
  const test::TemporaryFolder folder;
  const std::string facet =
      "FACET NORMAL 0 0 1\nOUTER LOOP\nvertex 0 0 0\nVERTEX 1 0 0\nvertex 1 1 -0.0\nENDLOOP\nendfacet\n";
  const std::string other =
      "facet normal 0 0 1 outer loop vertex 0 0 -0\nvertex 1 1 0\nvertex 0 1 0\nendloop endfacet\n";
  const auto mesh =
      readText(folder, "a.stl", "solid facet one\n" + facet + "endsolid one\n\nsolid two\n" + other + "endsolid two\n");
  REQUIRE(mesh.faces.rows() == 2);
  CHECK(mesh.vertices.rows() == 4);
  CHECK(mesh.faces.row(1) == Eigen::RowVector3i(0, 2, 3));
}

TEST_CASE("a binary STL may begin with the word solid") {
  const test::TemporaryFolder folder;
  const auto mesh = tetrahedron();
  writeMesh(folder / "a.stl", mesh.vertices, mesh.faces);
  auto bytes = test::bytesOf(folder / "a.stl");
  bytes.replace(0, 10, "solid cube");
  CHECK(readText(folder, "b.stl", bytes).faces.rows() == 4);
}

TEST_CASE("faulty connectivity passes unchanged, for Topology to name") {
  const test::TemporaryFolder folder;
  const auto mesh =
      readText(folder, "a.off", "OFF\n5 4 0\n0 0 0\n1 0 0\n0 1 0\n0 0 1\n0 1 1\n3 0 1 2\n3 1 0 3\n3 0 1 4\n3 2 2 1\n");
  REQUIRE(mesh.faces.rows() == 4);
  CHECK_THROWS_WITH(Topology(5, mesh.faces), Contains("faces[3]: repeats vertex 2"));
  CHECK_THROWS_WITH(Topology(5, mesh.faces.topRows(3)), Contains("edge (0, 1) has 3 faces"));
}

TEST_CASE("OpenMesh reads what we write and we read what OpenMesh writes") {
  using OpenMeshMesh = OpenMesh::PolyMesh_ArrayKernelT<>;
  const test::TemporaryFolder folder;
  const auto mesh = tetrahedron();
  omlog().disable();
  omerr().disable();
  for (const char* name : {"a.obj", "a.off", "a.ply", "a.stl"}) {
    INFO(name);
    writeMesh(folder / name, mesh.vertices, mesh.faces);
    OpenMeshMesh other;
    REQUIRE(OpenMesh::IO::read_mesh(other, (folder / name).string()));
    REQUIRE(other.n_vertices() == 4);
    CHECK(other.n_faces() == 4);
    const std::string copy = (folder / (std::string("copy_") + name)).string();
    REQUIRE(OpenMesh::IO::write_mesh(other, copy, OpenMesh::IO::Options::Default, 9));
    const auto back = readMesh(copy);
    CHECK(back.faces.rows() == 4);
    for (int v = 0; v < 4; ++v)
      for (int c = 0; c < 3; ++c)
        CHECK(back.vertices(v, c) ==
              Approx(double{other.point(OpenMesh::VertexHandle(v))[c]}).epsilon(1e-6).margin(1e-12));
  }
  omlog().enable();
  omerr().enable();
}

TEST_CASE("faulty mesh files are refused with the file, the place and the reason") {
  const test::TemporaryFolder folder;
  const std::string off = "OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n", ply_head = "ply\nformat ascii 1.0\nelement vertex 3\n",
                    xyz = "property float x\nproperty float y\nproperty float z\n",
                    faces = "element face 1\nproperty list uchar int vertex_indices\nend_header\n",
                    points = "0 0 0\n1 0 0\n0 1 0\n";
  struct Case {
    std::string name, bytes, error;
  };
  const std::vector<Case> cases{
      {"a.obj", "", "a.obj: is empty"},
      {"a.off", "", "a.off: is empty"},
      {"a.ply", "", "a.ply: is empty"},
      {"a.stl", "", "a.stl: is empty"},
      {"a.gltf", "x", "a.gltf: is no mesh by its extension '.gltf'; want .obj, .off, .ply or .stl"},
      {"mesh", "x", "mesh: is no mesh by its extension ''"},
      {"a.obj", "# nothing\n", "a.obj: has no vertices"},
      {"a.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\n", "a.obj: has no faces"},
      {"a.obj", "v 0 0 0\nv 1 nan 0\n", "a.obj: vertex 1 has a coordinate that is not a finite number"},
      {"a.obj", "v 0 0 0\nv 1 1e999 0\n", "a.obj:2: '1e999' is not a number; want y"},
      {"a.obj", "v 0 0\n", "a.obj:1: nothing stands where z should"},
      {"a.obj", "v 0 0 zero\n", "a.obj:1: 'zero' is not a number; want z"},
      {"a.obj", "v 0 0 0\nf 1 1\n", "a.obj:2: a face has fewer than 3 corners"},
      {"a.obj", "v 0 0 0\nf 0 1 1\n", "a.obj:2: '0' is no face corner"},
      {"a.obj", "v 0 0 0\nf -9223372036854775808 1 1\n", "a.obj:2: corner '-9223372036854775808' counts back beyond"},
      {"a.obj", "v 0 0 0\nf -2 1 1\n", "a.obj:2: corner '-2' counts back beyond the first of 1 vertices"},
      {"a.obj", "v 0 0 0\nf 1 1 1\nf 1 1 5\n",
       "a.obj: face 1 has vertex index 4 (counted from 0), outside the file's 1"},
      {"a.obj", "v 0 0 0\nf 1 1 99999999999\n", "a.obj: face 0 has vertex index 99999999998"},
      {"a.off", "OBJ\n", "a.off:1: 'OBJ' is not the keyword"},
      {"a.off", "4OFF\n", "a.off:1: '4OFF' is not the keyword of a three-dimensional OFF"},
      {"a.off", "OFF BINARY\n", "a.off:1: binary OFF is not supported"},
      {"a.off", "OFF\n", "a.off: is truncated: ends before its counts"},
      {"a.off", "OFF\n3\n", "a.off:2: nothing stands where the number of faces should"},
      {"a.off", "OFF\n-1 2\n", "a.off:2: a count is negative"},
      {"a.off", "OFF\n3 0 0\n" + points, "a.off: has no faces"},
      {"a.off", "OFF\n0 0 0\n", "a.off: has no vertices"},
      {"a.off", "OFF\n99999999999 1 0\n" + points, "a.off: is truncated: ends before vertex 3 of the 99999999999"},
      {"a.off", off, "a.off: is truncated: ends before face 0 of the 1"},
      {"a.off", off + "3 0 1 3\n", "a.off: face 0 has vertex index 3 (counted from 0), outside the file's 3 vertices"},
      {"a.off", off + "3 0 1 -1\n", "a.off: face 0 has vertex index -1"},
      {"a.off", off + "2 0 1\n", "a.off: face 0 has 2 corners"},
      {"a.off", off + "999999999999 0 1\n", "a.off:6: nothing stands where a vertex index should"},
      {"a.off", off + "3 0 1 2\n3 0 1 2\n", "a.off:7: the file goes on after the 3 vertices and 1 faces"},
      {"a.ply", "plx\n", "a.ply: does not begin with 'ply'"},
      {"a.ply", "ply\nformat ascii 1.0\n", "a.ply: is truncated: its header has no 'end_header' line"},
      {"a.ply", "ply\nend_header\n", "a.ply: has a PLY header without a 'format' line"},
      {"a.ply", "ply\nformat utf8 1.0\nend_header\n", "a.ply:2: 'utf8' is no PLY format"},
      {"a.ply", "ply\nformat ascii 1.0\nproperty float x\nend_header\n", "a.ply:3: 'property' does not belong"},
      {"a.ply", ply_head + "property quad x\nend_header\n", "a.ply:4: 'quad' is no PLY number type"},
      {"a.ply", ply_head + "property list float int x\nend_header\n", "a.ply:4: the length of a list must be a whole"},
      {"a.ply", ply_head + "property float x\n" + faces, "a.ply: has vertices without the property y"},
      {"a.ply", ply_head + xyz + "end_header\n" + points, "a.ply: has no faces"},
      {"a.ply", ply_head + xyz + faces + "0 0 0\n1 0 inf\n0 1 0\n3 0 1 2\n", "a.ply: vertex 1 has a coordinate"},
      {"a.ply", ply_head + xyz + faces + points, "a.ply: is truncated: ends before the data its header promises"},
      {"a.ply", ply_head + xyz + faces + points + "3 0 1 x\n", "a.ply: 'x' stands where a number should"},
      {"a.ply", ply_head + xyz + faces + points + "3 0 1 1.5\n", "a.ply: 1.5 stands where a vertex index should"},
      {"a.ply", ply_head + xyz + faces + points + "-3 0 1 1\n", "a.ply: a list has the length -3"},
      {"a.ply", ply_head + xyz + faces + points + "3 0 1 2\n3\n", "a.ply: goes on with '3' after the data"},
      {"a.stl", "cube\n", "a.stl:1: 'cube' stands where 'solid' should"},
      {"a.stl", "solid a\nendsolid a\n", "a.stl: has no vertices"},
      {"a.stl", "solid a\n", "a.stl: is truncated: ends without 'endsolid'"},
      {"a.stl", "solid a\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\n", "a.stl: is truncated: ends where 'vertex'"},
      {"a.stl", "solid a\nfacet normal 0 0 1\nouter loop\nvertex 0 0 nan\n",
       "a.stl: is truncated: ends where 'vertex'"},
      {"a.stl", std::string(80, ' ') + std::string("\2\0\0\0", 4) + std::string(60, '\0'),
       "a.stl: is 144 bytes long, but a binary STL of 2 facets has 184"},
      {"a.stl",
       std::string(80, ' ') + std::string("\1\0\0\0", 4) + std::string(16, '\0') + "\xff\xff\xff\x7f" +
           std::string(30, '\0'),
       "a.stl: vertex 0 has a coordinate that is not a finite number"}};
  for (const auto& [name, bytes, error] : cases) {
    INFO(bytes);
    const auto path = folder.file(name, bytes);
    CHECK_THROWS_AS(readMesh(path), InvalidInput);
    CHECK_THROWS_WITH(readMesh(path), Contains(error));
  }
}

TEST_CASE("files that cannot be opened are refused with their name") {
  const test::TemporaryFolder folder;
  CHECK_THROWS_WITH(readMesh(folder / "none.ply"), Contains("none.ply: cannot be opened: No such file"));
  std::filesystem::create_directory(folder / "folder.ply");
  CHECK_THROWS_WITH(readMesh(folder / "folder.ply"), Contains("folder.ply: is not a regular file"));
}

TEST_CASE("a mesh file cut anywhere is refused, never half-read and never a crash") {
  const test::TemporaryFolder folder;
  const auto mesh = tetrahedron();
  const std::string whole_ply = binaryPly<float>(std::endian::big, "float");
  writeMesh(folder / "whole.stl", mesh.vertices, mesh.faces);
  const auto whole_stl = test::bytesOf(folder / "whole.stl");
  for (std::size_t size = 1; size < whole_ply.size(); ++size)
    CHECK_THROWS_AS(readText(folder, "cut.ply", whole_ply.substr(0, size)), InvalidInput);
  for (std::size_t size = 1; size < whole_stl.size(); ++size)
    CHECK_THROWS_AS(readText(folder, "cut.stl", whole_stl.substr(0, size)), InvalidInput);
  writeMesh(folder / "whole.off", mesh.vertices, mesh.faces);
  const auto whole_off = test::bytesOf(folder / "whole.off");
  for (std::size_t size = 1; size + 2 < whole_off.size(); ++size)
    CHECK_THROWS_AS(readText(folder, "cut.off", whole_off.substr(0, size)), InvalidInput);
}

TEST_CASE("a mesh that cannot be read back is not written") {
  const test::TemporaryFolder folder;
  const auto mesh = tetrahedron();
  auto broken = mesh;
  broken.vertices(2, 1) = std::nan("");
  CHECK_THROWS_WITH(writeMesh(folder / "a.ply", broken.vertices, broken.faces),
                    Contains("a.ply: vertex 2 has a coordinate"));
  broken = mesh;
  broken.faces(3, 0) = 4;
  CHECK_THROWS_WITH(writeMesh(folder / "a.ply", broken.vertices, broken.faces),
                    Contains("a.ply: face 3 has a vertex index"));
  CHECK_THROWS_WITH(writeMesh(folder / "a.ply", mesh.vertices, Faces(0, 3)), Contains("a.ply: no faces to write"));
  CHECK_THROWS_WITH(writeMesh(folder / "a.xyz", mesh.vertices, mesh.faces),
                    Contains("a.xyz: is no mesh by its extension"));
  broken = mesh;
  broken.vertices(0, 0) = 1e300;
  CHECK_THROWS_WITH(writeMesh(folder / "a.stl", broken.vertices, broken.faces), Contains("too large"));
  CHECK_THROWS_AS(writeMesh(folder / "missing" / "a.ply", mesh.vertices, mesh.faces), FileError);
  CHECK(std::filesystem::is_empty(folder.path()));
}

TEST_CASE("real meshes read with the counts their READMEs give") {
  struct Case {
    const char* path;
    Eigen::Index vertices, faces;
  };
  for (const auto& [path, vertices, faces] :
       {Case{"goast_shapes_mpl2/cactus/cactus0.ply", 5261, 10518},
        Case{"goast_shapes_mpl2/faces/smile.ply", 7118, 14037}, Case{"posed_body/full/template.ply", 13380, 26756},
        Case{"mesh2motion_cc0/derived_welded_off/horse/horse_Run_05.off", 1709, 3414},
        Case{"cragl_characters_mit/cow.obj", 11666, 23328}}) {
    const auto found = test::realData(path);
    if (!found) continue;
    const auto mesh = readMesh(*found);
    INFO(path);
    CHECK(mesh.vertices.rows() == vertices);
    CHECK(mesh.faces.rows() == faces);
    CHECK_NOTHROW(Topology(static_cast<std::int32_t>(vertices), mesh.faces));
  }
}
