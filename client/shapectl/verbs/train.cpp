#include "client/dataset_upload.h"
#include "client/jobs.h"
#include "client/shapectl/job_output.h"
#include "client/shapectl/job_run.h"
#include "client/shapectl/numbers.h"
#include "client/shapectl/train_method.h"
#include "client/shapectl/verbs/verbs.h"

namespace shaped::shapectl {
namespace {

struct Train {
  std::string method, name, template_file, frames_file;
  std::vector<std::string> meshes;
  std::int64_t modes = 0;
  bool detach = false;
  std::vector<std::unique_ptr<TrainMethod>> methods = trainMethods();

  void declare(Arguments& arguments) {
    arguments.positional("METHOD", method, "shell-pga, or body: identity and pose of registered shapes");
    arguments.positional("NAME", name, "The model to make; an existing name gets a new version");
    arguments.positionals("MESH", meshes, 0, "Training meshes of one connectivity (OBJ, PLY, OFF, STL), in metres");
    arguments.option("--template", template_file, "T.ply", "With --frames: the mesh that gives the connectivity");
    arguments.option("--frames", frames_file, "F.npy", "With --template: the shapes, n x V x 3, in metres");
    arguments.option("--modes", modes, "J",
                     "Principal variations, 1 to n - 1 (20; of a body, as many as --explained asks for)");
    for (const auto& one : methods) one->declare(arguments);
    arguments.flag("--detach", detach, "Leave the job to itself: `shapectl watch JOB` follows it");
  }

  ExitCode run(const Session& session) const {
    const auto& chosen = methodNamed(methods, method);
    const auto shapes = source();
    v1::TrainRequest request;
    request.set_model_name(name);
    chosen.fill(shapes, countOf("--modes", modes), request);
    const auto channel = session.channel();
    const auto jobs = v1::Jobs::NewStub(channel);
    v1::Job job;
    {
      ProgressBar bar;
      request.set_dataset(upload(channel, shapes, session, bar).name());
      job = start(*jobs, request, session);
      if (!detach) job = follow(*jobs, job, session, bar);
    }
    return detach ? printStarted(job, session) : printEnded(job, session);
  }

 private:
  client::ShapeSource source() const {
    if (template_file.empty() != frames_file.empty())
      throw InvalidInput(template_file.empty() ? "--template" : "--frames", "is missing: the two come together");
    if (!frames_file.empty() && !meshes.empty())
      throw InvalidInput("MESH", "name either mesh files or --template and --frames");
    return frames_file.empty() ? client::ShapeSource(meshes) : client::ShapeSource(template_file, frames_file);
  }

  v1::Dataset upload(const std::shared_ptr<grpc::Channel>& channel, const client::ShapeSource& shapes,
                     const Session& session, ProgressBar& bar) const {
    const auto count = static_cast<double>(shapes.count());
    return client::uploadDataset(channel, client::contentName(shapes, name), shapes, session.callOptions(),
                                 [&](std::int64_t sent) { bar.show(static_cast<double>(sent) / count, "uploading"); });
  }

  static v1::Job start(v1::Jobs::Stub& jobs, const v1::TrainRequest& request, const Session& session) {
    client::Call call(session.callOptions());
    v1::TrainResponse response;
    client::require(jobs.Train(call.context(), request, &response));
    return response.job();
  }
};

}  // namespace

Verb trainVerb() { return makeVerb<Train>("train", "Train a model: upload the shapes, start the job, follow it"); }

}  // namespace shaped::shapectl
