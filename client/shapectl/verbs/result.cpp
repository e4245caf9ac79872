#include "client/jobs.h"
#include "client/mesh.h"
#include "client/models.h"
#include "client/shapectl/job_run.h"
#include "client/shapectl/output.h"
#include "client/shapectl/verbs/verbs.h"
#include "core/io/marker_set_file.h"

namespace shaped::shapectl {
namespace {

struct Result {
  std::string id, set_file;
  ResultFiles files;

  void declare(Arguments& arguments) {
    arguments.positional("JOB", id, "A job of evaluate, project, fit or bootstrap, as `shapectl jobs` lists it");
    arguments.option("-o,--out", files.out, "OUT.npy", "Write the shapes, n x V x 3 [m]");
    arguments.option("--report", files.report, "R.json", "Write how each answer came out");
    arguments.option("--plot", files.plot, "P.svg", "Of an evaluation: draw the measures over the number of modes");
    arguments.option("--marker-set", set_file, "M.json",
                     "Of a fit: the set it was started with, for the markers' names");
  }

  ExitCode run(const Session& session) const {
    const auto channel = session.channel();
    const auto jobs = v1::Jobs::NewStub(channel);
    JobResultOutput output(files, set_file.empty() ? std::vector<std::string>() : labels(channel, *jobs, session));
    return printResult(*jobs, id, session, output);
  }

 private:
  /// The set's, which may name other vertices for other models than the job's.
  std::vector<std::string> labels(const std::shared_ptr<grpc::Channel>& channel, v1::Jobs::Stub& jobs,
                                  const Session& session) const {
    const auto job = client::getJob(jobs, id, session.callOptions());
    const auto model = client::getModelMesh(channel, parseModel(job.model_name()), session.callOptions());
    std::vector<std::string> all;
    for (const auto& marker : readMarkerSet(set_file, static_cast<std::int32_t>(model.mean.rows()),
                                            static_cast<std::int32_t>(model.faces.rows()))
                                  .markers)
      all.push_back(marker.label);
    return all;
  }
};

}  // namespace

Verb resultVerb() {
  return makeVerb<Result>("result", "Fetch what a job of evaluate, project, fit or bootstrap has left");
}

}  // namespace shaped::shapectl
