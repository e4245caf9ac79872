#include "core/io/asf.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
#include <ranges>
#include <set>

#include "core/io/file.h"
#include "core/io/length_unit.h"
#include "core/numerics/error.h"

namespace shaped {
namespace {

/// One bone as the file says it, in its units.
struct Bone {
  std::string name;
  Eigen::RowVector3d direction = Eigen::RowVector3d::Zero();
  double length = 0;
  Eigen::Vector3d angles = Eigen::Vector3d::Zero();  ///< of `axis`
  std::string order = "XYZ";                         ///< the axis that each of them is about
  std::vector<MotionChannel> channels;
};

/// The file's content before it is put together.
struct Document {
  std::vector<Bone> bones;                         ///< [0] is the root
  std::vector<std::vector<std::size_t>> children;  ///< of each bone
  double metres_per_unit = 0, radians_per_unit = std::numbers::pi / 180;
};

class AsfReader {
 public:
  AsfReader(const std::string& file, std::string_view text) : scanner_(file, text) {
    Bone root;
    root.name = "root";
    document_.bones.push_back(root);
    index_["root"] = 0;
  }

  Document read() {
    bool more = nextLine();
    while (more) {
      const auto section = scanner_.word();
      if (section == ":units")
        more = readUnits();
      else if (section == ":root")
        more = readRoot();
      else if (section == ":bonedata")
        more = readBones();
      else if (section == ":hierarchy")
        more = readHierarchy();
      else if (section.starts_with(":"))
        more = skipSection();
      else
        scanner_.fail(quotedWord(section) + " stands where a section such as :bonedata should");
    }
    requireWhole();
    return std::move(document_);
  }

 private:
  bool nextLine() { return scanner_.nextContentLine('#'); }

  /// Whether the scanner, on a new line, stands at the next section.
  bool atSection() const {
    const auto line = scanner_.restOfLine();
    return line[line.find_first_not_of(" \t")] == ':';
  }

  bool skipSection() {
    while (nextLine())
      if (atSection()) return true;
    return false;
  }

  double finite(const char* what) {
    const double value = scanner_.number(what);
    if (!std::isfinite(value)) scanner_.fail(std::string(what) + " is not finite");
    return value;
  }

  Eigen::Vector3d vector(const char* what) {
    Eigen::Vector3d result;
    for (double& x : result) x = finite(what);
    return result;
  }

  bool readUnits() {
    while (nextLine()) {
      if (atSection()) return true;
      const auto field = scanner_.word();
      if (field == "length")
        readLength();
      else if (field == "angle")
        readAngle();
    }
    return false;
  }

  void readLength() {
    const double length = finite("the length unit");
    document_.metres_per_unit = *metresPer("inch") / length;
    if (!(document_.metres_per_unit > 0) || !std::isfinite(document_.metres_per_unit))
      scanner_.fail("length must be above 0");
  }

  void readAngle() {
    const auto unit = scanner_.word();
    if (unit != "deg" && unit != "rad") scanner_.fail("angle is " + quotedWord(unit) + "; want deg or rad");
    document_.radians_per_unit = unit == "deg" ? std::numbers::pi / 180 : 1;
  }

  bool readRoot() {
    std::string order = "XYZ";
    bool more = false;
    while (nextLine()) {
      more = atSection();
      if (more) break;
      const auto field = scanner_.word();
      if (field == "order")
        readChannels(document_.bones[0], true);
      else if (field == "axis")
        order = readOrder();
      else if (field == "position" || field == "orientation")
        requireOrigin(field);
      else
        scanner_.fail(quotedWord(field) + " is unknown; want order, axis, position or orientation");
    }
    std::string turns;
    for (const auto& channel : document_.bones[0].channels)
      if (channel.turns) turns += static_cast<char>('X' + channel.axis);
    if (!turns.empty() && turns != order)
      scanner_.fail("the root turns in the order " + turns + ", and its axis says " + order);
    return more;
  }

