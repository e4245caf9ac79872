#include "server/rpc/estimate_under_clothing.h"

#include <catch2/catch.hpp>
#include <functional>
#include <future>
#include <thread>

#include "core/clothing/under_clothing.h"
#include "core/io/model_directory.h"
#include "core/mesh/quality.h"
#include "core/model/body_shapes.h"
#include "core/model/shell_pga_shapes.h"
#include "core/sample/virtual_scanner.h"
#include "server/convert/mesh.h"
#include "server/convert/scan.h"
#include "shaped/v1/models.grpc.pb.h"
#include "shaped/v1/shapes.grpc.pb.h"
#include "tests/support/bodies.h"
#include "tests/support/daemon.h"
#include "tests/support/models.h"

using namespace shaped;
using namespace std::chrono_literals;
using Catch::Contains;

namespace {

using Clock = std::chrono::steady_clock;
using Request = v1::EstimateUnderClothingRequest;
using Response = v1::EstimateUnderClothingResponse;

/// "tubes" of kind body and "bent" of kind shell_pga, as other processes publish them.
void publishModels(const std::filesystem::path& store) {
  const ModelDirectory directory(store / "models");
  BodyTrainingRecord training;
  training.registrations = 12;
  training.variances = Eigen::Vector3d(3, 2, 1);
  BodyShapes(test::tubeModel(3, 12, 3), training).publish(directory, "tubes", {});
  ShellPgaShapes(test::tubeModel()).publish(directory, "bent", {});
}

/// One daemon for all tests of the file, with models.
const test::TestDaemon& daemonWithModels(double longest_call = 600) {
  static std::map<double, std::unique_ptr<test::TestDaemon>> daemons;
  auto& daemon = daemons[longest_call];
  if (daemon) return *daemon;
  server::DaemonOptions options;
  options.threads = 1;
  options.longest_call = longest_call;
  options.limits.clothing_frames = 40;
  options.limits.clothing_bytes = 4 << 20;
  daemon = std::make_unique<test::TestDaemon>(options);
  publishModels(daemon->folder / "store");
  for (const char* name : {"tubes", "bent"}) {
    grpc::ClientContext context;
    v1::LoadModelRequest request;
    request.mutable_model()->set_name(name);
    v1::LoadModelResponse response;
    REQUIRE(v1::Models::NewStub(daemon->channel())->Load(&context, request, &response).ok());
  }
  return *daemon;
}

Request setup(const std::string& model, const std::function<void(v1::UnderClothingOptions&)>& change = {}) {
  Request message;
  message.mutable_setup()->mutable_model()->set_name(model);
  if (change) change(*message.mutable_setup()->mutable_options());
  return message;
}

/// A scan of a tube in a pose of its own, in cloth, `unit` times as large as in metres.
Request frame(std::uint32_t number, double unit = 1, int points = 1500) {
  static const BodyModel model = test::tubeModel(3, 12, 3);
  const auto& faces = model.topology()->faces();
  const Vertices body =
      model.posed({0.6 * test::randomIdentity(model, 3), test::randomPose(model.skeleton(), 0.2, number)}).vertices();
  VirtualScannerOptions scanner;
  scanner.ring_radius = 8;
  scanner.above = scanner.below = 4;
  scanner.points = points;
  scanner.motion = RigidMotion{};
  const Scan scan = scanVirtually(body + 0.03 * vertexNormals(faces, body), faces, scanner).scan;
  Request message;
  message.mutable_frame()->set_frame(number);
  server::toProto(unit * scan.points, *message.mutable_frame()->mutable_scan()->mutable_positions());
  server::toProto(scan.normals, *message.mutable_frame()->mutable_scan()->mutable_normals());
  return message;
}

Request faulty(const std::function<void(Request::Frame&)>& spoil) {
  auto message = frame(1);
  spoil(*message.mutable_frame());
  return message;
}

struct Conversation {
  std::vector<Response> answers;
  grpc::Status status;
};

Conversation say(const test::TestDaemon& daemon, const std::vector<Request>& messages, grpc::ClientContext& context) {
  const auto stub = v1::Registration::NewStub(daemon.channel());
  const auto stream = stub->EstimateUnderClothing(&context);
  for (const auto& message : messages)
    if (!stream->Write(message)) break;
  stream->WritesDone();
  Conversation heard;
  for (Response response; stream->Read(&response);) heard.answers.push_back(response);
  heard.status = stream->Finish();
  return heard;
}

Conversation say(const std::vector<Request>& messages) {
  grpc::ClientContext context;
  return say(daemonWithModels(), messages, context);
}

void refused(const std::vector<Request>& messages, const std::string& text,
             grpc::StatusCode code = grpc::INVALID_ARGUMENT) {
  const auto heard = say(messages);
  CHECK(heard.status.error_code() == code);
  CHECK_THAT(heard.status.error_message(), Contains(text));
  CHECK(heard.answers.empty());
}

/// What takes longer than any test waits.
std::vector<Request> endless() {
  std::vector<Request> messages{setup("tubes")};
  for (std::uint32_t i = 0; i < 40; ++i) messages.push_back(frame(i));
  return messages;
}

/// The worker for long work, of which there is one, takes up the next call long before the last would be done, on a
/// busy machine too.
void requireFreeWorker() {
  const auto begin = Clock::now();
  refused({setup("nobody")}, "nobody", grpc::NOT_FOUND);
  CHECK(Clock::now() - begin < 20s);
}

v1::Shape synthesized(const v1::Coefficients& coefficients) {
  grpc::ClientContext context;
  v1::SynthesizeRequest request;
  request.mutable_model()->set_name("tubes");
  *request.mutable_coefficients() = coefficients;
  v1::SynthesizeResponse response;
  REQUIRE(v1::Shapes::NewStub(daemonWithModels().channel())->Synthesize(&context, request, &response).ok());
  return response.shape();
}

double apart(const v1::Shape& one, const v1::Shape& other) {
  REQUIRE(one.positions_size() == other.positions_size());
  double most = 0;
  for (int i = 0; i < one.positions_size(); ++i)
    most = std::max(most, double(std::abs(one.positions(i) - other.positions(i))));
  return most;
}

}  // namespace

