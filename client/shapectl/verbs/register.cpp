#include <iostream>
#include <optional>

#include "client/mesh.h"
#include "client/models.h"
#include "client/registration.h"
#include "client/shapectl/output.h"
#include "client/shapectl/progress_bar.h"
#include "client/shapectl/registration_output.h"
#include "client/shapectl/scan_landmarks.h"
#include "client/shapectl/verbs/verbs.h"
#include "core/io/file.h"
#include "core/io/frames.h"
#include "core/io/length_unit.h"
#include "core/io/mesh_file.h"
#include "core/io/scan_file.h"
#include "core/numerics/error.h"

namespace shaped::shapectl {
namespace {

struct Register {
  std::string name, out, landmarks_file, report_file, unit = "m";
  std::vector<std::string> scans;
  bool refine = false, without_field = false;

  void declare(Arguments& arguments) {
    arguments.positional("NAME", name, "The model, NAME or NAME@VERSION, of kind body");
    arguments.option("-o,--out", out, "OUT.ply", "Write the scan in the model's topology; of several, OUT.npy");
    arguments.option("--landmarks", landmarks_file, "L.json", "Points of the model that are known on the scan");
    arguments.option("--report", report_file, "R.json", "Write coefficients, distances and warnings of every scan");
    arguments.option("--unit", unit, "U", "Of the scan and the landmarks: m, cm, mm, in, ... (m)");
    arguments.flag("--refine", refine, "Deform the surface onto the scan, beyond what the model can say");
    arguments.flag("--without-field", without_field, "Leave the model's neural field aside, if it has one");
    arguments.positionals("SCAN", scans, 1,
                          "A scan (PLY, OBJ, OFF, STL, .npy, .xyz); several: a motion, each from where the last ended");
  }

  ExitCode run(const Session& session) const {
    const auto options = registrationOptions();
    const auto channel = session.channel();
    const auto model = client::getModelMesh(channel, parseModel(name), session.callOptions());
    return scans.size() == 1 ? one(channel, model, options, session) : sequence(channel, model, options, session);
  }

 private:
  v1::RegistrationOptions registrationOptions() const {
    v1::RegistrationOptions options;
    const auto metres = metresPer(unit);
    if (!metres) throw InvalidInput("--unit", "\"" + unit + "\" is no unit of length; want m, cm, mm, in, ...");
    options.set_unit_factor(*metres);
    options.set_refine(refine);
    options.set_without_field(without_field);
    options.set_without_shapes(out.empty());
    return options;
  }

  ExitCode one(const std::shared_ptr<grpc::Channel>& channel, const client::ModelMesh& model,
               const v1::RegistrationOptions& options, const Session& session) const {
    v1::RegisterRequest request;
    *request.mutable_model() = client::pinned(model.description);
    *request.mutable_scan() = client::pack(readScan(scans.front()));
    *request.mutable_options() = options;
    if (!landmarks_file.empty())
      for (const auto& landmark : readScanLandmarks(landmarks_file)) *request.add_landmarks() = landmark;
    const auto response = client::registerScan(channel, request, session.callOptions());
    if (!out.empty()) writeMesh(out, client::unpack(response.shape().positions()), model.faces);
    const auto document = registrationDocument(response);
    if (!report_file.empty()) writeFile(report_file, document.dump(2) + "\n");
    if (session.json)
      printJson(document);
    else
      std::cout << registrationText(response);
    return exitCodeOf(response.report());
  }

  ExitCode sequence(const std::shared_ptr<grpc::Channel>& channel, const client::ModelMesh& model,
                    const v1::RegistrationOptions& options, const Session& session) const {
    if (!landmarks_file.empty()) throw InvalidInput("--landmarks", "is for one scan");
    v1::RegisterSequenceRequest::Setup setup;
    *setup.mutable_model() = client::pinned(model.description);
    *setup.mutable_options() = options;
    const auto frame = [&](std::int64_t index) {
      v1::RegisterSequenceRequest::Frame message;
      message.set_frame(static_cast<std::uint32_t>(index));
      *message.mutable_scan() = client::pack(readScan(scans[static_cast<std::size_t>(index)]));
      return message;
    };
    std::optional<FrameWriter> writer;
    if (!out.empty()) writer.emplace(out);
    auto code = ExitCode::kSuccess;
    auto documents = nlohmann::json::array();
    std::string text;
    {
      ProgressBar bar;
      client::registerSequence(
          channel, setup, std::ssize(scans), frame, session.callOptions(), [&](const v1::RegisterResponse& response) {
            documents.push_back(registrationDocument(response));
            const auto& file = scans[response.frame()];
            documents.back()["scan"] = file;
            text += file + ": " + registrationText(response);
            if (writer) writer->append(client::unpack(response.shape().positions()));
            if (exitCodeOf(response.report()) != ExitCode::kSuccess) code = exitCodeOf(response.report());
            bar.show(static_cast<double>(documents.size()) / static_cast<double>(scans.size()), file);
          });
    }
    if (writer) writer->close();
    const nlohmann::json document{{"scans", documents}};
    if (!report_file.empty()) writeFile(report_file, document.dump(2) + "\n");
    session.json ? printJson(document) : void(std::cout << text);
    return code;
  }
};

}  // namespace

Verb registerVerb() {
  return makeVerb<Register>("register", "Bring a raw scan into the topology of a body model: identity and pose");
}

}  // namespace shaped::shapectl
