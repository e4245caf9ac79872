#include "client/jobs.h"
#include "client/shapectl/job_output.h"
#include "client/shapectl/job_run.h"
#include "client/shapectl/numbers.h"
#include "client/shapectl/train_method.h"
#include "client/shapectl/training_shapes.h"
#include "client/shapectl/verbs/verbs.h"

namespace shaped::shapectl {
namespace {

struct Train {
  std::string method, name;
  TrainingShapes training;
  std::int64_t modes = 0;
  bool detach = false;
  std::vector<std::unique_ptr<TrainMethod>> methods = trainMethods();

  void declare(Arguments& arguments) {
    arguments.positional("METHOD", method, "shell-pga, or body: identity and pose of registered shapes");
    arguments.positional("NAME", name, "The model to make; an existing name gets a new version");
    training.declare(arguments);
    arguments.option("--modes", modes, "J",
                     "Principal variations, 1 to n - 1 (20; of a body, as many as --explained asks for)");
    for (const auto& one : methods) one->declare(arguments);
    arguments.flag("--detach", detach, "Leave the job to itself: `shapectl watch JOB` follows it");
  }

  ExitCode run(const Session& session) const {
    const auto& chosen = methodNamed(methods, method);
    const auto shapes = training.source();
    v1::TrainRequest request;
    request.set_model_name(name);
    chosen.fill(shapes, countOf("--modes", modes), request);
    const auto channel = session.channel();
    const auto jobs = v1::Jobs::NewStub(channel);
    v1::Job job;
    {
      ProgressBar bar;
      request.set_dataset(uploadShapes(channel, shapes, name, session, bar));
      job = client::startTraining(*jobs, request, session.callOptions());
      if (!detach) job = follow(*jobs, job, session, bar);
    }
    return detach ? printStarted(job, session) : printEnded(job, session);
  }
};

}  // namespace

Verb trainVerb() { return makeVerb<Train>("train", "Train a model: upload the shapes, start the job, follow it"); }

}  // namespace shaped::shapectl
