#include "client/dataset_upload.h"
#include "client/jobs.h"
#include "client/shapectl/job_output.h"
#include "client/shapectl/job_run.h"
#include "client/shapectl/numbers.h"
#include "client/shapectl/verbs/verbs.h"

namespace shaped::shapectl {
namespace {

struct Train {
  std::string method, name, template_file, frames_file;
  std::vector<std::string> meshes;
  std::int64_t modes = 0, path_steps = 0, coarse_vertices = 0;
  double bending = 0;
  bool publish_unconverged = false, directed = false, detach = false;

  void declare(Arguments& arguments) {
    arguments.positional("METHOD", method, "shell-pga");
    arguments.positional("NAME", name, "The model to make; an existing name gets a new version");
    arguments.positionals("MESH", meshes, 0, "Training meshes of one connectivity (OBJ, PLY, OFF, STL), in metres");
    arguments.option("--template", template_file, "T.ply", "With --frames: the mesh that gives the connectivity");
    arguments.option("--frames", frames_file, "F.npy", "With --template: the shapes, n x V x 3, in metres");
    arguments.option("--modes", modes, "J", "Principal variations, 1 to n - 1 (20)");
    arguments.option("--path-steps", path_steps, "K", "Steps of each discrete geodesic (4)");
    arguments.option("--bending", bending, "ETA", "Bending weight [m^2] (2.5e-5 times the squared diameter)");
    arguments.option("--coarse-vertices", coarse_vertices, "N", "Solve on a mesh of at most so many vertices (1000)");
    arguments.flag("--directed", directed, "Let distances count one direction of the energy, as in the paper (both)");
    arguments.flag("--publish-unconverged", publish_unconverged, "Publish the model even if it did not converge");
    arguments.flag("--detach", detach, "Leave the job to itself: `shapectl watch JOB` follows it");
  }

  ExitCode run(const Session& session) const {
    if (method != "shell-pga") throw InvalidInput("METHOD", "is \"" + method + "\", want shell-pga");
    const auto shapes = source();
    const auto channel = session.channel();
    const auto jobs = v1::Jobs::NewStub(channel);
    v1::Job job;
    {
      ProgressBar bar;
      const auto dataset = upload(channel, shapes, session, bar);
      job = start(*jobs, dataset, session);
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

  v1::Job start(v1::Jobs::Stub& jobs, const v1::Dataset& dataset, const Session& session) const {
    v1::TrainRequest request;
    request.set_model_name(name);
    request.set_dataset(dataset.name());
    request.set_publish_unconverged(publish_unconverged);
    auto& options = *request.mutable_shell_pga();
    options.set_modes(countOf("--modes", modes));
    options.set_path_steps(countOf("--path-steps", path_steps));
    options.set_coarse_vertices(countOf("--coarse-vertices", coarse_vertices));
    options.set_bending(bending);
    if (directed) options.set_path_energy(v1::PATH_ENERGY_DIRECTED);
    client::Call call(session.callOptions());
    v1::TrainResponse response;
    client::require(jobs.Train(call.context(), request, &response));
    return response.job();
  }
};

}  // namespace

Verb trainVerb() { return makeVerb<Train>("train", "Train a model: upload the shapes, start the job, follow it"); }

}  // namespace shaped::shapectl
