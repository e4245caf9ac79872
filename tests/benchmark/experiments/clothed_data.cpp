#include "tests/benchmark/experiments/clothed_data.h"

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "core/io/file.h"
#include "core/io/mesh_file.h"
#include "core/io/npy.h"
#include "core/io/scan_file.h"
#include "core/mesh/alignment.h"
#include "core/mesh/quality.h"
#include "core/sample/virtual_scanner.h"
#include "tests/benchmark/experiments/experiment.h"

namespace shaped::experiments {
namespace {

constexpr int kFrames = 8, kStep = 5;          ///< of 30 a second
constexpr std::size_t kRunner = 12;            ///< of those with a posed variant: a woman of 1.70 m
constexpr double kThin = 0.01, kThick = 0.06;  ///< m

/// How much of each vertex's skin the cloth covers, 0 to 1: what joints of trunk, upper arms and legs carry of it.
Eigen::VectorXd covered(const Rig& rig) {
  const std::vector<std::string> dressed = {"Hips",         "LHipJoint", "RHipJoint", "LeftUpLeg",    "RightUpLeg",
                                            "LeftLeg",      "RightLeg",  "LowerBack", "Spine",        "Spine1",
                                            "LeftShoulder", "LeftArm",   "RightArm",  "RightShoulder"};
  Eigen::VectorXd joints = Eigen::VectorXd::Zero(rig.skeleton.jointCount());
  for (const auto& name : dressed) joints[rig.skeleton.find(name).value()] = 1;
  return rig.weights * joints;
}

/// Where the skin points to, without its small folds.
Vertices smoothNormals(const Faces& faces, const Vertices& body) {
  Vertices normals = vertexNormals(faces, body);
  for (int round = 0; round < 30; ++round) {
    Vertices sums = normals;
    for (const auto& face : faces.rowwise())
      for (int c = 0; c < 3; ++c) sums.row(face[c]) += normals.row(face[(c + 1) % 3]);
    normals = sums.rowwise().normalized();
  }
  return normals;
}

/// How thick the cloth is over each vertex: waves of half a metre that wander over the body.
Eigen::VectorXd thickness(const Eigen::VectorXd& covered, const Vertices& rest, int frame) {
  Eigen::VectorXd result(rest.rows());
  for (Eigen::Index v = 0; v < rest.rows(); ++v) {
    const double around = std::atan2(rest(v, 0), rest(v, 2)), swing = 1.3 * frame;
    const double wave = 0.6 * std::sin(12 * rest(v, 1) + swing) + 0.4 * std::sin(2 * around - 0.7 * swing);
    result[v] = covered[v] * (kThin + (kThick - kThin) * (0.5 + 0.5 * wave));
  }
  return result;
}

double medianWhere(const Eigen::VectorXd& values, const Eigen::VectorXd& covered) {
  std::vector<double> chosen;
  for (Eigen::Index v = 0; v < values.size(); ++v)
    if (covered[v] > 0.99) chosen.push_back(values[v]);
  const auto middle = chosen.begin() + std::ptrdiff_t(chosen.size() / 2);
  std::nth_element(chosen.begin(), middle, chosen.end());
  return *middle;
}

/// Axis-angle of every joint in one frame.
Vertices rotationsOf(const NpyArray& clip, std::int64_t frame) {
  const auto joints = clip.shape[1];
  return Eigen::Map<const Vertices>(clip.values.data() + frame * joints * 3, joints, 3);
}

}  // namespace

ClothedData clothedWalk() {
  const auto truth = nlohmann::json::parse(readFile(dataPath("body_scans/scans.json")));
  ClothedData data;
  for (const auto& entry : truth.at("clothed")) {
    data.scans.push_back(readScan(dataPath("body_scans/" + entry.at("scan").get<std::string>())));
    data.bodies.push_back(
        apply(motionOf(entry), readMesh(dataPath("body_scans/" + entry.at("gt").get<std::string>())).vertices));
    data.thickness.push_back(entry.at("offset_m").at("trunk_legs_median"));
  }
  data.rest = readMesh(dataPath("body_scans/clothed/rest_gt.ply")).vertices;
  return data;
}

ClothedData clothedRun(const BodyData& data) {
  const auto clip = readNpy(dataPath("body_sequences/motion_run_smallwoman_rotvec_f32.npy"));
  const auto& rig = data.reference.rig;
  const auto& faces = data.reference.topology->faces();
  const Eigen::VectorXd cover = covered(rig);
  ClothedData result;
  result.rest = data.rest[data.posed_identity[kRunner]];
  Pose pose = restPose(rig.skeleton);
  for (int f = 0; f < kFrames; ++f) {
    pose.rotations = rotationsOf(clip, kStep * f);
    const Vertices body =
        PosedSkin(rig.skeleton, rig.weights, result.rest, data.reference.regressor * result.rest, pose).vertices();
    const Eigen::VectorXd offset = thickness(cover, result.rest, f);
    const Vertices cloth = body + (smoothNormals(faces, body).array().colwise() * offset.array()).matrix();
    VirtualScannerOptions scanner;
    scanner.seed = 100 + std::uint64_t(f);
    auto scan = scanVirtually(cloth, faces, scanner);
    result.bodies.push_back(apply(scan.motion, body));
    result.scans.push_back(std::move(scan.scan));
    result.thickness.push_back(medianWhere(offset, cover));
  }
  return result;
}

}  // namespace shaped::experiments
