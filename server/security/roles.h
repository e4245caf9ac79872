#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace shaped::server {

/// What a client may do. Every role includes kRead, for whoever projects or trains must see what there is; kAdmin
/// includes all. kInfer and kTrain do not include each other.
enum class Role { kRead, kInfer, kTrain, kAdmin };

/// "read", "infer", "train", "admin".
std::string nameOf(Role role);
/// Nothing for another name.
std::optional<Role> roleNamed(std::string_view name);

/// A set of roles, with all that they include.
class Roles {
 public:
  static Roles all();
  void add(Role role);
  bool holds(Role role) const;

 private:
  unsigned bits_ = 0;
};

/// Who may call a method.
struct Requirement {
  enum class Who {
    kEverybody,  ///< also without token and certificate
    kClients,    ///< whoever is known, whatever the roles
    kRole,       ///< who holds one of `roles`
    kNobody,     ///< a method without an entry in the table
  };
  Who who = Who::kNobody;
  std::vector<Role> roles = {};
};

/// The one table of methods and roles. method: "/shaped.v1.Models/List", as the wire has it.
Requirement requirementOf(std::string_view method);

}  // namespace shaped::server
