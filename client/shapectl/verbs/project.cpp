#include "client/dataset_upload.h"
#include "client/mesh.h"
#include "client/models.h"
#include "client/shapectl/answer.h"
#include "client/shapectl/coefficients.h"
#include "client/shapectl/job_run.h"
#include "client/shapectl/numbers.h"
#include "client/shapectl/projection_output.h"
#include "client/shapectl/verbs/verbs.h"
#include "shaped/v1/shapes.grpc.pb.h"

namespace shaped::shapectl {
namespace {

struct Project {
  std::string name, out, coefficients, dataset, report_file;
  std::vector<std::string> meshes;
  std::int64_t modes = 0;
  bool fine = false;
  JobFlags flags;

  void declare(Arguments& arguments) {
    arguments.positional("NAME", name, "The model, NAME or NAME@VERSION");
    arguments.option("-o,--out", out, "OUT.ply", "Write the model's nearest shape; as a job, OUT.npy: of every mesh");
    arguments.option("--coefficients", coefficients, "C.json", "Write its coefficients (of one mesh)");
    arguments.option("--modes", modes, "J", "Principal variations to use (all)");
    arguments.flag("--fine", fine, "Finish by Newton's method at full resolution");
    arguments.option("--dataset", dataset, "D", "As a job: project the shapes of a dataset on the daemon");
    arguments.option("--report", report_file, "R.json", "As a job: write coefficients and scores of every mesh");
    flags.declare(arguments);
    arguments.positionals("MESH", meshes, 0, "A mesh of the model's connectivity; as a job, any number");
  }

  ExitCode run(const Session& session) const {
    if (flags.any()) return runAsJob(session);
    if (meshes.size() != 1) throw InvalidInput("MESH", "want one; any number with --job or --detach");
    for (const auto& [option, value] : {std::pair("--dataset", dataset), std::pair("--report", report_file)})
      if (!value.empty()) throw InvalidInput(option, "goes with --job or --detach");
    const auto channel = session.channel();
    const auto model = client::getModelMesh(channel, parseModel(name), session.callOptions());
    v1::ProjectRequest request;
    *request.mutable_model() = client::pinned(model.description);
    *request.mutable_shape() = client::readShape(meshes.front(), model.mean.rows(), model.faces);
    request.set_modes(countOf("--modes", modes));
    request.set_fine(fine);
    client::Call call(session.callOptions());
    v1::ProjectResponse response;
    client::require(v1::Shapes::NewStub(channel)->Project(call.context(), request, &response));
    if (!out.empty()) writeMesh(out, client::unpack(response.shape().positions()), model.faces);
    if (!coefficients.empty()) writeCoefficients(coefficients, response.coefficients());
    print(response, session);
    return exitCodeOf(response.report());
  }

 private:
  ExitCode runAsJob(const Session& session) const {
    if (!coefficients.empty()) throw InvalidInput("--coefficients", "is for one mesh; as a job, --report has them");
    if (meshes.empty() == dataset.empty()) throw InvalidInput("MESH", "name either mesh files or --dataset");
    JobResultOutput output({out, report_file, {}});
    return runBatch(session, flags, output, [&](v1::Jobs::Stub& jobs, ProgressBar& bar) {
      v1::ProjectJobRequest request;
      *request.mutable_model() = parseModel(name);
      request.set_dataset(dataset.empty() ? upload(session, bar) : dataset);
      request.set_modes(countOf("--modes", modes));
      request.set_fine(fine);
      // Whoever fetches a detached job's result says only then whether he wants the shapes.
      request.set_without_shapes(out.empty() && !flags.detach);
      return client::startProjection(jobs, request, session.callOptions());
    });
  }

  std::string upload(const Session& session, ProgressBar& bar) const {
    const client::ShapeSource shapes(meshes);
    const auto count = static_cast<double>(shapes.count());
    return client::uploadDataset(session.channel(), client::contentName(shapes, "projection"), shapes,
                                 session.callOptions(),
                                 [&](std::int64_t sent) { bar.show(static_cast<double>(sent) / count, "uploading"); })
        .name();
  }

  static void print(const v1::ProjectResponse& response, const Session& session) {
    if (session.json) return printJson(projectionDocument(response));
    std::cout << answerText(response) << "\nresidual energy " << response.residual_energy()
              << " m^2, Mahalanobis distance " << response.score().mahalanobis() << "\n";
  }
};

}  // namespace

Verb projectVerb() { return makeVerb<Project>("project", "Find the model's shape nearest to a mesh"); }

}  // namespace shaped::shapectl