TEST_CASE("a motion under clothing is answered with the body and then its frames, as the core estimates them") {
  const std::vector<Request> messages{setup("tubes"), frame(7), frame(5), frame(9)};
  const auto heard = say(messages);
  REQUIRE(heard.status.ok());
  REQUIRE(heard.answers.size() == 4);
  REQUIRE(heard.answers[0].has_body());
  const auto& body = heard.answers[0].body();
  CHECK((body.model().name() == "tubes" && body.model().version() == 1));
  CHECK(body.report().seconds() > 0);
  CHECK(apart(body.rest(), synthesized(body.coefficients())) < 1e-6);

  const BodyModel model = test::tubeModel(3, 12, 3);
  std::vector<Scan> scans;
  for (std::size_t i = 1; i < messages.size(); ++i)
    scans.push_back(server::scanFromProto(messages[i].frame().scan(), {}));
  const auto wanted = estimateUnderClothing(scans, model, {});
  CHECK(body.report().iterations() == wanted.iterations);
  for (std::size_t i = 0; i < 3; ++i) {
    REQUIRE(heard.answers[i + 1].has_frame());
    const auto& answer = heard.answers[i + 1].frame();
    const auto& found = wanted.solution.frames[i];
    CHECK(answer.frame() == messages[i + 1].frame().frame());
    CHECK(answer.mean_gap() == Approx(found.mean_gap));
    CHECK(answer.inside() == Approx(found.inside));
    CHECK(answer.inside_strictly() == Approx(found.inside_strictly));
    CHECK(answer.seen() == Approx(found.seen));
    CHECK(answer.explained() == Approx(found.explained));
    CHECK(answer.trusted() == found.trusted);
    CHECK(answer.warnings_size() == (found.trusted ? 0 : 1));
    CHECK((answer.smallest_area_ratio() > 0 && answer.smallest_area_ratio() <= 1));
    v1::Shape shape;
    server::toProto(model.posed({wanted.solution.identity, found.pose}).vertices(), *model.topology(), shape);
    CHECK(apart(answer.shape(), shape) < 1e-5);
    CHECK(apart(answer.shape(), synthesized(answer.coefficients())) < 1e-6);
  }
}

TEST_CASE("scans and landmarks under clothing come in their own unit, and shapes may be left out") {
  std::vector<Request> metres{setup("tubes"), frame(1), frame(2)}, millimetres{setup("tubes",
                                                                                     [](auto&options) {
                                                                                       options.set_unit_factor(0.001);
                                                                                       options.set_without_shapes(true);
                                                                                     }),
                                                                               frame(1, 1000), frame(2, 1000)};
  // Landmarks on one frame alone, which lie on the mean's own vertices at rest: any place does.
  for (auto* messages : {&metres, &millimetres})
    for (const std::uint32_t vertex : {3U, 40U, 77U, 110U}) {
      auto& landmark = *(*messages)[2].mutable_frame()->add_landmarks();
      landmark.set_vertex(vertex);
      const double unit = messages == &metres ? 1 : 1000;
      for (int axis = 0; axis < 3; ++axis)
        landmark.add_position(unit * test::tubeTemplate(3).rest(Eigen::Index(vertex), axis));
    }
  const auto one = say(metres), other = say(millimetres);
  REQUIRE((one.status.ok() && other.status.ok()));
  REQUIRE((one.answers.size() == 3 && other.answers.size() == 3));
  CHECK((one.answers[0].body().has_rest() && one.answers[1].frame().has_shape()));
  CHECK(!(other.answers[0].body().has_rest() || other.answers[1].frame().has_shape()));
  CHECK(one.answers[2].frame().mean_gap() == Approx(other.answers[2].frame().mean_gap()).margin(1e-4));
  // Landmarks count: without them the frame ends elsewhere.
  auto without = metres;
  without[2].mutable_frame()->clear_landmarks();
  CHECK(apart(say(without).answers[2].frame().shape(), one.answers[2].frame().shape()) > 1e-3);
  REQUIRE(one.answers[0].body().warnings_size() == 1);
  CHECK_THAT(one.answers[0].body().warnings(0), Contains("fewer than three scans"));
}

