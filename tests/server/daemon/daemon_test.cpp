#include "server/daemon/daemon.h"

#include <catch2/catch.hpp>
#include <future>
#include <thread>

#include "server/convert/mesh.h"
#include "tests/support/daemon.h"
#include "tests/support/shapes.h"

using namespace shaped;
using namespace std::chrono_literals;
using Catch::Contains;

namespace {

using Clock = std::chrono::steady_clock;

const auto sphere = test::icosphere(1);

v1::UploadDatasetRequest header(const std::string& name, std::uint32_t frames) {
  v1::UploadDatasetRequest message;
  auto& header = *message.mutable_header();
  header.set_name(name);
  header.set_vertex_count(42);
  v1::Mesh mesh;
  server::toProto(sphere.vertices, *sphere.topology, mesh);
  *header.mutable_faces() = mesh.faces();
  header.set_frames(frames);
  return message;
}

v1::UploadDatasetRequest frame(const Vertices& shape) {
  v1::UploadDatasetRequest message;
  server::toProto(shape, *message.mutable_frame()->mutable_positions());
  return message;
}

v1::UploadDatasetRequest scanHeader(std::uint32_t scans) {
  v1::UploadDatasetRequest message;
  message.mutable_header()->set_name("people");
  message.mutable_header()->set_kind(v1::DATASET_KIND_SCANS);
  message.mutable_header()->set_frames(scans);
  return message;
}

v1::UploadDatasetRequest scan(const Vertices& points, const std::string& name) {
  v1::UploadDatasetRequest message;
  server::toProto(points, *message.mutable_scan()->mutable_scan()->mutable_positions());
  message.mutable_scan()->set_name(name);
  return message;
}

grpc::Status upload(const test::TestDaemon& daemon, const std::vector<v1::UploadDatasetRequest>& messages) {
  const auto stub = v1::Datasets::NewStub(daemon.channel());
  grpc::ClientContext context;
  v1::UploadDatasetResponse response;
  const auto writer = stub->Upload(&context, &response);
  for (const auto& message : messages)
    if (!writer->Write(message)) break;
  writer->WritesDone();
  return writer->Finish();
}

v1::ListDatasetsResponse datasets(const test::TestDaemon& daemon) {
  grpc::ClientContext context;
  v1::ListDatasetsResponse response;
  const auto status = v1::Datasets::NewStub(daemon.channel())->List(&context, {}, &response);
  REQUIRE(status.ok());
  return response;
}

/// A path between two tubes; with many times it takes minutes.
v1::InterpolateRequest pathRequest(int sides, int times) {
  const auto tube = test::tube(4 * sides, sides);
  v1::InterpolateRequest request;
  server::toProto(tube.vertices, *tube.topology, *request.mutable_from());
  server::toProto(test::bend(tube.vertices, 1), *tube.topology, *request.mutable_to());
  for (int i = 0; i < times; ++i) request.add_times((i + 0.5) / times);
  return request;
}

/// Reads a path to its end; the summary is empty when there was none.
struct PathAnswer {
  v1::InterpolateResponse::Summary summary;
  std::vector<v1::InterpolateResponse::Frame> frames;
  grpc::Status status;
  std::string pushback;
};

PathAnswer interpolate(const test::TestDaemon& daemon, const v1::InterpolateRequest& request,
                       grpc::ClientContext& context) {
  PathAnswer answer;
  const auto stub = v1::Shapes::NewStub(daemon.channel());
  const auto reader = stub->Interpolate(&context, request);
  v1::InterpolateResponse response;
  while (reader->Read(&response)) {
    if (response.has_summary()) answer.summary = response.summary();
    if (response.has_frame()) answer.frames.push_back(response.frame());
  }
  answer.status = reader->Finish();
  const auto& metadata = context.GetServerTrailingMetadata();
  if (const auto found = metadata.find("grpc-retry-pushback-ms"); found != metadata.end())
    answer.pushback = std::string(found->second.data(), found->second.size());
  return answer;
}

server::DaemonOptions oneThread() {
  server::DaemonOptions options;
  options.threads = 1;
  return options;
}

}  // namespace

TEST_CASE("a dataset travels to the daemon and back out of it") {
  const test::TestDaemon daemon;
  REQUIRE(upload(daemon, {header("spheres", 2), frame(sphere.vertices), frame(2 * sphere.vertices)}).ok());
  const auto listed = datasets(daemon);
  REQUIRE(listed.datasets_size() == 1);
  CHECK(listed.datasets(0).name() == "spheres");
  CHECK(listed.datasets(0).frames() == 2);
  CHECK(listed.datasets(0).topology_id() == sphere.topology->id());
  const auto stub = v1::Datasets::NewStub(daemon.channel());
  v1::DeleteDatasetRequest request;
  request.set_name("spheres");
  v1::DeleteDatasetResponse response;
  grpc::ClientContext first, second;
  CHECK(stub->Delete(&first, request, &response).ok());
  CHECK(stub->Delete(&second, request, &response).error_code() == grpc::NOT_FOUND);
}