  void requireOrigin(std::string_view field) {
    const std::string name(field);
    if (!vector(name.c_str()).isZero(0))
      scanner_.fail("the root's " + name + " is not 0 0 0; nothing else is understood");
  }

  /// Three axes, each once.
  std::string readOrder() {
    const auto word = scanner_.word();
    std::string sorted(word);
    std::sort(sorted.begin(), sorted.end());
    if (sorted != "XYZ") scanner_.fail("the order of the axes is " + quotedWord(word) + "; want XYZ, ZYX and the like");
    return std::string(word);
  }

  /// The rest of the line: rx, TY and the like, each once.
  void readChannels(Bone& bone, bool shifts) {
    if (!bone.channels.empty()) scanner_.fail("a second list of what bone " + quotedWord(bone.name) + " may do");
    for (auto word = scanner_.word(); !word.empty(); word = scanner_.word()) {
      const char kind = static_cast<char>(word[0] | ' '),
                 axis = word.size() == 2 ? static_cast<char>(word[1] | ' ') : ' ';
      if ((kind != 'r' && !(kind == 't' && shifts)) || axis < 'x' || axis > 'z')
        scanner_.fail("bone " + quotedWord(bone.name) + " may do " + quotedWord(word) + "; want " +
                      (shifts ? "TX, TY, TZ, RX, RY, RZ" : "rx, ry, rz: bones neither move nor stretch"));
      const MotionChannel channel{kind == 'r', axis - 'x'};
      for (const auto& other : bone.channels)
        if (other.turns == channel.turns && other.axis == channel.axis)
          scanner_.fail(quotedWord(word) + " occurs twice");
      bone.channels.push_back(channel);
    }
  }

  bool readBones() {
    while (nextLine()) {
      if (atSection()) return true;
      if (const auto word = scanner_.word(); word != "begin")
        scanner_.fail(quotedWord(word) + " stands where begin should");
      readBone();
    }
    return false;
  }

  void readBone() {
    Bone bone;
    while (nextLine()) {
      const auto field = scanner_.word();
      if (field == "end") return addBone(std::move(bone));
      readField(field, bone);
    }
    scanner_.fail("the file ends within a bone");
  }

  void readField(std::string_view field, Bone& bone) {
    if (field == "name") {
      bone.name = scanner_.word();
    } else if (field == "direction") {
      bone.direction = vector("a direction of three numbers").transpose();
    } else if (field == "length") {
      bone.length = finite("the length");
      if (bone.length < 0) scanner_.fail("a length is below 0");
    } else if (field == "axis") {
      bone.angles = vector("three angles of the axis");
      bone.order = readOrder();
    } else if (field == "dof") {
      readChannels(bone, false);
    } else if (field != "id" && field != "limits" && field != "bodymass" && field != "cofmass" && field[0] != '(') {
      scanner_.fail(quotedWord(field) + " is unknown; want id, name, direction, length, axis, dof or limits");
    }
  }

  void addBone(Bone bone) {
    if (bone.name.empty()) scanner_.fail("a bone has no name");
    if (!index_.try_emplace(bone.name, document_.bones.size()).second)
      scanner_.fail("the name " + quotedWord(bone.name) + " occurs twice");
    const double norm = bone.direction.stableNorm();
    if (bone.length > 0 && !(norm > 0 && std::isfinite(norm)))
      scanner_.fail("bone " + quotedWord(bone.name) + " has a length and no direction");
    if (norm > 0) bone.direction /= norm;
    document_.bones.push_back(std::move(bone));
  }

  bool readHierarchy() {
    document_.children.resize(document_.bones.size());
    while (nextLine()) {
      if (atSection()) return true;
      const auto parent = scanner_.word();
      if (parent == "begin" || parent == "end") continue;
      for (auto child = scanner_.word(); !child.empty(); child = scanner_.word()) addChild(parent, child);
    }
    return false;
  }

