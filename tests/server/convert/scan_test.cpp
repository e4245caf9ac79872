#include "server/convert/scan.h"

#include <catch2/catch.hpp>

#include "core/mesh/anchor.h"
#include "server/convert/model.h"
#include "tests/support/shapes.h"

using namespace shaped;
using namespace shaped::server;
using Catch::Contains;

namespace {

template <class List>
void append(List& list, std::initializer_list<float> numbers) {
  for (const float number : numbers) list.Add(number);
}

v1::Scan twoTriangles() {
  v1::Scan scan;
  append(*scan.mutable_positions(), {0, 0, 0, 1, 0, 0, 1, 1, 0, 0, 1, 0});
  for (const std::uint32_t corner : {0, 1, 2, 0, 2, 3}) scan.add_faces(corner);
  return scan;
}

google::protobuf::RepeatedPtrField<v1::ScanLandmark> one(const std::function<void(v1::ScanLandmark&)>& fill) {
  google::protobuf::RepeatedPtrField<v1::ScanLandmark> landmarks;
  auto& landmark = *landmarks.Add();
  for (const double x : {1.0, 2.0, 3.0}) landmark.add_position(x);
  fill(landmark);
  return landmarks;
}

}  // namespace

TEST_CASE("a scan comes in with points, normals and faces as they were sent") {
  auto message = twoTriangles();
  auto scan = scanFromProto(message, {});
  CHECK(scan.points.rows() == 4);
  CHECK(scan.points.row(2) == Eigen::RowVector3d(1, 1, 0));
  CHECK(scan.faces.row(1) == Eigen::RowVector3i(0, 2, 3));
  CHECK(scan.normals.rows() == 0);
  message.clear_faces();
  append(*message.mutable_normals(), {0, 0, 1, 0, 0, 1, 0, 0, 1, 0, 0, 1});
  scan = scanFromProto(message, {});
  CHECK(scan.faces.rows() == 0);
  CHECK(scan.normals.row(3) == Eigen::RowVector3d(0, 0, 1));
}

TEST_CASE("scans that do not fit together are refused by their field") {
  const auto refused = [](const v1::Scan& message, const std::string& text, const Limits& limits = {}) {
    CHECK_THROWS_WITH(scanFromProto(message, limits), Contains(text));
  };
  auto message = twoTriangles();
  message.add_positions(0);
  refused(message, "scan.positions: has 13 numbers, want 12");
  message = twoTriangles();
  message.add_normals(1);
  refused(message, "scan.normals: has 1 numbers, want 12");
  message = twoTriangles();
  message.set_faces(4, 9);
  refused(message, "scan.faces[1]: vertex index 9 is outside [0, 4)");
  Limits limits;
  limits.vertices = 3;
  refused(twoTriangles(), "scan.positions", limits);
  limits = {};
  limits.faces = 1;
  refused(twoTriangles(), "scan.faces", limits);
}

TEST_CASE("landmarks lie where they were put, in metres") {
  const auto ball = test::icosphere(1);
  const auto& faces = ball.topology->faces();
  for (const std::uint32_t vertex : {0U, 17U, 41U}) {
    const auto landmarks =
        landmarksFromProto(one([&](auto& landmark) { landmark.set_vertex(vertex); }), *ball.topology, 0.01, {});
    REQUIRE(landmarks.size() == 1);
    CHECK(position(landmarks[0].anchor, faces, ball.vertices) == ball.vertices.row(vertex).transpose());
    CHECK((landmarks[0].position - Eigen::Vector3d(0.01, 0.02, 0.03)).norm() < 1e-15);
    CHECK(landmarks[0].weight == 1);
  }
  const auto point = landmarksFromProto(one([](auto& landmark) {
                                          landmark.mutable_point()->set_face(5);
                                          for (const double weight : {0.2, 0.3, 0.5})
                                            landmark.mutable_point()->add_barycentric(weight);
                                          landmark.set_weight(4);
                                        }),
                                        *ball.topology, 1, {});
  const Eigen::Vector3d expected = 0.2 * ball.vertices.row(faces(5, 0)) + 0.3 * ball.vertices.row(faces(5, 1)) +
                                   0.5 * ball.vertices.row(faces(5, 2));
  CHECK((position(point[0].anchor, faces, ball.vertices) - expected).norm() < 1e-12);
  CHECK(point[0].weight == 4);
}