TEST_CASE("raw scans travel to the daemon, and faulty ones are refused by name") {
  const test::TestDaemon daemon;
  const auto dense = test::icosphere(2);
  const auto refused = [&](const std::vector<v1::UploadDatasetRequest>& messages, const std::string& text) {
    const auto status = upload(daemon, messages);
    CHECK(status.error_code() == grpc::INVALID_ARGUMENT);
    CHECK_THAT(status.error_message(), Contains(text));
  };
  refused({scanHeader(1), scan(sphere.vertices, "small.ply")},
          "scans[0] (small.ply): has 42 points, want at least 100");
  refused({scanHeader(1), scan(Vertices(0, 3), "")}, "scans[0]: has no points");
  auto broken = dense.vertices;
  broken(7, 1) = std::nan("");
  refused({scanHeader(1), scan(broken, "nan.ply")}, "scans[0] (nan.ply).points[7]: has a coordinate");
  refused({scanHeader(2), scan(dense.vertices, "")}, "scans: the header announced 2, 1 came");
  refused({scanHeader(1), frame(sphere.vertices)}, "part: is a frame, and the header announced raw scans");
  refused({header("spheres", 1), scan(dense.vertices, "")}, "part: is a raw scan, and the header announced shapes");
  auto mixed = header("people", 1);
  mixed.mutable_header()->set_kind(v1::DATASET_KIND_SCANS);
  refused({mixed}, "header: has vertices, faces or a template");
  CHECK(datasets(daemon).datasets_size() == 0);
  REQUIRE(upload(daemon, {scanHeader(1), scan(dense.vertices, "one.ply")}).ok());
  REQUIRE(datasets(daemon).datasets_size() == 1);
  CHECK(datasets(daemon).datasets(0).kind() == v1::DATASET_KIND_SCANS);
  CHECK(datasets(daemon).datasets(0).frames() == 1);
  CHECK(datasets(daemon).datasets(0).vertex_count() == 0);
}

TEST_CASE("a bootstrap is refused by what is wrong with it, before there is a job") {
  server::DaemonOptions options;
  options.trainer = "/no/such/shaped-trainer";
  const test::TestDaemon daemon(options);
  REQUIRE(upload(daemon, {scanHeader(1), scan(test::icosphere(2).vertices, "one.ply")}).ok());
  REQUIRE(upload(daemon, {header("two", 2), frame(sphere.vertices), frame(2 * sphere.vertices)}).ok());
  REQUIRE(upload(daemon, {header("four", 4), frame(sphere.vertices), frame(2 * sphere.vertices),
                          frame(3 * sphere.vertices), frame(4 * sphere.vertices)})
              .ok());
  const auto stub = v1::Jobs::NewStub(daemon.channel());
  const auto refused = [&](grpc::StatusCode code, const std::string& text,
                           const std::function<void(v1::TrainRequest&, v1::Bootstrap&)>& change) {
    v1::TrainRequest request;
    request.set_model_name("grown");
    request.set_dataset("four");
    request.mutable_bootstrap()->set_scans("people");
    change(request, *request.mutable_bootstrap());
    grpc::ClientContext context;
    v1::TrainResponse response;
    const auto status = stub->Train(&context, request, &response);
    CHECK(status.error_code() == code);
    CHECK_THAT(status.error_message(), Contains(text));
  };
  const auto bad = grpc::INVALID_ARGUMENT;
  refused(bad, "bootstrap.scans: is missing", [](auto&, auto& bootstrap) { bootstrap.clear_scans(); });
  refused(bad, "bootstrap.scans: \"two\" holds shapes of one connectivity, want raw scans",
          [](auto&, auto& bootstrap) { bootstrap.set_scans("two"); });
  refused(bad, "bootstrap.field_scans: \"people\" holds 1 scans, want one for each of the 2 registrations",
          [](auto&, auto& bootstrap) { bootstrap.set_field_scans("people"); });
  refused(bad, "dataset: \"people\" holds raw scans, want shapes",
          [](auto& request, auto&) { request.set_dataset("people"); });
  refused(bad, "dataset: \"two\" holds 2 registrations; a bootstrap needs at least three",
          [](auto& request, auto&) { request.set_dataset("two"); });
  refused(bad, "bootstrap: rounds = 0, want >= 1", [](auto&, auto& bootstrap) { bootstrap.set_rounds(0); });
  refused(bad, "bootstrap.field: learning_rate = -1",
          [](auto&, auto& bootstrap) { bootstrap.mutable_field()->set_learning_rate(-1); });
  refused(bad, "bootstrap.rig", [](auto&, auto& bootstrap) { bootstrap.set_rig("{}"); });
  refused(bad, "bootstrap.rig: goes without template_model", [](auto&, auto& bootstrap) {
    bootstrap.set_rig("{}");
    bootstrap.mutable_template_model()->set_name("grown");
  });
  refused(grpc::NOT_FOUND, "grown",
          [](auto&, auto& bootstrap) { bootstrap.mutable_template_model()->set_name("grown"); });
  refused(grpc::NOT_FOUND, "there is no dataset \"nobody\"",
          [](auto&, auto& bootstrap) { bootstrap.set_scans("nobody"); });
  refused(grpc::FAILED_PRECONDITION, "there is no program /no/such/shaped-trainer", [](auto&, auto&) {});
  grpc::ClientContext context;
  v1::ListJobsResponse jobs;
  REQUIRE(stub->List(&context, {}, &jobs).ok());
  CHECK(jobs.jobs_size() == 0);
}

