#include "server/security/access.h"

#include <catch2/catch.hpp>

#include "core/io/sha256.h"
#include "core/numerics/error.h"

using namespace shaped;
using namespace shaped::server;
using Catch::Contains;

namespace {

std::string entry(const std::string& name, const std::string& token, const std::string& roles,
                  const std::string& more = "") {
  return R"({"name": ")" + name + R"(", "sha256": ")" + sha256(token) + R"(", "roles": [)" + roles + "]" + more + "}";
}

std::string tokens(const std::string& entries) { return R"({"tokens": [)" + entries + "]}"; }

constexpr char kList[] = "/shaped.v1.Models/List", kProject[] = "/shaped.v1.Shapes/Project",
               kHealth[] = "/grpc.health.v1.Health/Check",
               kReflection[] = "/grpc.reflection.v1alpha.ServerReflection/ServerReflectionInfo";

}  // namespace

TEST_CASE("a tokens file is read") {
  const TokenTable table(R"({"tokens": [)" + entry("a", "one", R"("infer")", R"(, "expires": "2020-01-31T00:00:00Z")") +
                         "," + entry("b", "two", R"("read", "train")") + R"(], "certificates": {"farm": ["admin"]}})");
  CHECK(table.size() == 3);
  REQUIRE(table.byToken("one"));
  CHECK(table.byToken("one")->name == "a");
  CHECK(table.byToken("one")->roles.holds(Role::kInfer));
  CHECK(table.byToken("one")->expired(std::chrono::system_clock::now()));
  CHECK_FALSE(table.byToken("two")->expired(std::chrono::system_clock::now()));
  CHECK(table.byCertificate("farm")->roles.holds(Role::kAdmin));
  CHECK_FALSE(table.byToken("three"));
  CHECK_FALSE(table.byToken(""));
  CHECK_FALSE(table.byToken(sha256("one")));  // the hash is no token
  CHECK_FALSE(table.byCertificate("a"));
  CHECK(TokenTable("{}").size() == 0);
}

TEST_CASE("faulty tokens files are refused by entry, and hashes are not quoted") {
  const auto refused = [](const std::string& text, const std::string& reason) {
    CHECK_THROWS_WITH(TokenTable(text), Contains(reason) && !Contains(sha256("one")));
  };
  refused("", "is no JSON document");
  refused(tokens(entry("a", "one", R"("read")")).substr(1), "is no JSON document");
  refused("[]", "must be a JSON object");
  refused(R"({"token": []})", "\"token\" is no key");
  refused(R"({"tokens": {}})", "tokens: must be a list");
  refused(R"({"tokens": [7]})", "tokens[0]: must be a JSON object");
  refused(R"({"tokens": [{"name": "a", "roles": ["read"]}]})", "tokens[0].sha256: must be there");
  refused(R"({"tokens": [{"name": "a", "sha256": "abc", "roles": ["read"]}]})", "64 lower-case hexadecimal digits");
  refused(tokens(entry("", "one", R"("read")")), "tokens[0].name: must be there");
  refused(tokens(entry("a", "one", "")), "tokens[0].roles: must be a list of roles");
  refused(tokens(entry("a", "one", R"("root")")), "\"root\" is no role");
  refused(tokens(entry("a", "one", "7")), "7 is no role");
  refused(tokens(entry("a", "one", R"("read")", R"(, "expires": "tomorrow")")), "tokens[0].expires: \"tomorrow\"");
  refused(tokens(entry("a", "one", R"("read")", R"(, "expires": 7)")), "is no time");
  refused(tokens(entry("a", "one", R"("read")", R"(, "token": "one")")), "\"token\" is no key");
  refused(tokens(entry("a", "one", R"("read")") + "," + entry("a", "two", R"("read")")), "tokens[1].name: \"a\"");
  refused(tokens(entry("a", "one", R"("read")") + "," + entry("b", "one", R"("read")")), "tokens[1].sha256: is that");
  refused(R"({"certificates": ["farm"]})", "certificates: must be an object");
  refused(R"({"certificates": {"farm": "read"}})", "certificates.farm: must be a list");
}

TEST_CASE("calls are judged by token and role") {
  Access access;
  access.use(TokenTable(tokens(entry("reader", "one", R"("read")") + "," +
                               entry("old", "two", R"("admin")", R"(, "expires": "2020-01-31T00:00:00Z")"))));
  const auto codeFor = [&](const std::string& method, const std::string& authorization) {
    return access.judge(method, {authorization, {}}).error_code();
  };
  CHECK(codeFor(kList, "Bearer one") == grpc::OK);
  CHECK(codeFor(kList, "bearer one") == grpc::OK);
  CHECK(codeFor(kProject, "Bearer one") == grpc::PERMISSION_DENIED);
  CHECK(codeFor("/shaped.v1.Models/New", "Bearer one") == grpc::PERMISSION_DENIED);
  CHECK(codeFor(kHealth, "") == grpc::OK);
  CHECK(codeFor(kReflection, "") == grpc::UNAUTHENTICATED);
  CHECK(codeFor(kReflection, "Bearer one") == grpc::OK);
  for (const auto* faulty : {"", "one", "Bearer", "Bearer ", "Bearer  one", "Bearer one ", "Basic one", "Bearer two"})
    CHECK(codeFor(kList, faulty) == grpc::UNAUTHENTICATED);
  // The answer does not tell an expired token from an unknown one.
  CHECK(access.judge(kList, {"Bearer two", {}}).error_message() ==
        access.judge(kList, {"Bearer x", {}}).error_message());
  const auto denied = access.judge(kProject, {"Bearer one", {}}).error_message();
  CHECK_THAT(denied, Contains("Shapes.Project") && Contains("\"infer\"") && Contains("\"reader\""));
  CHECK(access.denials() ==
        std::map<grpc::StatusCode, std::uint64_t>{{grpc::UNAUTHENTICATED, 11}, {grpc::PERMISSION_DENIED, 3}});
  CHECK(access.holds({"Bearer one", {}}, Role::kRead));
  CHECK_FALSE(access.holds({"Bearer one", {}}, Role::kTrain));
  CHECK_FALSE(access.holds({"Bearer x", {}}, Role::kRead));
  CHECK(access.nameOf({"Bearer one", {}}) == "reader");
  CHECK(access.nameOf({"Bearer x", {}}).empty());
}

TEST_CASE("certificates count where the tokens file names them, and everywhere without one") {
  Access access;
  CHECK(access.judge("/shaped.v1.Models/Delete", {{}, "anyone"}).ok());
  CHECK(access.nameOf({{}, "anyone"}) == "anyone");
  access.use(
      TokenTable(R"({"tokens": [)" + entry("a", "one", R"("infer")") + R"(], "certificates": {"farm": ["read"]}})"));
  CHECK(access.judge(kList, {{}, "farm"}).ok());
  CHECK(access.judge(kProject, {{}, "farm"}).error_code() == grpc::PERMISSION_DENIED);
  CHECK(access.judge(kList, {{}, "anyone"}).error_code() == grpc::UNAUTHENTICATED);
  // A token that is brought counts, for better and for worse.
  CHECK(access.judge(kProject, {"Bearer one", "farm"}).ok());
  CHECK(access.judge(kList, {"Bearer x", "farm"}).error_code() == grpc::UNAUTHENTICATED);
}
