#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace shaped {

/// A joint: the place around which a bone turns.
struct Joint {
  std::string name;
  std::int32_t parent;  ///< the joint whose bone carries this one; -1 for the root
};

/// A tree of joints, parents before children; joint 0 is the root and the only one without a parent. Where the joints
/// lie is not part of it: that depends on the body (Rig, BodyModel).
class Skeleton {
 public:
  /// Throws InvalidInput naming `joints` and the index when there is no joint, the first one has a parent, another one
  /// has none or one that does not come before it, or a name is empty or occurs twice.
  explicit Skeleton(std::vector<Joint> joints);

  std::int32_t jointCount() const { return static_cast<std::int32_t>(joints_.size()); }
  const std::vector<Joint>& joints() const { return joints_; }
  std::int32_t parent(std::int32_t joint) const { return joints_[static_cast<std::size_t>(joint)].parent; }
  const std::string& name(std::int32_t joint) const { return joints_[static_cast<std::size_t>(joint)].name; }

  /// Index of the joint of that name, if there is one.
  std::optional<std::int32_t> find(std::string_view name) const;

 private:
  std::vector<Joint> joints_;
};

}  // namespace shaped