  void addChild(std::string_view parent, std::string_view child) {
    const auto bone = indexOf(child);
    if (bone == 0) scanner_.fail("the root hangs on " + quotedWord(parent));
    if (!has_parent_.insert(bone).second) scanner_.fail("bone " + quotedWord(child) + " hangs on two");
    document_.children[indexOf(parent)].push_back(bone);
  }

  std::size_t indexOf(std::string_view name) {
    const auto found = index_.find(std::string(name));
    if (found == index_.end() || found->second >= document_.children.size())
      scanner_.fail("there is no bone " + quotedWord(name) + " in :bonedata above");
    return found->second;
  }

  void requireWhole() {
    if (document_.metres_per_unit == 0) scanner_.fail("the file has no :units with a length");
    if (document_.bones[0].channels.empty()) scanner_.fail("the file has no :root with an order");
    if (document_.bones.size() == 1) scanner_.fail("the file has no bones in :bonedata");
    document_.children.resize(document_.bones.size());
    for (std::size_t b = 1; b < document_.bones.size(); ++b)
      if (!has_parent_.contains(b))
        scanner_.fail("bone " + quotedWord(document_.bones[b].name) + " hangs on nothing in :hierarchy");
  }

  TextScanner scanner_;
  Document document_;
  std::map<std::string, std::size_t> index_;  ///< of the bones by their names
  std::set<std::size_t> has_parent_;
};

Eigen::Matrix3d axesOf(const Bone& bone, double radians_per_unit) {
  Eigen::Matrix3d axes = Eigen::Matrix3d::Identity();
  for (Eigen::Index i = 0; i < 3; ++i)
    axes = axisTurn(bone.order[static_cast<std::size_t>(i)] - 'X', bone.angles[i] * radians_per_unit) * axes;
  return axes;
}

/// A bone with the joint that carries it.
struct Placed {
  std::size_t bone;
  std::int32_t parent;
};

std::vector<Placed> depthFirst(const Document& document) {
  std::vector<Placed> order, waiting{{0, -1}};
  while (!waiting.empty()) {
    const auto next = waiting.back();
    waiting.pop_back();
    const auto joint = static_cast<std::int32_t>(order.size());
    order.push_back(next);
    const auto& below = document.children[next.bone];
    for (const auto child : std::views::reverse(below)) waiting.push_back({child, joint});
  }
  return order;
}

AcclaimSkeleton assemble(const std::string& file, const Document& document) {
  const auto order = depthFirst(document);
  if (order.size() != document.bones.size()) throw InvalidInput(file, "has bones that hang on each other in a ring");
  const auto count = static_cast<Eigen::Index>(order.size());
  Vertices begins = Vertices::Zero(count, 3), ends = Vertices::Zero(count, 3);
  std::vector<Joint> joints;
  std::vector<AcclaimBone> bones;
  for (const auto& [index, parent] : order) {
    const Bone& bone = document.bones[index];
    const auto row = static_cast<Eigen::Index>(joints.size());
    if (parent >= 0) begins.row(row) = ends.row(parent);
    ends.row(row) = begins.row(row) + bone.length * document.metres_per_unit * bone.direction;
    if (!ends.row(row).allFinite())
      throw InvalidInput(file, "has lengths that overflow at bone " + quotedWord(bone.name));
    joints.push_back({bone.name, parent});
    bones.push_back({axesOf(bone, document.radians_per_unit), bone.channels});
  }
  return {Skeleton(std::move(joints)), begins, ends, std::move(bones), document.metres_per_unit,
          document.radians_per_unit};
}

}  // namespace

AcclaimSkeleton parseAsf(const std::string& file, std::string_view text) {
  return assemble(file, AsfReader(file, text).read());
}

AcclaimSkeleton readAsf(const std::filesystem::path& path) { return parseAsf(path.string(), readFile(path)); }

}  // namespace shaped
