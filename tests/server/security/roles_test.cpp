#include "server/security/roles.h"

#include <catch2/catch.hpp>
#include <set>

#include "shaped/v1/datasets.pb.h"
#include "shaped/v1/jobs.pb.h"
#include "shaped/v1/models.pb.h"
#include "shaped/v1/server.pb.h"
#include "shaped/v1/shapes.pb.h"

using namespace shaped;
using namespace shaped::server;
using Who = Requirement::Who;

namespace {

/// Every method of the package, in the generated descriptors: "/shaped.v1.Models/List".
std::set<std::string> allMethods() {
  std::set<std::string> methods;
  for (const auto* file :
       {v1::ListModelsRequest::descriptor()->file(), v1::Dataset::descriptor()->file(), v1::Job::descriptor()->file(),
        v1::ProjectRequest::descriptor()->file(), v1::GetLimitsRequest::descriptor()->file()})
    for (int s = 0; s < file->service_count(); ++s)
      for (int m = 0; m < file->service(s)->method_count(); ++m)
        methods.insert("/" + file->service(s)->full_name() + "/" + file->service(s)->method(m)->name());
  return methods;
}

}  // namespace

TEST_CASE("every method of every service has its role") {
  const auto methods = allMethods();
  REQUIRE(methods.size() >= 18);
  for (const auto& method : methods) {
    INFO(method << " has no line in the table of server/security/roles.cpp");
    CHECK(requirementOf(method).who == Who::kRole);
  }
}

TEST_CASE("the roles of methods") {
  CHECK(requirementOf("/shaped.v1.Models/Get").roles == std::vector{Role::kRead});
  CHECK(requirementOf("/shaped.v1.Models/Delete").roles == std::vector{Role::kAdmin});
  CHECK(requirementOf("/shaped.v1.Models/Download").roles == std::vector{Role::kInfer});
  CHECK(requirementOf("/shaped.v1.Models/Upload").roles == std::vector{Role::kAdmin});
  CHECK(requirementOf("/shaped.v1.Datasets/Upload").roles == std::vector{Role::kTrain});
  CHECK(requirementOf("/shaped.v1.Jobs/Watch").roles == std::vector{Role::kRead});
  CHECK(requirementOf("/shaped.v1.Jobs/Cancel").roles == std::vector{Role::kTrain, Role::kInfer});
  CHECK(requirementOf("/shaped.v1.Jobs/FitMarkers").roles == std::vector{Role::kInfer});
  CHECK(requirementOf("/shaped.v1.Jobs/GetResult").roles == std::vector{Role::kInfer});
  CHECK(requirementOf("/shaped.v1.Shapes/FitMarkers").roles == std::vector{Role::kInfer});
  CHECK(requirementOf("/grpc.health.v1.Health/Check").who == Who::kEverybody);
  CHECK(requirementOf("/grpc.reflection.v1alpha.ServerReflection/ServerReflectionInfo").who == Who::kClients);
}

TEST_CASE("a method without a line is for nobody, however it is spelled") {
  for (const auto* method : {"", "/", "/shaped.v1.Models/New", "/shaped.v1.Models/list", "shaped.v1.Models/List",
                             "/shaped.v1.Models/List/", "//shaped.v1.Models/List", "/shaped.v2.Models/List"})
    CHECK(requirementOf(method).who == Who::kNobody);
}

TEST_CASE("roles include one another as documented") {
  const auto holds = [](Role given, Role wanted) {
    Roles roles;
    roles.add(given);
    return roles.holds(wanted);
  };
  for (const auto role : {Role::kRead, Role::kInfer, Role::kTrain, Role::kAdmin}) {
    CHECK(holds(role, role));
    CHECK(holds(role, Role::kRead));
    CHECK(holds(Role::kAdmin, role));
    CHECK(roleNamed(nameOf(role)) == role);
  }
  CHECK_FALSE(holds(Role::kRead, Role::kInfer));
  CHECK_FALSE(holds(Role::kInfer, Role::kTrain));
  CHECK_FALSE(holds(Role::kTrain, Role::kInfer));
  CHECK_FALSE(holds(Role::kTrain, Role::kAdmin));
  CHECK_FALSE(Roles().holds(Role::kRead));
  CHECK_FALSE(roleNamed("root"));
}
