#include <google/protobuf/util/time_util.h>
#include <openssl/rand.h>

#include <array>
#include <iostream>
#include <sstream>
#include <stdexcept>

#include "client/shapectl/numbers.h"
#include "client/shapectl/output.h"
#include "client/shapectl/verbs/verbs.h"
#include "core/io/sha256.h"

namespace shaped::shapectl {
namespace {

/// 256 random bits as 43 characters of A-Z a-z 0-9 - _, after a prefix by which scanners for leaked secrets know it.
std::string randomToken() {
  constexpr std::string_view digits = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789-_";
  std::array<unsigned char, 43> bytes{};
  if (RAND_bytes(bytes.data(), static_cast<int>(bytes.size())) != 1)
    throw std::runtime_error("this machine gives no random numbers");
  std::string token = "shaped_";
  for (const auto byte : bytes) token += digits[byte & 63];
  return token;
}

struct Token {
  std::string name, roles = "read,infer";
  std::int64_t days = 0;

  void declare(Arguments& arguments) {
    arguments.positional("NAME", name, "Who will call with it; stands in the daemon's log");
    arguments.option("--roles", roles, "R,R", "What it allows: read, infer, train, admin (read,infer)");
    arguments.option("--days", days, "N", "How long it is good (for ever)");
  }

  ExitCode run(const Session& session) const {
    const auto token = randomToken();
    nlohmann::json entry{{"name", name}, {"sha256", sha256(token)}, {"roles", roleList()}};
    if (countOf("--days", days) > 0) entry["expires"] = timeText(expiry());
    if (session.json)
      printJson({{"token", token}, {"entry", entry}});
    else
      std::cout << "The token, for the client only; it is kept nowhere and shown only now:\n  " << token
                << "\nThe entry, for \"tokens\" in the daemon's --tokens file:\n  " << entry.dump() << "\n";
    return ExitCode::kSuccess;
  }

 private:
  nlohmann::json roleList() const {
    auto list = nlohmann::json::array();
    std::istringstream words(roles);
    for (std::string role; std::getline(words, role, ',');) {
      if (role != "read" && role != "infer" && role != "train" && role != "admin")
        throw InvalidInput("--roles", "\"" + role + "\" is no role; use read, infer, train, admin");
      list.push_back(role);
    }
    if (list.empty()) throw InvalidInput("--roles", "is empty; use read, infer, train, admin");
    return list;
  }

  google::protobuf::Timestamp expiry() const {
    using google::protobuf::util::TimeUtil;
    constexpr std::int64_t day = 24 * 60 * 60;
    return TimeUtil::SecondsToTimestamp(TimeUtil::TimestampToSeconds(TimeUtil::GetCurrentTime()) + days * day);
  }
};

}  // namespace

Verb tokenVerb() { return makeVerb<Token>("token", "Make a token for a client of a daemon (needs no daemon)"); }

}  // namespace shaped::shapectl
