#include "tests/benchmark/experiments/body_data.h"

#include <algorithm>
#include <cstdlib>
#include <nlohmann/json.hpp>
#include <numbers>

#include "core/io/file.h"
#include "core/io/frames.h"
#include "core/io/mesh_file.h"
#include "core/io/npy.h"
#include "core/io/rig_file.h"
#include "core/io/scan_file.h"
#include "core/mesh/alignment.h"
#include "core/sample/random.h"
#include "tests/benchmark/experiments/experiment.h"

namespace shaped::experiments {
namespace {

std::filesystem::path rigPath() {
  const char* named = std::getenv("SHAPED_RIG");
  std::filesystem::path path = named ? named : "/tmp/rig/body_full.json";
  if (!std::filesystem::exists(path))
    throw MissingData("no rig at " + path.string() + "; make it by tests/support/rig_from_data.py posed_body " +
                      dataPath("posed_body").string() + " " + path.string());
  return path;
}

TrueScan trueScan(int index, const nlohmann::json& truth) {
  const auto& entry = truth.at("scans").at(std::size_t(index));
  const auto file = text("body_scans/scan_%02d.ply", index), body = text("body_scans/gt/scan_%02d_gt.ply", index);
  return {readScan(dataPath(file)), apply(motionOf(entry), readMesh(dataPath(body)).vertices), entry.at("identity")};
}

}  // namespace

RigidMotion motionOf(const nlohmann::json& entry) {
  RigidMotion motion;
  for (int r = 0; r < 3; ++r) {
    motion.translation[r] = entry.at("t").at(std::size_t(r));
    for (int c = 0; c < 3; ++c) motion.rotation(r, c) = entry.at("R").at(std::size_t(r)).at(std::size_t(c));
  }
  return motion;
}

BodyData bodyData() {
  const auto mesh = readMesh(dataPath("body_identities/template.ply"));
  const auto topology = std::make_shared<const Topology>(std::int32_t(mesh.vertices.rows()), mesh.faces);
  BodyData data{{topology, {}, readRig(rigPath(), topology->vertexCount()).rig, {}},
                readFrames(dataPath("body_identities/rest_f32.npy")),
                readFrames(dataPath("body_identities/apose_f32.npy")),
                {},
                {}};
  for (const double identity : readNpy(dataPath("body_identities/apose_identity_i32.npy")).values)
    data.posed_identity.push_back(std::size_t(identity));
  for (std::size_t i = 0; i < data.rest.size(); ++i)
    if (std::find(data.posed_identity.begin(), data.posed_identity.end(), i) == data.posed_identity.end())
      data.others.push_back(i);
  // The rig was made for the average adult, the template of posed_body.
  data.reference = makePostureTemplate(topology, readMesh(dataPath("posed_body/full/template.ply")).vertices,
                                       std::move(data.reference.rig));
  return data;
}

std::vector<TrueScan> trueScans() {
  const auto truth = nlohmann::json::parse(readFile(dataPath("body_scans/scans.json")));
  const char* limit = std::getenv("SHAPED_SCANS");
  std::vector<TrueScan> scans;
  for (int i = 0; i < (limit ? std::atoi(limit) : 40); ++i) scans.push_back(trueScan(i, truth));
  return scans;
}

BodyModel modelOf(const BodyData& data, std::size_t identities, int modes) {
  std::vector<Vertices> training;
  for (std::size_t i = 0; i < identities; ++i) training.push_back(data.rest[data.others[i]]);
  BodyTrainingOptions options;
  options.posture = PostureNormalisation::kNone;
  options.modes = modes;
  return trainBody(data.reference, training, options)->model;
}

Vertices slightlyPosed(const PostureTemplate& reference, const Vertices& rest, std::uint64_t seed) {
  Random random(seed);
  const auto& skeleton = reference.rig.skeleton;
  Pose pose = restPose(skeleton);
  for (std::int32_t j = 1; j < skeleton.jointCount(); ++j) {
    const bool arm =
        skeleton.name(j).find("Shoulder") != std::string::npos || skeleton.name(j).find("Arm") != std::string::npos;
    for (int axis = 0; axis < 3; ++axis)
      pose.rotations(j, axis) = (arm ? 5 : 2.5) * std::numbers::pi / 180 * random.normal();
  }
  return PosedSkin(skeleton, reference.rig.weights, rest, reference.regressor * rest, pose).vertices();
}

}  // namespace shaped::experiments
