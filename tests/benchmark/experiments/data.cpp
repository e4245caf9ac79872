#include "tests/benchmark/experiments/data.h"

#include <algorithm>
#include <cstdlib>

#include "core/io/frames.h"
#include "core/io/mesh_file.h"
#include "core/shell/energy.h"

namespace shaped::experiments {
namespace {

DataSet fromMeshes(std::string name, const std::vector<std::filesystem::path>& files) {
  DataSet set{std::move(name), nullptr, {}};
  for (const auto& file : files) {
    auto mesh = readMesh(file);
    if (!set.topology)
      set.topology = std::make_shared<Topology>(static_cast<std::int32_t>(mesh.vertices.rows()), mesh.faces);
    if (mesh.faces != set.topology->faces())
      throw MissingData(file.string() + " has another connectivity than the first");
    set.shapes.push_back(std::move(mesh.vertices));
  }
  return set;
}

DataSet fromFrames(std::string name, const std::string& folder) {
  const auto mesh = readMesh(dataPath(folder + "/template.ply"));
  auto topology = std::make_shared<Topology>(static_cast<std::int32_t>(mesh.vertices.rows()), mesh.faces);
  return {std::move(name), std::move(topology), readFrames(dataPath(folder + "/poses_f32.npy"))};
}

std::vector<std::filesystem::path> numbered(const std::string& stem, int first, int last,
                                            const std::string& extension) {
  std::vector<std::filesystem::path> files;
  for (int i = first; i <= last; ++i) files.push_back(dataPath(stem + std::to_string(i) + extension));
  return files;
}

}  // namespace

std::filesystem::path dataPath(const std::string& relative) {
  const char* root = std::getenv("SHAPED_DATA");
  const char* home = std::getenv("HOME");
  const std::filesystem::path folder =
      root ? std::filesystem::path(root) : std::filesystem::path(home ? home : ".") / ".cache" / "shaped-data";
  auto path = folder / relative;
  if (!std::filesystem::exists(path))
    throw MissingData("real data not found at " + path.string() + "; set SHAPED_DATA to its folder");
  return path;
}

DataSet cactus() { return fromMeshes("cactus", numbered("goast_shapes_mpl2/cactus/cactus", 0, 18, ".ply")); }

DataSet horse() {
  std::vector<std::filesystem::path> files;
  for (const auto& entry : std::filesystem::directory_iterator(dataPath("mesh2motion_cc0/derived_welded_off/horse")))
    if (entry.path().extension() == ".off") files.push_back(entry.path());
  std::sort(files.begin(), files.end());
  return fromMeshes("horse", files);
}

DataSet cow() {
  auto files = numbered("cragl_characters_mit/cow/cow-", 1, 7, ".obj");
  files.insert(files.begin(), dataPath("cragl_characters_mit/cow.obj"));
  return fromMeshes("cow", files);
}

DataSet bodies() { return fromFrames("body", "posed_body/full"); }
DataSet bodies1k() { return fromFrames("body", "posed_body/coarse_1k"); }

DataSet coarsened(const DataSet& set, int vertices) {
  CoarseningOptions options;
  options.vertex_count = vertices;
  const auto coarsening = coarsen(set.topology, set.shapes, options);
  DataSet coarse{set.name, coarsening.coarse, {}};
  for (const auto& shape : set.shapes) coarse.shapes.push_back(restrictTo(coarsening, shape));
  return coarse;
}

DataSet subset(const DataSet& set, const std::vector<std::size_t>& indices) {
  DataSet chosen{set.name, set.topology, {}};
  for (const auto i : indices) chosen.shapes.push_back(set.shapes.at(i));
  return chosen;
}

GeodesicCalculus calculusOf(const DataSet& set) { return calculusOf(set, defaultBending(set.shapes.front())); }

GeodesicCalculus calculusOf(const DataSet& set, const PairEnergy& energy) {
  return {std::make_shared<ShellStructure>(set.topology), energy};
}

}  // namespace shaped::experiments
