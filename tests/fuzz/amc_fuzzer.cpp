#include "core/io/amc.h"
#include "tests/fuzz/fuzz.h"

using namespace shaped;
using namespace shaped::fuzz;

namespace {

constexpr const char* kSkeleton =
    ":units\n length 0.45\n angle deg\n:root\n order TX TY TZ RX RY RZ\n:bonedata\n"
    "begin\n name a\n direction 0 1 0\n length 1\n axis 10 20 30 XYZ\n dof rx ry rz\nend\n"
    "begin\n name b\n direction 0 1 0\n length 1\n axis 0 0 0 XYZ\n dof rz\nend\n"
    "begin\n name c\n direction 0 1 0\n length 1\nend\n:hierarchy\nbegin\nroot a c\na b\nend\n";

}  // namespace

FUZZ_TARGET(amc) {
  static const auto skeleton = parseAsf("skeleton.asf", kSkeleton);
  const auto clip = accepted<InvalidInput>([&] { return parseAmc("motion.amc", bytes, skeleton, 120); });
  if (!clip) return;
  require(!clip->frames.empty(), "there are frames");
  for (const auto& pose : clip->frames) {
    require(pose.rotations.rows() == 4 && pose.rotations.allFinite(), "rotations are finite");
    require(pose.translation.allFinite(), "translations are finite");
  }
}
