#include <cmath>
#include <cstdlib>
#include <fstream>
#include <nlohmann/json.hpp>

#include "core/io/mesh_file.h"
#include "core/shell/energy.h"
#include "tests/benchmark/experiments/data.h"
#include "tests/benchmark/experiments/experiment.h"
#include "tests/benchmark/experiments/timing.h"

namespace shaped::experiments {
namespace {

std::filesystem::path oracleFile() {
  const char* folder = std::getenv("SHAPED_ORACLES");
  if (!folder) return dataPath("oracles/shell_energy.json");
  const auto file = std::filesystem::path(folder) / "shell_energy.json";
  if (!std::filesystem::exists(file))
    throw MissingData("oracles not found at " + file.string() + "; set SHAPED_ORACLES to their folder");
  return file;
}

std::filesystem::path meshFile(const std::string& name) {
  const bool is_horse = name.rfind("horse", 0) == 0;
  return dataPath((is_horse ? "mesh2motion_cc0/derived_welded_off/horse/" : "goast_shapes_mpl2/cactus/") + name);
}

double relativeError(double value, double truth) { return std::abs(value - truth) / std::abs(truth); }

/// The largest relative error of membrane part, bending part and sum.
double errorOf(const nlohmann::json& oracle) {
  const auto from = readMesh(meshFile(oracle.at("undeformed"))), to = readMesh(meshFile(oracle.at("deformed")));
  const Topology topology(static_cast<std::int32_t>(from.vertices.rows()), from.faces);
  const auto undeformed = measure(topology, from.vertices), deformed = measure(topology, to.vertices);
  const auto parts = shellEnergyParts(topology, undeformed, deformed);
  return std::max({relativeError(shellEnergy(topology, undeformed, deformed, oracle.at("eta")), oracle.at("W")),
                   relativeError(parts.membrane, oracle.at("membrane")),
                   relativeError(parts.bending_over_eta, oracle.at("bending_over_eta"))});
}

}  // namespace

void row0Oracles() {
  const OneThread one_thread;
  std::ifstream stream(oracleFile());
  const auto oracles = nlohmann::json::parse(stream);
  Report report("Row 0: shell energy against independent values");
  for (const auto& oracle : oracles) {
    const double error = errorOf(oracle);
    report.entry("W, membrane, bending of " + oracle.at("undeformed").get<std::string>() + " -> " +
                     oracle.at("deformed").get<std::string>() + ", largest relative error",
                 text("%.1e", error), "<= 1e-10", error <= 1e-10);
  }
  const auto set = cactus();
  const auto calculus = calculusOf(set, 1e-3);
  const auto geodesic = calculus.interpolate(set.shapes[0], set.shapes[2], 4, {});
  const double energy = calculus.pathEnergy(geodesic.solution);
  report.entry("path energy of cactus0 -> cactus2, K = 4, eta = 1e-3",
               text("%.9f (%s, relative gradient %.1e)", energy, name(geodesic.termination).data(), geodesic.residual),
               "<= 0.0296957 (public library)", geodesic.converged() && energy <= 0.02969575);
}

}  // namespace shaped::experiments
