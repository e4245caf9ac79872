#include "core/mesh/prolongation.h"

#include <Eigen/Geometry>
#include <catch2/catch.hpp>
#include <numeric>
#include <thread>

#include "core/io/frames.h"
#include "core/io/mesh_file.h"
#include "core/mesh/alignment.h"
#include "core/mesh/quality.h"
#include "core/numerics/error.h"
#include "tests/support/real_data.h"
#include "tests/support/shapes.h"

using namespace shaped;
using namespace shaped::test;

namespace {

/// A tube with a relief, its coarse mesh, and how the relief bends.
struct Fixture {
  Mesh mesh = tube(40, 20);
  Coarsening coarsening;

  Fixture() {
    for (Eigen::Index v = 0; v < mesh.vertices.rows(); ++v) {
      const double x = mesh.vertices(v, 0), angle = std::atan2(mesh.vertices(v, 2), mesh.vertices(v, 1));
      mesh.vertices.row(v).tail<2>() *= 1 + 0.06 * std::sin(7 * x) * std::cos(3 * angle);
    }
    CoarseningOptions options;
    options.vertex_count = 120;
    coarsening = coarsen(mesh.topology, {mesh.vertices, bent(1.5), bent(-1.5)}, options);
  }

  Vertices bent(double angle) const { return bend(mesh.vertices, angle); }
  Vertices restricted(double angle) const { return restrictTo(coarsening, bent(angle)); }
  double error(const Prolongation& prolongation, double angle) const {
    return meanVertexDistance(prolongation.prolongate(restricted(angle)), bent(angle));
  }
};

}  // namespace

TEST_CASE("the reference and the kept vertices are reproduced") {
  const Fixture f;
  for (const bool learn : {false, true}) {
    const Prolongation prolongation =
        *Prolongation::learn(f.mesh.topology, f.coarsening, f.mesh.vertices,
                             learn ? std::vector{f.bent(0.5), f.bent(1.0)} : std::vector<Vertices>{});
    CHECK(maxVertexDistance(prolongation.prolongate(f.restricted(0)), f.mesh.vertices) < 1e-12);
    const auto coarse = jitter(f.restricted(1.2), 0.02, 3);
    CHECK(maxVertexDistance(restrictTo(f.coarsening, prolongation.prolongate(coarse)), coarse) < 1e-13);
  }
}

TEST_CASE("rigid motions and uniform scaling pass through") {
  const Fixture f;
  const Prolongation prolongation =
      *Prolongation::learn(f.mesh.topology, f.coarsening, f.mesh.vertices, {f.bent(0.8), f.bent(-0.4)});
  const auto coarse = jitter(f.restricted(1.2), 0.02, 3);
  const auto fine = prolongation.prolongate(coarse);
  CHECK(maxVertexDistance(prolongation.prolongate(moveRigidly(coarse, 9)), moveRigidly(fine, 9)) < 1e-12);
  CHECK(maxVertexDistance(prolongation.prolongate(1.7 * coarse), 1.7 * fine) < 1e-12);
  const Vertices far = coarse.rowwise() + Eigen::RowVector3d(1e5, 0, 0);
  CHECK(maxVertexDistance(prolongation.prolongate(far), fine.rowwise() + Eigen::RowVector3d(1e5, 0, 0)) < 1e-9);
}

TEST_CASE("unseen bends keep their relief, and learning from other bends helps") {
  const Fixture f;
  const Prolongation plain = *Prolongation::learn(f.mesh.topology, f.coarsening, f.mesh.vertices, {});
  const Prolongation learned = *Prolongation::learn(f.mesh.topology, f.coarsening, f.mesh.vertices,
                                                    {f.bent(0.4), f.bent(1.2), f.bent(-0.4), f.bent(-1.2)});
  for (const double angle : {0.8, -0.8, 1.5}) {
    CHECK(f.error(plain, angle) < 0.01);
    CHECK(f.error(learned, angle) < 0.7 * f.error(plain, angle));
    const auto fine = learned.prolongate(f.restricted(angle));
    const auto normals = faceNormals(f.mesh.topology->faces(), fine);
    const auto true_normals = faceNormals(f.mesh.topology->faces(), f.bent(angle));
    CHECK((normals.array() * true_normals.array()).rowwise().sum().minCoeff() > 0.9);
  }
}

