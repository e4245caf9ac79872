#include <cstdio>
#include <filesystem>
#include <iostream>

#include "client/shapectl/numbers.h"
#include "client/shapectl/output.h"
#include "client/shapectl/progress_bar.h"
#include "client/shapectl/verbs/verbs.h"
#include "core/io/file.h"
#include "core/io/file_error.h"
#include "core/io/frames.h"
#include "core/io/marker_file.h"
#include "core/io/marker_set_file.h"
#include "core/io/mesh_file.h"
#include "core/io/rig_file.h"
#include "core/numerics/error.h"
#include "core/sample/creature.h"
#include "core/sample/creature_rig.h"
#include "core/sample/marker_trial.h"
#include "core/sample/motion.h"

namespace shaped::shapectl {
namespace {

namespace fs = std::filesystem;

void makeFolder(const fs::path& folder) {
  std::error_code failed;
  fs::create_directories(folder, failed);
  if (failed) throw FileError(folder.string(), "cannot be made: " + failed.message());
}

std::string numbered(const char* stem, std::size_t index) {
  char text[32];
  std::snprintf(text, sizeof text, "%s_%03zu.ply", stem, index);
  return text;
}

struct Sample {
  std::string folder;
  std::int64_t poses = 20, bodies = 0, vertices = 1500, frames = 60, seed = 1;
  bool markers = false;

  void declare(Arguments& arguments) {
    arguments.positional("OUTDIR", folder, "Where to write; made if absent");
    arguments.option("--poses", poses, "N", "Poses of the creature (20)");
    arguments.option("--bodies", bodies, "N", "Individuals of other proportions, at rest (0)");
    arguments.flag("--markers", markers, "Also a virtual motion-capture trial with its true meshes");
    arguments.option("--frames", frames, "N", "Length of that trial, at 30 frames a second (60)");
    arguments.option("--vertices", vertices, "N", "Vertices of the mesh, about (1500)");
    arguments.option("--seed", seed, "S", "Other seeds give other poses, bodies and noise (1)");
  }

  ExitCode run(const Session& session) const {
    countOf("--poses", poses), countOf("--bodies", bodies), countOf("--seed", seed);
    ProgressBar bar;
    bar.show(0, "meshing the creature");
    const auto creature =
        makeCreature({.vertices = static_cast<int>(countOf("--vertices", vertices)), .proportions = {}});
    nlohmann::json written{{"directory", folder},
                           {"vertices", creature.topology->vertexCount()},
                           {"faces", creature.topology->faces().rows()},
                           {"poses", poses},
                           {"bodies", bodies}};
    const fs::path root(folder);
    makeFolder(root);
    writeMesh(root / "template.ply", creature.rest, creature.topology->faces());
    writeRig(root / "rig.json", rigOf(creature));
    bar.show(0.3, "poses");
    writePoses(root, creature, session);
    bar.show(0.6, "bodies");
    if (bodies > 0) writeBodies(root, creature, session);
    bar.show(0.8, "markers");
    if (markers) written["markers"] = writeTrial(root / "markers", creature);
    print(written, session);
    return session.stop.stop_requested() ? ExitCode::kCancelled : ExitCode::kSuccess;
  }

 private:
  /// The poses as meshes and as one stack; one more pose and its handles are kept apart from what a model trains on.
  void writePoses(const fs::path& root, const SampleCreature& creature, const Session& session) const {
    auto shapes = samplePoses(creature, static_cast<int>(poses) + 1, static_cast<std::uint64_t>(seed));
    const Vertices held_out = std::move(shapes.back());
    shapes.pop_back();
    writeMesh(root / "held_out.ply", held_out, creature.topology->faces());
    writeHandles(root / "handles.csv", creature, held_out);
    if (shapes.empty()) return;
    writeFrames(root / "poses.npy", shapes);
    writeMeshes(root / "poses", "pose", shapes, creature, session);
  }

  void writeBodies(const fs::path& root, const SampleCreature& creature, const Session& session) const {
    std::vector<Vertices> shapes;
    for (std::int64_t body = 0; body < bodies; ++body)
      shapes.push_back(withProportions(creature, randomProportions(static_cast<std::uint64_t>(seed + body))).rest);
    writeFrames(root / "bodies.npy", shapes);
    writeMeshes(root / "bodies", "body", shapes, creature, session);
  }

  static void writeMeshes(const fs::path& folder, const char* stem, const std::vector<Vertices>& shapes,
                          const SampleCreature& creature, const Session& session) {
    makeFolder(folder);
    for (std::size_t i = 0; i < shapes.size() && !session.stop.stop_requested(); ++i)
      writeMesh(folder / numbered(stem, i), shapes[i], creature.topology->faces());
  }

  /// Nose, tail, paws and toes of a shape, as handles for `shapectl edit`.
  static void writeHandles(const fs::path& path, const SampleCreature& creature, const Vertices& shape) {
    std::string text = "vertex,x,y,z\n";
    const std::vector<std::string> wanted{"NOSE", "TAIL4", "LPAW", "RPAW", "LTOE", "RTOE"};
    for (const auto& marker : creatureMarkers(creature).markers) {
      if (std::find(wanted.begin(), wanted.end(), marker.label) == wanted.end()) continue;
      char line[128];
      const auto at = shape.row(marker.vertex);
      std::snprintf(line, sizeof line, "%d,%.6f,%.6f,%.6f\n", marker.vertex, at[0], at[1], at[2]);
      text += line;
    }
    writeFile(path, text);
  }

  nlohmann::json writeTrial(const fs::path& root, const SampleCreature& creature) const {
    SampleTrialOptions options;
    options.frames = static_cast<int>(countOf("--frames", frames));
    options.seed = static_cast<std::uint64_t>(seed);
    const auto sample = sampleMarkerTrial(creature, options);
    makeFolder(root);
    writeMarkers(root / "trial.csv", sample.trial);
    writeMarkerSet(root / "marker_set.json", sample.markers);
    writeFrames(root / "truth.npy", sample.truth);
    return {{"labels", sample.trial.labels.size()},
            {"frames", options.frames},
            {"rate_hz", options.rate_hz},
            {"noise", options.noise},
            {"dropout", options.dropout}};
  }

  void print(const nlohmann::json& written, const Session& session) const {
    if (session.json) return printJson(written);
    std::cout << folder << ": a creature of " << written["vertices"] << " vertices and " << written["faces"]
              << " faces\n"
              << "  template.ply, rig.json, held_out.ply, handles.csv (of held_out.ply)\n";
    if (poses > 0) std::cout << "  poses.npy, poses/: " << poses << " poses\n";
    if (bodies > 0) std::cout << "  bodies.npy, bodies/: " << bodies << " individuals\n";
    if (markers)
      std::cout << "  markers/: trial.csv (" << written["markers"]["labels"] << " markers, " << frames
                << " frames), marker_set.json, truth.npy\n";
  }
};

}  // namespace

Verb sampleVerb() {
  return makeVerb<Sample>("sample", "Write sample data: an articulated creature in poses, proportions and motion");
}

}  // namespace shaped::shapectl
