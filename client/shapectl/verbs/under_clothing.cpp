#include <filesystem>
#include <iostream>
#include <optional>

#include "client/mesh.h"
#include "client/models.h"
#include "client/registration.h"
#include "client/scan_upload.h"
#include "client/shapectl/clothing_output.h"
#include "client/shapectl/output.h"
#include "client/shapectl/progress_bar.h"
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

using Request = v1::EstimateUnderClothingRequest;
using Response = v1::EstimateUnderClothingResponse;

struct UnderClothing {
  std::string name, out, rest_file, landmarks_file, report_file, unit = "m";
  std::vector<std::string> scans;
  std::optional<double> scan_noise, thickest;

  void declare(Arguments& arguments) {
    arguments.positional("NAME", name, "The model, NAME or NAME@VERSION, of kind body");
    arguments.option("-o,--out", out, "OUT.npy", "Write the body in every scan's place, n x V x 3 [m]");
    arguments.option("--rest", rest_file, "REST.ply", "Write the body in the model's rest pose");
    arguments.option("--report", report_file, "R.json", "Write coefficients, numbers and warnings of every scan");
    arguments.option("--landmarks", landmarks_file, "L.json", "Points of the body that are known on scans");
    arguments.option("--unit", unit, "U", "Of the scans and the landmarks: m, cm, mm, in, ... (m)");
    arguments.option("--scan-noise", scan_noise, "M", "Standard deviation of the scans' points [m] (0.0015)");
    arguments.option("--thickest", thickest, "M", "No cloth hangs further from the skin [m] (0.1)");
    arguments.positionals("SCAN", scans, 1,
                          "Scans of one person in motion, in order (PLY, OBJ, OFF, STL, .npy, .xyz), or their folder");
  }

  ExitCode run(const Session& session) const {
    const auto files = scanFiles();
    Request::Setup setup;
    *setup.mutable_options() = options();
    const auto landmarks = landmarksOf(std::ssize(files));
    const auto channel = session.channel();
    const auto model = client::getModelMesh(channel, parseModel(name), session.callOptions());
    *setup.mutable_model() = client::pinned(model.description);
    ClothingOutput output(files);
    std::optional<FrameWriter> writer;
    if (!out.empty()) writer.emplace(out);
    Vertices rest;
    {
      ProgressBar bar;
      client::estimateUnderClothing(
          channel, setup, std::ssize(files), [&](std::int64_t index) { return frame(files, landmarks, index, bar); },
          session.callOptions(),
          [&](const Response& response) {
            if (response.has_body()) {
              output.set(response.body());
              rest = client::unpack(response.body().rest().positions());
            } else {
              output.add(response.frame());
              if (writer) writer->append(client::unpack(response.frame().shape().positions()));
            }
          });
    }
    if (writer) writer->close();
    if (!rest_file.empty()) writeMesh(rest_file, rest, model.faces);
    if (!report_file.empty()) writeFile(report_file, output.document().dump(2) + "\n");
    session.json ? printJson(output.document()) : void(std::cout << output.text());
    return output.exitCode();
  }

 private:
  v1::UnderClothingOptions options() const {
    v1::UnderClothingOptions options;
    const auto metres = metresPer(unit);
    if (!metres) throw InvalidInput("--unit", "\"" + unit + "\" is no unit of length; want m, cm, mm, in, ...");
    options.set_unit_factor(*metres);
    options.set_without_shapes(out.empty() && rest_file.empty());
    if (scan_noise) options.set_scan_noise(*scan_noise);
    if (thickest) options.set_thickest(*thickest);
    return options;
  }

  /// The scans as given, or those of the one folder that is given, by name.
  std::vector<std::string> scanFiles() const {
    if (scans.size() > 1 || !std::filesystem::is_directory(scans.front())) return scans;
    const client::ScanFolder folder("SCAN", scans.front(), 1);
    std::vector<std::string> files;
    for (std::int64_t i = 0; i < folder.count(); ++i)
      files.push_back((std::filesystem::path(scans.front()) / folder.name(i)).string());
    return files;
  }

  std::vector<std::vector<v1::ScanLandmark>> landmarksOf(std::int64_t count) const {
    if (landmarks_file.empty()) return std::vector<std::vector<v1::ScanLandmark>>(static_cast<std::size_t>(count));
    return readSequenceLandmarks(landmarks_file, count);
  }

  static Request::Frame frame(const std::vector<std::string>& files,
                              const std::vector<std::vector<v1::ScanLandmark>>& landmarks, std::int64_t index,
                              ProgressBar& bar) {
    const auto at = static_cast<std::size_t>(index);
    bar.show(static_cast<double>(at) / static_cast<double>(files.size()), "sending " + files[at]);
    Request::Frame message;
    message.set_frame(static_cast<std::uint32_t>(index));
    *message.mutable_scan() = client::pack(readScan(files[at]));
    for (const auto& landmark : landmarks[at]) *message.add_landmarks() = landmark;
    if (at + 1 == files.size())
      bar.show(1, "estimating " + std::to_string(files.size()) + " frames together, some fifteen seconds each");
    return message;
  }
};

}  // namespace

Verb underClothingVerb() {
  return makeVerb<UnderClothing>("under-clothing", "Estimate the body of a dressed person from scans of a motion");
}

}  // namespace shaped::shapectl
