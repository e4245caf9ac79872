#include "tests/core/registration/scanned_shapes.h"

#include <Eigen/Geometry>
#include <fstream>
#include <nlohmann/json.hpp>
#include <random>

#include "core/io/mesh_file.h"
#include "core/io/npy.h"
#include "core/registration/surface_samples.h"
#include "tests/support/real_data.h"

namespace shaped::test {
namespace {

/// x, y, z, nx, ny, nz as little-endian floats after an ASCII header.
Scan readPointScan(const std::filesystem::path& path) {
  std::ifstream in(path, std::ios::binary);
  std::string line;
  Eigen::Index count = 0;
  while (std::getline(in, line) && line != "end_header")
    if (line.rfind("element vertex", 0) == 0) count = std::stol(line.substr(15));
  Eigen::Matrix<float, Eigen::Dynamic, 6, Eigen::RowMajor> rows(count, 6);
  in.read(reinterpret_cast<char*>(rows.data()), count * 24);
  return {rows.leftCols<3>().cast<double>(), rows.rightCols<3>().cast<double>(), {}};
}

}  // namespace

Mesh hook() {
  Mesh mesh = tube(48, 24);
  for (Eigen::Index v = 0; v < mesh.vertices.rows(); ++v)
    mesh.vertices.row(v).tail<2>() *= 0.5 + 0.2 * mesh.vertices(v, 0);
  mesh.vertices = bend(mesh.vertices, 1.8);
  for (Eigen::Index v = 0; v < mesh.vertices.rows(); ++v)
    mesh.vertices(v, 2) += 0.12 * mesh.vertices(v, 0) * mesh.vertices(v, 0);
  return mesh;
}

Scan scanPoints(const Mesh& mesh, int count) {
  const auto samples = sampleByArea(mesh.topology->faces(), mesh.vertices, count);
  return {samples.points, samples.normals, {}};
}

Scan scanMesh(const Mesh& mesh) { return {mesh.vertices, {}, mesh.topology->faces()}; }

Scan moved(const Scan& scan, const RigidMotion& motion) {
  return {apply(motion, scan.points), scan.normals * motion.rotation.transpose(), scan.faces};
}

Scan withStrayPoints(Scan scan, int stride, double margin, unsigned seed) {
  std::mt19937 random(seed);
  const Eigen::RowVector3d low = scan.points.colwise().minCoeff(), high = scan.points.colwise().maxCoeff();
  for (Eigen::Index p = 0; p < scan.points.rows(); p += stride)
    for (int axis = 0; axis < 3; ++axis)
      scan.points(p, axis) = std::uniform_real_distribution<double>(low[axis] - margin, high[axis] + margin)(random);
  return scan;
}

RigidMotion randomMotion(unsigned seed) {
  std::mt19937 random(seed);
  std::normal_distribution<double> normal;
  Eigen::Quaterniond turn(normal(random), normal(random), normal(random), normal(random));
  RigidMotion motion;
  motion.rotation = turn.normalized().toRotationMatrix();
  for (int axis = 0; axis < 3; ++axis) motion.translation[axis] = 3 * normal(random);
  return motion;
}

std::optional<Mesh> meanBody() {
  const auto identities = realData("body_identities/rest_f32.npy"), mesh = realData("body_identities/template.ply");
  if (!identities || !mesh || !realData("body_scans/scans.json")) return std::nullopt;
  const auto rest = readNpy(*identities);
  const auto count = rest.shape[0], vertices = rest.shape[1];
  Vertices mean = Vertices::Zero(vertices, 3);
  for (Eigen::Index i = 0; i < count; ++i)
    mean += Eigen::Map<const Vertices>(rest.values.data() + i * vertices * 3, vertices, 3) / double(count);
  return Mesh{std::make_shared<Topology>(std::int32_t(vertices), readMesh(*mesh).faces), mean};
}

BodyScan bodyScan(int number) {
  const std::string name = (number < 10 ? "scan_0" : "scan_") + std::to_string(number);
  std::ifstream in(*realData("body_scans/scans.json"));
  const auto described = nlohmann::json::parse(in)["scans"][std::size_t(number)];
  BodyScan body;
  for (std::size_t r = 0; r < 3; ++r) {
    for (std::size_t c = 0; c < 3; ++c)
      body.pose.rotation(Eigen::Index(r), Eigen::Index(c)) = described["R"][r][c].get<double>();
    body.pose.translation[Eigen::Index(r)] = described["t"][r].get<double>();
  }
  body.scan = readPointScan(*realData("body_scans/" + name + ".ply"));
  body.truth = apply(body.pose, readMesh(*realData("body_scans/gt/" + name + "_gt.ply")).vertices);
  return body;
}

}  // namespace shaped::test
