#include "server/security/roles.h"

#include <map>

namespace shaped::server {
namespace {

constexpr unsigned bitOf(Role role) { return 1U << static_cast<unsigned>(role); }

const std::map<std::string_view, Role>& names() {
  static const std::map<std::string_view, Role> table{
      {"read", Role::kRead}, {"infer", Role::kInfer}, {"train", Role::kTrain}, {"admin", Role::kAdmin}};
  return table;
}

/// A method that stands here for no one can be called by no one: a new method needs its line.
const std::map<std::string_view, std::vector<Role>>& methods() {
  static const std::map<std::string_view, std::vector<Role>> table{
      {"/shaped.v1.Models/List", {Role::kRead}},
      {"/shaped.v1.Models/Get", {Role::kRead}},
      {"/shaped.v1.Models/Load", {Role::kAdmin}},
      {"/shaped.v1.Models/Unload", {Role::kAdmin}},
      {"/shaped.v1.Models/SetLabel", {Role::kAdmin}},
      {"/shaped.v1.Models/WaitUntilReady", {Role::kRead}},
      {"/shaped.v1.Models/Delete", {Role::kAdmin}},
      // Who may have answers from a model may have the model; who only watches the daemon may not.
      {"/shaped.v1.Models/Download", {Role::kInfer}},
      {"/shaped.v1.Models/Upload", {Role::kAdmin}},
      {"/shaped.v1.Datasets/List", {Role::kRead}},
      {"/shaped.v1.Datasets/Upload", {Role::kTrain}},
      {"/shaped.v1.Datasets/Delete", {Role::kTrain}},
      {"/shaped.v1.Jobs/Get", {Role::kRead}},
      {"/shaped.v1.Jobs/List", {Role::kRead}},
      {"/shaped.v1.Jobs/Watch", {Role::kRead}},
      {"/shaped.v1.Jobs/Train", {Role::kTrain}},
      {"/shaped.v1.Jobs/Evaluate", {Role::kInfer}},
      {"/shaped.v1.Jobs/Project", {Role::kInfer}},
      {"/shaped.v1.Jobs/FitMarkers", {Role::kInfer}},
      {"/shaped.v1.Jobs/GetResult", {Role::kInfer}},
      // Of those who only infer, the jobs that publish nothing; see JobsService.
      {"/shaped.v1.Jobs/Cancel", {Role::kTrain, Role::kInfer}},
      {"/shaped.v1.Jobs/Wait", {Role::kRead}},
      {"/shaped.v1.Jobs/Delete", {Role::kTrain, Role::kInfer}},
      {"/shaped.v1.Server/GetLimits", {Role::kRead}},
      {"/shaped.v1.Admin/GetStatistics", {Role::kRead}},
      {"/shaped.v1.Shapes/Project", {Role::kInfer}},
      {"/shaped.v1.Shapes/Synthesize", {Role::kInfer}},
      {"/shaped.v1.Shapes/Interpolate", {Role::kInfer}},
      {"/shaped.v1.Shapes/Edit", {Role::kInfer}},
      {"/shaped.v1.Shapes/FitMarkers", {Role::kInfer}},
      {"/shaped.v1.Shapes/Score", {Role::kInfer}},
      {"/shaped.v1.Shapes/Evaluate", {Role::kInfer}},
      {"/shaped.v1.Curves/Smooth", {Role::kInfer}},
      {"/shaped.v1.Curves/Geodesic", {Role::kInfer}},
      {"/shaped.v1.Curves/Bezier", {Role::kInfer}},
      {"/shaped.v1.Curves/Join", {Role::kInfer}},
      {"/shaped.v1.Registration/Register", {Role::kInfer}},
      {"/shaped.v1.Registration/RegisterSequence", {Role::kInfer}},
      {"/shaped.v1.Registration/EstimateUnderClothing", {Role::kInfer}},
  };
  return table;
}

}  // namespace

std::string nameOf(Role role) {
  for (const auto& [name, named] : names())
    if (named == role) return std::string(name);
  return "unknown";
}

std::optional<Role> roleNamed(std::string_view name) {
  const auto found = names().find(name);
  return found == names().end() ? std::nullopt : std::optional(found->second);
}

Roles Roles::all() {
  Roles roles;
  roles.add(Role::kAdmin);
  return roles;
}

void Roles::add(Role role) {
  bits_ |= bitOf(Role::kRead) | bitOf(role);
  if (role == Role::kAdmin) bits_ |= bitOf(Role::kInfer) | bitOf(Role::kTrain);
}

bool Roles::holds(Role role) const { return (bits_ & bitOf(role)) != 0; }

Requirement requirementOf(std::string_view method) {
  using Who = Requirement::Who;
  // Load balancers and orchestrators ask for health without being anybody.
  if (method.starts_with("/grpc.health.v1.Health/")) return {Who::kEverybody};
  if (method.starts_with("/grpc.reflection.")) return {Who::kClients};
  const auto found = methods().find(method);
  if (found == methods().end()) return {};
  return {Who::kRole, found->second};
}

}  // namespace shaped::server