TEST_CASE("faulty uploads are refused by frame and leave nothing") {
  const test::TestDaemon daemon;
  const auto refused = [&](const std::vector<v1::UploadDatasetRequest>& messages, const std::string& text) {
    const auto status = upload(daemon, messages);
    CHECK(status.error_code() == grpc::INVALID_ARGUMENT);
    CHECK_THAT(status.error_message(), Contains(text));
  };
  auto nan = frame(sphere.vertices);
  nan.mutable_frame()->set_positions(10, std::numeric_limits<float>::quiet_NaN());
  nan.mutable_frame()->set_label("b.ply");
  refused({header("d", 2), frame(sphere.vertices), nan}, "frames[1] (b.ply): vertex 3");
  refused({header("d", 1), frame(sphere.vertices.topRows(40))}, "frames[0]: has 120 coordinates, want 126");
  refused({header("d", 2), frame(sphere.vertices)}, "announced 2, 1 came");
  refused({frame(sphere.vertices)}, "header: is missing");
  refused({header("d", 1), header("d", 1)}, "header: came a second time");
  refused({}, "header: is missing");
  refused({header("d/e", 1)}, "name: want");
  auto bad_index = header("d", 1);
  bad_index.mutable_header()->set_faces(0, 42);
  refused({bad_index}, "header.faces[0]: vertex index 42");
  CHECK(datasets(daemon).datasets_size() == 0);
}

TEST_CASE("an upload that is broken off leaves nothing") {
  const test::TestDaemon daemon;
  const auto folder = daemon.folder / "store/datasets";
  const auto becomesEmpty = [&](bool empty) {
    const auto until = Clock::now() + 10s;
    while (std::filesystem::is_empty(folder) != empty) {
      if (Clock::now() > until) return false;
      std::this_thread::sleep_for(5ms);
    }
    return true;
  };
  {
    const auto stub = v1::Datasets::NewStub(daemon.channel());
    grpc::ClientContext context;
    v1::UploadDatasetResponse response;
    const auto writer = stub->Upload(&context, &response);
    writer->Write(header("d", 1));
    writer->Write(frame(sphere.vertices));
    REQUIRE(becomesEmpty(false));  // else the daemon might begin it after it was found empty
    context.TryCancel();
    CHECK(writer->Finish().error_code() == grpc::CANCELLED);
  }
  CHECK(becomesEmpty(true));
  CHECK(std::filesystem::is_empty(folder));
}

TEST_CASE("interpolation reports the path and sends a frame for each time") {
  const test::TestDaemon daemon;
  grpc::ClientContext context;
  auto request = pathRequest(6, 0);
  for (const double time : {0.0, 0.5, 1.0, 1.25}) request.add_times(time);
  const auto answer = interpolate(daemon, request, context);
  REQUIRE(answer.status.ok());
  CHECK(answer.summary.report().termination() == v1::TERMINATION_CONVERGED);
  REQUIRE(answer.summary.segment_energies_size() == 4);
  double sum = 0;
  for (const double energy : answer.summary.segment_energies()) sum += energy;
  CHECK(answer.summary.path_energy() == Approx(4 * sum));
  CHECK(answer.summary.smallest_area_ratio() > 0.1);
  REQUIRE(answer.frames.size() == 4);
  for (int i = 0; i < 3; i += 2) {
    const auto& ends = i == 0 ? request.from().positions() : request.to().positions();
    for (int k = 0; k < ends.size(); ++k)
      REQUIRE(answer.frames[i].shape().positions(k) == Approx(ends[k]).margin(1e-6));
  }
}

