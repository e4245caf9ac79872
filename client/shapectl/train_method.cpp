#include "client/shapectl/train_method.h"

#include <iostream>
#include <map>

#include "client/shapectl/numbers.h"
#include "core/io/file.h"
#include "core/io/rig_file.h"
#include "core/numerics/error.h"

namespace shaped::shapectl {
namespace {

/// Sums of weights further than this from 1 are no rounding of whoever wrote them.
constexpr double kRoundedWeights = 0.01;

class ShellPgaMethod final : public TrainMethod {
 public:
  std::string name() const override { return "shell-pga"; }

  void declare(Arguments& arguments) override {
    arguments.option("--path-steps", path_steps_, "K", "shell-pga: steps of each discrete geodesic (4)");
    arguments.option("--bending", bending_, "ETA",
                     "shell-pga: bending weight [m^2] (2.5e-5 times the squared diameter)");
    arguments.option("--coarse-vertices", coarse_vertices_, "N",
                     "shell-pga: solve on a mesh of at most so many vertices (1000)");
    arguments.flag("--directed", directed_,
                   "shell-pga: let distances count one direction of the energy, as in the paper (both)");
    arguments.flag("--publish-unconverged", publish_unconverged_,
                   "shell-pga: publish the model even if it did not converge");
  }

  std::string given() const override {
    if (path_steps_ != 0) return "--path-steps";
    if (bending_ != 0) return "--bending";
    if (coarse_vertices_ != 0) return "--coarse-vertices";
    if (directed_) return "--directed";
    return publish_unconverged_ ? "--publish-unconverged" : "";
  }

  void fill(const client::ShapeSource&, std::uint32_t modes, v1::TrainRequest& request) const override {
    request.set_publish_unconverged(publish_unconverged_);
    auto& options = *request.mutable_shell_pga();
    options.set_modes(modes);
    options.set_path_steps(countOf("--path-steps", path_steps_));
    options.set_coarse_vertices(countOf("--coarse-vertices", coarse_vertices_));
    options.set_bending(bending_);
    if (directed_) options.set_path_energy(v1::PATH_ENERGY_DIRECTED);
  }

 private:
  std::int64_t path_steps_ = 0, coarse_vertices_ = 0;
  double bending_ = 0;
  bool publish_unconverged_ = false, directed_ = false;
};

class BodyMethod final : public TrainMethod {
 public:
  std::string name() const override { return "body"; }

  void declare(Arguments& arguments) override {
    arguments.option("--rig", rig_, "RIG.json",
                     "body: the rig of the template at rest (none: one joint, as for faces)");
    arguments.option("--explained", explained_, "X", "body: share of the variance that the modes must hold (0.99)");
    arguments.option("--posture", posture_, "HOW",
                     "body: how the posture is taken out: none, skeleton or local (skeleton)");
    arguments.option("--reach", reach_, "M", "body: of the neighbourhoods of --posture local [m] (0.1)");
  }

  std::string given() const override {
    if (!rig_.empty()) return "--rig";
    if (explained_ != 0) return "--explained";
    if (!posture_.empty()) return "--posture";
    return reach_ != 0 ? "--reach" : "";
  }

  void fill(const client::ShapeSource& shapes, std::uint32_t modes, v1::TrainRequest& request) const override {
    auto& options = *request.mutable_body();
    options.set_modes(modes);
    options.set_explained(explained_);
    options.set_reach(reach_);
    options.set_posture(postureNamed(posture_));
    if (!rig_.empty()) options.set_rig(rigText(rig_, shapes.vertexCount()));
  }

 private:
  std::string rig_, posture_;
  double explained_ = 0, reach_ = 0;
};

}  // namespace

v1::PostureNormalisation postureNamed(const std::string& text) {
  static const std::map<std::string, v1::PostureNormalisation> names{{"", v1::POSTURE_NORMALISATION_UNSPECIFIED},
                                                                     {"none", v1::POSTURE_NORMALISATION_NONE},
                                                                     {"skeleton", v1::POSTURE_NORMALISATION_SKELETON},
                                                                     {"local", v1::POSTURE_NORMALISATION_LOCAL}};
  const auto found = names.find(text);
  if (found == names.end()) throw InvalidInput("--posture", "is \"" + text + "\", want none, skeleton or local");
  return found->second;
}

std::string rigText(const std::string& file, Eigen::Index vertex_count) {
  const auto change = readRig(file, static_cast<std::int32_t>(vertex_count)).largest_weight_change;
  if (change > kRoundedWeights)
    std::cerr << "warning: " << file << ": weights of a vertex sum to 1 give or take " << change
              << "; those of every vertex are made to sum to 1\n";
  return readFile(file);
}

std::vector<std::unique_ptr<TrainMethod>> trainMethods() {
  std::vector<std::unique_ptr<TrainMethod>> methods;
  methods.push_back(std::make_unique<ShellPgaMethod>());
  methods.push_back(std::make_unique<BodyMethod>());
  return methods;
}

const TrainMethod& methodNamed(const std::vector<std::unique_ptr<TrainMethod>>& methods, const std::string& name) {
  const TrainMethod* chosen = nullptr;
  std::string known;
  for (const auto& method : methods) {
    if (method->name() == name) chosen = method.get();
    known += (known.empty() ? "" : " or ") + method->name();
  }
  if (!chosen) throw InvalidInput("METHOD", "is \"" + name + "\", want " + known);
  for (const auto& method : methods)
    if (method.get() != chosen && !method->given().empty())
      throw InvalidInput(method->given(), "goes with " + method->name() + ", not with " + name);
  return *chosen;
}

}  // namespace shaped::shapectl
