#include "core/io/frames.h"
#include "core/io/mesh_file.h"
#include "core/mesh/quality.h"
#include "core/sample/random.h"
#include "core/sample/virtual_scanner.h"
#include "tests/benchmark/experiments/bliss_growth.h"
#include "tests/benchmark/experiments/data.h"

namespace shaped::experiments {
namespace {

constexpr Eigen::Index kFaceVertices = 9409;  ///< of the head's mesh, the first: one component, open at the rim
constexpr double kMetres = 0.01;              ///< the data is in centimetres

/// The face of a head's mesh.
Vertices faceOf(const Vertices& head) { return kMetres * head.topRows(kFaceVertices); }

Faces faceTriangles(const Faces& head) {
  Faces faces(head.rows(), 3);
  Eigen::Index count = 0;
  for (Eigen::Index f = 0; f < head.rows(); ++f)
    if (head.row(f).maxCoeff() < kFaceVertices) faces.row(count++) = head.row(f);
  return faces.topRows(count);
}

/// Persons drawn from the model of the data: its neutral face and 100 modes.
class Persons {
 public:
  explicit Persons(const Vertices& neutral) : neutral_(neutral) {
    for (const auto& mode : readFrames(dataPath("ict_facekit_mit/identity_vertices_f32.npy")))
      modes_.push_back(faceOf(mode) - neutral);
  }

  Vertices draw(Random& random) const {
    Vertices face = neutral_;
    for (const auto& mode : modes_) face += random.normal() * mode;
    return face;
  }

 private:
  Vertices neutral_;
  std::vector<Vertices> modes_;
};

}  // namespace

void blissFaces() {
  Report report("BLiSS on faces: 10 for the model, 10 for the field, 11 modes, no rig");
  const auto mesh = readMesh(dataPath("ict_facekit_mit/generic_neutral_mesh.obj"));
  const Vertices neutral = faceOf(mesh.vertices);
  const auto topology = std::make_shared<const Topology>(std::int32_t(kFaceVertices), faceTriangles(mesh.faces));
  const auto reference = makePostureTemplate(topology, neutral, rigidRig(neutral));
  const Persons persons(neutral);
  Random random(29);
  auto options = growthOptions();
  options.scanner = scannerFor(boundingBoxDiagonal(neutral));
  std::vector<Vertices> known;
  for (int i = 0; i < 20; ++i) known.push_back(persons.draw(random));
  const auto scanned = [&](const Vertices& face) {
    auto scanner = options.scanner;
    scanner.seed = random.bits();
    return scanVirtually(face, topology->faces(), scanner);
  };
  const auto scans = std::make_shared<std::vector<Scan>>();
  for (int i = 0; i < setting("SHAPED_UNREGISTERED", 200); ++i) scans->push_back(scanned(persons.draw(random)).scan);
  std::vector<Trial> trials;
  for (int i = 0; i < setting("SHAPED_SCANS", 40); ++i) {
    const Vertices face = persons.draw(random);
    auto scan = scanned(face);
    trials.push_back({std::move(scan.scan), apply(scan.motion, face), face});
  }
  grow(report, growthInputs(reference, known, scans), options, trials);
}

}  // namespace shaped::experiments