TEST_CASE("learning works on shapes in any position") {
  const Fixture f;
  const std::vector<Vertices> training{f.bent(0.4), f.bent(1.2)};
  const std::vector<Vertices> moved{moveRigidly(training[0], 5), moveRigidly(training[1], 6)};
  const Prolongation one = *Prolongation::learn(f.mesh.topology, f.coarsening, f.mesh.vertices, training);
  const Prolongation two = *Prolongation::learn(f.mesh.topology, f.coarsening, f.mesh.vertices, moved);
  const auto coarse = f.restricted(0.9);
  CHECK(maxVertexDistance(one.prolongate(coarse), two.prolongate(coarse)) < 1e-9);
}

TEST_CASE("prolongation is continuous, also where a coarse triangle loses its area") {
  const Fixture f;
  const Prolongation prolongation = *Prolongation::learn(f.mesh.topology, f.coarsening, f.mesh.vertices, {f.bent(0.8)});
  const auto& faces = f.coarsening.coarse->faces();
  Vertices coarse = f.restricted(0.5);
  const Eigen::RowVector3d start = coarse.row(faces(40, 0)),
                           through = 0.5 * (coarse.row(faces(40, 1)) + coarse.row(faces(40, 2)));
  const int steps = 2000;
  Vertices last = prolongation.prolongate(coarse);
  double largest_step = 0;
  for (int i = 1; i <= steps; ++i) {  // across the opposite edge and beyond
    coarse.row(faces(40, 0)) = start + 1.5 * i / steps * (through - start);
    const Vertices next = prolongation.prolongate(coarse);
    largest_step = std::max(largest_step, maxVertexDistance(next, last));
    last = next;
  }
  CHECK(largest_step < 20 * 1.5 / steps * (through - start).norm());
}

TEST_CASE("small errors of the coarse shape stay small") {
  const Fixture f;
  const Prolongation prolongation =
      *Prolongation::learn(f.mesh.topology, f.coarsening, f.mesh.vertices, {f.bent(0.4), f.bent(1.2)});
  const auto coarse = f.restricted(0.9);
  const auto noisy = jitter(coarse, 0.002, 8);
  CHECK(meanVertexDistance(prolongation.prolongate(noisy), prolongation.prolongate(coarse)) <
        1.2 * meanVertexDistance(noisy, coarse));
}

TEST_CASE("a prolongation made from stored parts is the same one") {
  const Fixture f;
  const Prolongation one = *Prolongation::learn(f.mesh.topology, f.coarsening, f.mesh.vertices, {f.bent(0.8)});
  const Prolongation two(f.mesh.topology, f.coarsening, f.mesh.vertices, one.detail());
  const auto coarse = f.restricted(-0.9);
  CHECK(one.prolongate(coarse) == two.prolongate(coarse));
  CHECK(one.detail().nonZeros() <= 24 * f.mesh.topology->vertexCount());
  CHECK_THROWS_WITH(Prolongation(f.mesh.topology, f.coarsening, f.mesh.vertices, SparseRows(3, 4)),
                    Catch::Contains("detail: is 3 x 4"));
}

TEST_CASE("prolongation may be called from several threads") {
  const Fixture f;
  const Prolongation prolongation = *Prolongation::learn(f.mesh.topology, f.coarsening, f.mesh.vertices, {f.bent(0.8)});
  const auto coarse = f.restricted(1.1);
  const auto expected = prolongation.prolongate(coarse);
  std::array<Vertices, 4> results;
  std::vector<std::thread> threads;
  for (auto& result : results)
    threads.emplace_back([&] {
      for (int i = 0; i < 20; ++i) result = prolongation.prolongate(coarse);
    });
  for (auto& thread : threads) thread.join();
  for (const auto& result : results) CHECK(result == expected);
}

TEST_CASE("a mesh that was not coarsened passes through") {
  const auto mesh = icosphere(1);
  const auto whole = coarsen(mesh.topology, {mesh.vertices});
  const Prolongation prolongation =
      *Prolongation::learn(mesh.topology, whole, mesh.vertices, {jitter(mesh.vertices, 0.05, 2)});
  const auto shape = jitter(mesh.vertices, 0.1, 1);
  CHECK(maxVertexDistance(prolongation.prolongate(shape), shape) < 1e-15);
}