TEST_CASE("faulty paths are refused by field") {
  const test::TestDaemon daemon;
  const auto refused = [&](const v1::InterpolateRequest& request, const std::string& text) {
    grpc::ClientContext context;
    const auto answer = interpolate(daemon, request, context);
    CHECK(answer.status.error_code() == grpc::INVALID_ARGUMENT);
    CHECK_THAT(answer.status.error_message(), Contains(text));
  };
  const auto good = pathRequest(6, 1);
  auto request = good;
  request.set_path_steps(5000);
  refused(request, "path_steps: has 5000 steps");
  request = good;
  request.set_times(0, 11);
  refused(request, "times[0]: = 11");
  request = good;
  request.set_bending(-1);
  refused(request, "bending: = -1");
  request = good;
  request.mutable_to()->mutable_positions()->Truncate(30);
  refused(request, "to: has 10 vertices");
  refused({}, "from.faces");
}

TEST_CASE("deadline and cancellation stop a running solver") {
  const test::TestDaemon daemon(oneThread());
  const auto slow = pathRequest(24, 10000);
  {
    grpc::ClientContext context;
    context.set_deadline(std::chrono::system_clock::now() + 400ms);
    CHECK(interpolate(daemon, slow, context).status.error_code() == grpc::DEADLINE_EXCEEDED);
  }
  grpc::ClientContext context;
  auto running = std::async(std::launch::async, [&] { return interpolate(daemon, slow, context); });
  std::this_thread::sleep_for(300ms);
  context.TryCancel();
  CHECK(running.get().status.error_code() == grpc::CANCELLED);
  // The only worker is free again soon.
  grpc::ClientContext next;
  const auto begin = Clock::now();
  CHECK(interpolate(daemon, pathRequest(4, 0), next).status.ok());
  CHECK(Clock::now() - begin < 10s);
}

TEST_CASE("the server's own cap ends a call without a deadline, also while it waits") {
  auto options = oneThread();
  options.longest_call = 0.5;
  const test::TestDaemon daemon(options);
  grpc::ClientContext first, second;
  const auto slow = pathRequest(24, 10000);
  auto running = std::async(std::launch::async, [&] { return interpolate(daemon, slow, first); });
  std::this_thread::sleep_for(100ms);
  const auto waiting = interpolate(daemon, slow, second);
  CHECK(running.get().status.error_code() == grpc::DEADLINE_EXCEEDED);
  CHECK(waiting.status.error_code() == grpc::DEADLINE_EXCEEDED);
}

TEST_CASE("a full queue refuses with a delay, and lists still answer") {
  auto options = oneThread();
  options.admission.queue_length = 1;
  const test::TestDaemon daemon(options);
  const auto slow = pathRequest(24, 10000);
  std::vector<std::unique_ptr<grpc::ClientContext>> contexts;
  std::vector<std::future<PathAnswer>> calls;
  for (int i = 0; i < 3; ++i) {
    contexts.push_back(std::make_unique<grpc::ClientContext>());
    calls.push_back(std::async(std::launch::async, [&, i] { return interpolate(daemon, slow, *contexts[i]); }));
  }
  // One runs and one waits, whichever came first; the third ends while both go on.
  const auto ended = [](const auto& call) { return call.wait_for(0s) == std::future_status::ready; };
  auto refused = calls.end();
  while ((refused = std::find_if(calls.begin(), calls.end(), ended)) == calls.end()) std::this_thread::sleep_for(5ms);
  const auto answer = refused->get();
  CHECK(answer.status.error_code() == grpc::RESOURCE_EXHAUSTED);
  CHECK_THAT(answer.status.error_message(), Contains("busy") && Contains("try again in"));
  CHECK(answer.pushback.size() >= 3);  // at least 100 ms
  CHECK(datasets(daemon).datasets_size() == 0);
  for (const auto& context : contexts) context->TryCancel();
}

TEST_CASE("shutting down ends running calls") {
  test::TestDaemon daemon(oneThread());
  const auto slow = pathRequest(24, 10000);
  grpc::ClientContext context;
  auto running = std::async(std::launch::async, [&] { return interpolate(daemon, slow, context); });
  std::this_thread::sleep_for(200ms);
  const auto begin = Clock::now();
  daemon.daemon.shutdown(0.1s);
  CHECK(Clock::now() - begin < 5s);
  CHECK_FALSE(running.get().status.ok());
}

