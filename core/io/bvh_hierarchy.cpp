#include "core/io/bvh_hierarchy.h"

#include <algorithm>
#include <cctype>
#include <optional>
#include <set>

namespace shaped {
namespace {

constexpr std::int32_t kEndSite = -1;

std::string lowered(std::string_view word) {
  std::string result;
  for (const char c : word) result += static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  return result;
}

/// Where a joint is while its braces are open.
struct Open {
  std::int32_t joint;  ///< kEndSite for an end site
  bool has_offset = false;
};

class HierarchyReader {
 public:
  explicit HierarchyReader(TextScanner& scanner) : scanner_(scanner) {}

  std::vector<BvhJoint> read() {
    if (lowered(nextWord()) != "hierarchy") scanner_.fail("a BVH file begins with HIERARCHY");
    for (auto word = nextWord(); lowered(word) != "motion"; word = nextWord()) readItem(word);
    if (!open_.empty()) scanner_.fail("MOTION begins before every { has its }");
    if (joints_.empty()) scanner_.fail("MOTION begins before there is a ROOT");
    return std::move(joints_);
  }

 private:
  /// The next word, of this line or one after it.
  std::string_view nextWord() {
    for (;;) {
      if (const auto word = scanner_.word(); !word.empty()) return word;
      if (!scanner_.nextLine()) scanner_.fail("the file ends within its hierarchy; want MOTION");
    }
  }

  void readItem(std::string_view word) {
    const auto keyword = lowered(word);
    if (keyword == "root" || keyword == "joint")
      beginJoint(keyword == "root");
    else if (keyword == "end")
      beginEndSite();
    else if (open_.empty())
      scanner_.fail(quotedWord(word) + " stands outside of a joint; want ROOT or MOTION");
    else if (keyword == "offset")
      readOffset();
    else if (keyword == "channels")
      readChannels();
    else if (keyword == "}")
      close();
    else
      scanner_.fail(quotedWord(word) + " is unknown; want JOINT, End Site, OFFSET, CHANNELS or }");
  }

  void beginJoint(bool root) {
    if (root != joints_.empty())
      scanner_.fail(root ? "a second ROOT; want one skeleton" : "a JOINT before there is a ROOT");
    if (!root && (open_.empty() || open_.back().joint == kEndSite))
      scanner_.fail("a JOINT must stand within the braces of a joint");
    auto name = readName();
    if (!names_.insert(name).second) scanner_.fail("the name " + quotedWord(name) + " occurs twice");
    joints_.push_back({std::move(name), root ? -1 : open_.back().joint, Eigen::RowVector3d::Zero(), {}});
    open_.push_back({static_cast<std::int32_t>(joints_.size()) - 1});
  }

  /// What is left of the line, which may hold blanks, and the brace on it or after it.
  std::string readName() {
    auto name = scanner_.fields('\0').front();
    const bool brace = name.ends_with('{');
    if (brace) name.remove_suffix(1);
    while (!name.empty() && (name.back() == ' ' || name.back() == '\t')) name.remove_suffix(1);
    if (name.empty()) scanner_.fail("a joint has no name");
    std::string kept(name);
    if (!brace) requireBrace();
    return kept;
  }

  void requireBrace() {
    if (const auto word = nextWord(); word != "{") scanner_.fail(quotedWord(word) + " stands where { should");
  }

  void beginEndSite() {
    if (open_.empty() || open_.back().joint == kEndSite) scanner_.fail("an End Site must stand within a joint");
    if (!scanner_.fields('\0').front().ends_with('{')) requireBrace();
    open_.push_back({kEndSite});
  }

  void readOffset() {
    Eigen::RowVector3d offset;
    for (double& x : offset) x = scanner_.number("an OFFSET of three numbers");
    requireLineEnd();
    if (!offset.allFinite()) scanner_.fail("the OFFSET is not finite");
    if (open_.back().has_offset) scanner_.fail("a second OFFSET for one joint");
    open_.back().has_offset = true;
    if (open_.back().joint != kEndSite) joint().offset = offset;
  }

  void readChannels() {
    if (open_.back().joint == kEndSite || !joint().channels.empty())
      scanner_.fail("CHANNELS that no joint needs: want one list a joint and none in an End Site");
    const auto count = scanner_.integer("the number of channels");
    if (count < 0 || count > 6) scanner_.fail("a joint has " + std::to_string(count) + " channels; want 0 to 6");
    for (std::int64_t i = 0; i < count; ++i) joint().channels.push_back(readChannel());
    requireLineEnd();
  }

  MotionChannel readChannel() {
    const auto word = scanner_.word();
    const auto name = lowered(word);
    const bool turns = name.ends_with("rotation"), known = turns || name.ends_with("position");
    const int axis = name.empty() ? -1 : name[0] - 'x';
    if (!known || name.size() != 9 || axis < 0 || axis > 2)
      scanner_.fail(quotedWord(word) + " is no channel; want Xposition, Yrotation and the like");
    for (const auto& channel : joint().channels)
      if (!turns && !channel.turns && channel.axis == axis)
        scanner_.fail("the channel " + quotedWord(word) + " occurs twice");
    return {turns, axis};
  }

  void requireLineEnd() {
    if (const auto word = scanner_.word(); !word.empty() && word != "}")
      scanner_.fail(quotedWord(word) + " is more than the line should hold");
    else if (word == "}")
      close();
  }

  void close() {
    if (!open_.back().has_offset) scanner_.fail("a joint or End Site closes without an OFFSET");
    open_.pop_back();
  }

  BvhJoint& joint() { return joints_[static_cast<std::size_t>(open_.back().joint)]; }

  TextScanner& scanner_;
  std::vector<BvhJoint> joints_;
  std::set<std::string> names_;
  std::vector<Open> open_;
};

}  // namespace

std::vector<BvhJoint> readBvhHierarchy(TextScanner& scanner) { return HierarchyReader(scanner).read(); }

}  // namespace shaped
