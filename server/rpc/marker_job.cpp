#include "server/rpc/marker_job.h"

#include <optional>
#include <sstream>

#include "core/numerics/error.h"
#include "server/convert/job.h"
#include "server/rpc/answer.h"
#include "server/rpc/batch_result.h"
#include "server/rpc/marker_session.h"

namespace shaped::server {
namespace {

using Header = v1::FitMarkersJobRequest::Header;

/// What a job was asked.
struct Take {
  std::string hash;  ///< of the frames
  std::int64_t frames = 0;
  Header header;

  std::string text() const { return hash + " " + std::to_string(frames) + "\n" + header.SerializeAsString(); }
};

Take takeOf(const JobRecord& job) {
  Take take;
  const auto line = job.request.find('\n');
  if (line == std::string::npos) throwUnreadable(job);
  std::istringstream first(job.request.substr(0, line));
  if (!(first >> take.hash >> take.frames) || !take.header.ParseFromString(job.request.substr(line + 1)))
    throwUnreadable(job);
  return take;
}

/// The frames of a take, one after the other.
class FrameFile {
 public:
  explicit FrameFile(const JobRun& run) : reader_(run.folder / kInputFile), job_(run.job) {}

  void skip(std::int64_t frames) {
    for (; frames > 0; --frames) next();
  }
  const v1::MarkerFrame& next() {
    if (!reader_.next(record_) || !frame_.ParseFromString(record_)) throwUnreadable(job_);
    return frame_;
  }

 private:
  RecordReader reader_;
  const JobRecord& job_;
  std::string record_;
  v1::MarkerFrame frame_;
};

JobResult run(const JobContext& context, const JobRun& run) {
  const auto take = takeOf(run.job);
  const auto& setup = take.header.setup();
  const auto served = pinForJob(context, run, setup.model());
  std::optional<MarkerSession> session(std::in_place, served, setup, context.limits, run.stop);
  BatchResult result(context, run, "Jobs.FitMarkers", take.hash);
  auto from = result.find([&](const auto& path) { return session->resume(path); }).value_or(0);
  if (!result.open(from) || from == 0) {
    from = 0;
    session.emplace(served, setup, context.limits, run.stop);  // as if it had not resumed
  }
  FrameFile frames(run);
  frames.skip(from);
  run.resumed(from > 0 ? "frame " + std::to_string(from) : "");
  const auto keep = [&] { result.offer([&](const auto& path) { session->state()(path, result.count()); }); };
  v1::GetJobResultResponse answer;
  while (result.count() < take.frames) {
    run.progress({"frame " + std::to_string(result.count() + 1) + " of " + std::to_string(take.frames),
                  static_cast<double>(result.count()) / static_cast<double>(take.frames), 0});
    answer.Clear();
    auto& response = *answer.mutable_fit_markers();
    const auto before = session->state();  // what a stop in the middle of a frame must not change
    const auto begin = std::chrono::steady_clock::now();
    const auto solved = session->fit(frames.next(), response);
    if (run.stop.stop_requested()) {
      result.offer([&](const auto& path) { before(path, result.count()); });
      return result.stopped();
    }
    const std::chrono::duration<double> seconds = std::chrono::steady_clock::now() - begin;
    fillAnswer(*served, solved, seconds.count(), solved.solution.smallest_area_ratio, response);
    result.add(answer);
    keep();
  }
  return result.finish();
}

class TakeUpload final : public StreamHandler<v1::FitMarkersJobRequest, v1::FitMarkersJobResponse> {
 public:
  explicit TakeUpload(const JobDesk& desk) : desk_(desk) {}

  bool message(const v1::FitMarkersJobRequest& request, v1::FitMarkersJobResponse&, Call& call) override {
    if (request.has_header())
      begin(request.header(), call);
    else if (request.has_frame())
      append(request.frame());
    else
      throw InvalidInput("part", "is neither header nor frame");
    return false;
  }

  bool end(v1::FitMarkersJobResponse& response, Call&) override {
    if (!input_) throw InvalidInput("header", "is missing: the stream was empty");
    if (input_->count() == 0) throw InvalidInput("frame", "is missing: a take needs at least one");
    const Take take{input_->hash(), input_->count(), header_};
    auto job = newJob(kFitMarkers, take.text(), header_.request_id());
    job.model_name = textOf(header_.setup().model());
    toProto(desk_.runner.start(std::move(job), input_.get()), *response.mutable_job());
    input_.reset();
    return false;
  }

 private:
  void begin(const Header& header, Call& call) {
    if (input_) throw InvalidInput("header", "came a second time");
    header_ = header;
    auto& model = *header_.mutable_setup()->mutable_model();
    if (const auto known = earlierJob(desk_, header.request_id()); known && known->kind == kFitMarkers)
      repeatVersion(takeOf(*known).header.setup().model(), model);
    const auto served = pinModel(desk_.context.models, header_.setup(), call);
    nameVersion(*served, model);
    session_.emplace(served, header_.setup(), desk_.context.limits, std::stop_token());
    input_ = desk_.runner.newInput();
  }

  void append(const v1::MarkerFrame& frame) {
    if (!input_) throw InvalidInput("header", "is missing: the first message must be it");
    const auto& limits = desk_.context.limits;
    const auto field = "frames[" + std::to_string(input_->count()) + "]";
    requireAtMost(input_->count() + 1, limits.frames, field, "frames up to here");
    session_->positionsIn(frame);
    requireAtMost(input_->bytes() + static_cast<std::int64_t>(frame.ByteSizeLong()), limits.job_bytes, field,
                  "bytes up to here");
    input_->append(frame.SerializeAsString());
  }

  const JobDesk& desk_;
  Header header_;
  std::optional<MarkerSession> session_;  ///< checks setup and frames; fits none
  std::unique_ptr<JobInput> input_;
};

}  // namespace

JobKind markerFit(const JobContext& context) {
  return {.work = [&context](const JobRun& one) { return run(context, one); }};
}

std::unique_ptr<StreamHandler<v1::FitMarkersJobRequest, v1::FitMarkersJobResponse>> makeTakeUpload(
    const JobDesk& desk) {
  return std::make_unique<TakeUpload>(desk);
}

}  // namespace shaped::server