TEST_CASE("unknown jobs are not found, in every method") {
  const test::TestDaemon daemon;
  const auto stub = v1::Jobs::NewStub(daemon.channel());
  grpc::ClientContext get, cancel, watch;
  v1::GetJobRequest get_request;
  get_request.set_id("7");
  v1::GetJobResponse got;
  CHECK(stub->Get(&get, get_request, &got).error_code() == grpc::NOT_FOUND);
  v1::CancelJobRequest cancel_request;
  cancel_request.set_id("7");
  v1::CancelJobResponse cancelled;
  CHECK(stub->Cancel(&cancel, cancel_request, &cancelled).error_code() == grpc::NOT_FOUND);
  v1::WatchJobRequest watch_request;
  watch_request.set_id("7");
  const auto reader = stub->Watch(&watch, watch_request);
  v1::WatchJobResponse watched;
  CHECK_FALSE(reader->Read(&watched));
  CHECK(reader->Finish().error_code() == grpc::NOT_FOUND);
}

TEST_CASE("a job that fails can be waited for, listed by page and state, and deleted") {
  const test::TestDaemon daemon;
  // Two shapes alike: refused once the training has looked at them.
  REQUIRE(upload(daemon, {header("alike", 2), frame(sphere.vertices), frame(sphere.vertices)}).ok());
  const auto stub = v1::Jobs::NewStub(daemon.channel());
  v1::TrainRequest train;
  train.set_model_name("m");
  train.set_dataset("alike");
  train.mutable_shell_pga()->set_coarse_vertices(50);
  train.set_request_id("once");
  const auto start = [&](v1::Job& job) {
    grpc::ClientContext context;
    v1::TrainResponse response;
    const auto status = stub->Train(&context, train, &response);
    job = response.job();
    return status.error_code();
  };
  v1::Job first, again, other;
  REQUIRE(start(first) == grpc::OK);
  REQUIRE(start(again) == grpc::OK);
  CHECK(again.id() == first.id());
  train.set_model_name("n");
  CHECK(start(other) == grpc::ALREADY_EXISTS);
  train.set_request_id("");
  REQUIRE(start(other) == grpc::OK);

  const auto wait = [&](const std::string& id, double seconds, v1::Job& job) {
    grpc::ClientContext context;
    v1::WaitJobRequest request;
    request.set_id(id);
    if (seconds >= 0) request.mutable_timeout()->set_nanos(static_cast<std::int32_t>(1e9 * seconds));
    v1::WaitJobResponse response;
    const auto status = stub->Wait(&context, request, &response);
    job = response.job();
    return status.error_code();
  };
  v1::Job ended;
  CHECK(wait(first.id(), 0, ended) == grpc::OK);  // as it is
  CHECK(ended.id() == first.id());
  CHECK(wait(other.id(), -1, ended) == grpc::OK);
  CHECK(ended.state() == v1::JOB_STATE_FAILED);
  CHECK_THAT(ended.error(), Contains("rigid motion"));
  CHECK(ended.kind() == "train_shell_pga");
  CHECK(ended.attempts() == 1);
  CHECK(wait("99", -1, ended) == grpc::NOT_FOUND);

  v1::ListJobsRequest list;
  list.set_page_size(1);
  list.add_states(v1::JOB_STATE_FAILED);
  v1::ListJobsResponse page, rest, none;
  grpc::ClientContext one, two, three, four;
  REQUIRE(stub->List(&one, list, &page).ok());
  REQUIRE(page.jobs_size() == 1);
  CHECK(page.jobs(0).id() == first.id());
  list.set_page_token(page.next_page_token());
  REQUIRE(stub->List(&two, list, &rest).ok());
  REQUIRE(rest.jobs_size() == 1);
  CHECK(rest.jobs(0).id() == other.id());
  CHECK(rest.next_page_token().empty());
  list.set_page_token("x");
  CHECK(stub->List(&three, list, &none).error_code() == grpc::INVALID_ARGUMENT);

  v1::DeleteJobRequest doomed;
  doomed.set_id(first.id());
  v1::DeleteJobResponse deleted;
  CHECK(stub->Delete(&four, doomed, &deleted).ok());
  CHECK(wait(first.id(), -1, ended) == grpc::NOT_FOUND);
}

TEST_CASE("an address in use is refused") {
  const test::TestDaemon daemon;
  server::DaemonOptions options;
  options.listen = daemon.daemon.address();
  options.store = daemon.folder / "other";
  CHECK_THROWS_WITH(server::Daemon(options), Contains("--listen: cannot serve on"));
}