TEST_CASE("landmarks that are nowhere on the model are refused by index and field") {
  const auto ball = test::icosphere(1);
  const auto refused = [&](const std::function<void(v1::ScanLandmark&)>& fill, const std::string& text) {
    CHECK_THROWS_WITH(landmarksFromProto(one(fill), *ball.topology, 1, {}), Contains(text));
  };
  refused([](auto&) {}, "landmarks[0].place: is missing: name a vertex or a point of a face");
  refused([](auto& landmark) { landmark.set_vertex(42); }, "landmarks[0].vertex: = 42 is outside [0, 42)");
  refused([](auto& landmark) { landmark.mutable_point()->set_face(1000); },
          "landmarks[0].point.face: = 1000 is outside [0, 80)");
  refused([](auto& landmark) { landmark.mutable_point()->add_barycentric(1); },
          "landmarks[0].point.barycentric: has 1 numbers, want three");
  refused(
      [](auto& landmark) {
        for (const double weight : {0.5, 0.6, -0.1}) landmark.mutable_point()->add_barycentric(weight);
      },
      "landmarks[0].point.barycentric: want three weights >= 0 with sum 1");
  refused(
      [](auto& landmark) {
        landmark.set_vertex(1);
        landmark.set_position(1, std::numeric_limits<double>::infinity());
      },
      "landmarks[0].position: has a number that is not finite");
  refused(
      [](auto& landmark) {
        landmark.set_vertex(1);
        landmark.set_weight(-1);
      },
      "landmarks[0].weight: = -1.000000, want >= 0");
}

TEST_CASE("options of a registration are those that were sent, and checked") {
  v1::RegistrationOptions message;
  auto options = registrationOptionsFromProto(message, {});
  CHECK(options.unit_factor == 1);
  CHECK_FALSE(options.refine);
  message.set_unit_factor(0.001);
  message.set_refine(true);
  message.set_landmark_weight(0);
  options = registrationOptionsFromProto(message, {});
  CHECK(options.unit_factor == 0.001);
  CHECK(options.refine);
  CHECK(options.fit.landmark_weight == 0);
  message.set_unit_factor(-1);
  CHECK_THROWS_WITH(registrationOptionsFromProto(message, {}), Contains("options: unit_factor = -1"));
}

TEST_CASE("coefficients of a body travel as one vector, and not beside those of another kind") {
  v1::Coefficients message;
  for (const double number : {0.5, -1.0, 0.25}) message.add_body(number);
  const auto point = coefficientsFromProto(message, {});
  REQUIRE(std::holds_alternative<BodyCoefficients>(point));
  CHECK(std::get<BodyCoefficients>(point).numbers == Eigen::Vector3d(0.5, -1, 0.25));
  v1::Coefficients back;
  toProto(point, back);
  CHECK(back.SerializeAsString() == message.SerializeAsString());
  message.add_alpha(1);
  CHECK_THROWS_WITH(coefficientsFromProto(message, {}),
                    "coefficients: has both alpha and body, want those of the model's kind alone");
  Limits limits;
  limits.coefficients = 2;
  message.clear_alpha();
  CHECK_THROWS_WITH(coefficientsFromProto(message, limits), Contains("coefficients.body"));
  CHECK(postureFromProto(v1::POSTURE_NORMALISATION_UNSPECIFIED, "posture") == PostureNormalisation::kSkeleton);
  CHECK_THROWS_WITH(postureFromProto(static_cast<v1::PostureNormalisation>(9), "body.posture"),
                    "body.posture: 9 is no PostureNormalisation");
}