TEST_CASE("a surface with boundary and one with few coarse vertices are carried over") {
  const auto mesh = grid(12);
  CoarseningOptions options;
  options.vertex_count = 8;
  const auto coarsening = coarsen(mesh.topology, {mesh.vertices}, options);
  const Prolongation prolongation = *Prolongation::learn(mesh.topology, coarsening, mesh.vertices, {});
  const auto flat = prolongation.prolongate(restrictTo(coarsening, mesh.vertices));
  CHECK(maxVertexDistance(flat, mesh.vertices) < 1e-12);
  const Vertices bent = bend(mesh.vertices, 0.5);
  CHECK(meanVertexDistance(prolongation.prolongate(restrictTo(coarsening, bent)), bent) < 0.01);
}

TEST_CASE("prolongation refuses what it cannot use, by name") {
  const Fixture f;
  const auto& topology = f.mesh.topology;
  const auto make = [&](const Coarsening& coarsening, const Vertices& reference,
                        const std::vector<Vertices>& training) {
    return *Prolongation::learn(topology, coarsening, reference, training);
  };
  CHECK_THROWS_WITH(make(f.coarsening, f.mesh.vertices.topRows(9), {}), Catch::Contains("reference: has 9 vertices"));
  CHECK_THROWS_WITH(make(f.coarsening, f.mesh.vertices, {f.mesh.vertices, Vertices(2, 3)}),
                    Catch::Contains("training[1]: has 2 vertices"));
  auto broken = f.coarsening;
  broken.kept.pop_back();
  CHECK_THROWS_WITH(make(broken, f.mesh.vertices, {}), Catch::Contains("coarsening: names another number"));
  broken = f.coarsening;
  std::swap(broken.kept[0], broken.kept[1]);
  CHECK_THROWS_WITH(make(broken, f.mesh.vertices, {}), Catch::Contains("coarsening: kept vertices must ascend"));
  const auto prolongation = make(f.coarsening, f.mesh.vertices, {});
  CHECK_THROWS_WITH(prolongation.prolongate(f.mesh.vertices), Catch::Contains("coarse: has 802 vertices, want 120"));
  Vertices missing = f.restricted(0);
  missing(3, 1) = std::numeric_limits<double>::quiet_NaN();
  CHECK_THROWS_WITH(prolongation.prolongate(missing), Catch::Contains("coarse: has a coordinate"));
}

TEST_CASE("unseen body poses are carried over to better than 1.5 mm", "[data]") {
  const auto folder = realData("posed_body/full");
  if (!folder) return;
  const auto file = readMesh(*folder / "template.ply");
  const auto topology = std::make_shared<Topology>(static_cast<std::int32_t>(file.vertices.rows()), file.faces);
  const FrameReader frames(*folder / "poses_f32.npy");
  std::vector<Vertices> training, unseen;
  for (int frame = 0; frame < 72; frame += 6) training.push_back(frames.frame(frame));
  for (int frame = 3; frame < 72; frame += 12) unseen.push_back(frames.frame(frame));
  const auto coarsening = coarsen(topology, training);
  const Prolongation plain = *Prolongation::learn(topology, coarsening, file.vertices, {});
  const Prolongation learned = *Prolongation::learn(topology, coarsening, file.vertices, training);
  double plain_error = 0, learned_error = 0;
  for (const auto& shape : unseen) {
    const auto coarse = restrictTo(coarsening, shape);
    const auto fine = learned.prolongate(coarse);
    plain_error += meanVertexDistance(plain.prolongate(coarse), shape) / static_cast<double>(unseen.size());
    learned_error += meanVertexDistance(fine, shape) / static_cast<double>(unseen.size());
    CHECK(maxVertexDistance(fine, shape) < 0.02);
    const auto normals = faceNormals(topology->faces(), fine), true_normals = faceNormals(topology->faces(), shape);
    CHECK((normals.array() * true_normals.array()).rowwise().sum().minCoeff() > 0);  // no triangle is turned over
  }
  INFO("mean error plain " << plain_error << " m, learned " << learned_error << " m");
  CHECK(learned_error < 0.0015);
  CHECK(learned_error < 0.5 * plain_error);
}