TEST_CASE("a wrong unit of scans under clothing is suspected") {
  const auto heard = say({setup("tubes"), frame(1, 1000)});
  REQUIRE((heard.status.ok() && heard.answers.size() == 2));
  const auto& warnings = heard.answers[1].frame().warnings();
  CHECK(std::any_of(warnings.begin(), warnings.end(),
                    [](const auto& warning) { return warning.find("its unit may be another") != std::string::npos; }));
}

TEST_CASE("faulty streams of scans under clothing are refused by what is wrong with them") {
  refused({}, "setup: is missing: the stream was empty");
  refused({frame(1)}, "setup: is missing: the first message must be it");
  refused({setup("tubes"), setup("tubes")}, "setup: came a second time");
  refused({setup("tubes"), Request()}, "part: is neither setup nor frame");
  refused({setup("tubes")}, "frames: are missing");
  refused({setup("nobody")}, "nobody", grpc::NOT_FOUND);
  refused({setup("bent")},
          "is of kind \"shell_pga\", and Registration.EstimateUnderClothing needs one of kind \"body\"",
          grpc::FAILED_PRECONDITION);
  refused({setup("tubes", [](auto& options) { options.set_unit_factor(-1); })}, "options: unit_factor = -1");
  refused({setup("tubes", [](auto& options) { options.set_scan_noise(-1); })}, "options: scan_noise = -1");
  refused({setup("tubes", [](auto& options) { options.set_thickest(0); })}, "options: thickest = 0");
}

TEST_CASE("faulty scans under clothing are refused with their place in the motion") {
  const auto second = [](const std::function<void(Request::Frame&)>& spoil, const std::string& text) {
    refused({setup("tubes"), frame(1), faulty(spoil)}, text);
  };
  second([](auto& frame) { frame.clear_scan(); }, "frames[1].scan: has no points");
  second(
      [](auto& frame) {
        frame.mutable_scan()->mutable_positions()->Truncate(150);
        frame.mutable_scan()->clear_normals();
      },
      "frames[1].scan: has 50 points, want at least 100");
  second([](auto& frame) { frame.mutable_scan()->set_positions(5, NAN); },
         "frames[1].scan.points[1]: has a coordinate");
  second([](auto& frame) { frame.mutable_scan()->mutable_normals()->Truncate(3); }, "frames[1].scan.normals: has 3");
  second([](auto& frame) { frame.add_landmarks()->set_vertex(1 << 20); }, "frames[1].landmarks[0].vertex: = 1048576");
  second([](auto& frame) { frame.add_landmarks()->add_position(1); }, "frames[1].landmarks[0].place: is missing");
}

TEST_CASE("scans under clothing are bounded in number and size") {
  auto many = endless();
  many.push_back(frame(40));
  refused(many, "frames[40]: is one more than the 40 scans that the server estimates together");
  // 50,000 points with normals are 2.3 MiB.
  refused({setup("tubes"), frame(1, 1, 50000), frame(2, 1, 50000)}, "frames[1]: makes the scans take 5 MiB");
}

TEST_CASE("cancellation and deadline stop an estimate under clothing and free its worker") {
  const auto messages = endless();
  {
    grpc::ClientContext context;
    context.set_deadline(std::chrono::system_clock::now() + 2s);
    CHECK(say(daemonWithModels(), messages, context).status.error_code() == grpc::DEADLINE_EXCEEDED);
    requireFreeWorker();
  }
  grpc::ClientContext context;
  auto running = std::async(std::launch::async, [&] { return say(daemonWithModels(), messages, context); });
  std::this_thread::sleep_for(2s);
  context.TryCancel();
  CHECK(running.get().status.error_code() == grpc::CANCELLED);
  requireFreeWorker();
}

TEST_CASE("a client who falls silent between scans is given up, however long the estimate may take") {
  const auto& daemon = daemonWithModels(0.3);
  grpc::ClientContext context;
  const auto stub = v1::Registration::NewStub(daemon.channel());
  const auto stream = stub->EstimateUnderClothing(&context);
  REQUIRE(stream->Write(setup("tubes")));
  const auto begin = Clock::now();
  Response response;
  CHECK_FALSE(stream->Read(&response));
  CHECK(stream->Finish().error_code() == grpc::DEADLINE_EXCEEDED);
  CHECK(Clock::now() - begin > 200ms);
  CHECK(Clock::now() - begin < 10s);
  // Work may take longer than a silence.
  grpc::ClientContext another;
  const auto heard = say(daemon, {setup("tubes"), frame(7), frame(5), frame(9)}, another);
  CHECK(heard.status.ok());
  REQUIRE(!heard.answers.empty());
  CHECK(heard.answers[0].body().report().seconds() > 0.3);
}
