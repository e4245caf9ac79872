#include "core/io/rig_file.h"

#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>
#include <set>

#include "core/io/file.h"
#include "core/io/json_fields.h"
#include "core/io/length_unit.h"
#include "core/io/text_scanner.h"
#include "core/numerics/error.h"

namespace shaped {
namespace {

using nlohmann::json;

constexpr double kUnlimited = std::numeric_limits<double>::infinity();

/// A part of the document with its place for error texts.
struct Entry {
  const std::string& file;
  const json& value;
  std::string place;

  [[noreturn]] void fail(const std::string& problem) const { throw InvalidInput(file, place + " " + problem); }

  /// A list of exactly three numbers; where null_is is given, null stands for it.
  Eigen::RowVector3d vector(const char* field, std::optional<double> null_is = std::nullopt) const {
    const auto found = value.find(field);
    const std::string want = std::string("needs three numbers as ") + field;
    if (found == value.end() || !found->is_array() || found->size() != 3) fail(want);
    Eigen::RowVector3d numbers;
    for (std::size_t i = 0; i < 3; ++i) {
      const json& number = (*found)[i];
      if (!number.is_number() && !(number.is_null() && null_is)) fail(want);
      numbers[static_cast<Eigen::Index>(i)] = number.is_null() ? *null_is : number.get<double>();
    }
    return numbers;
  }
};

const json& list(const std::string& file, const json& document, const char* field) {
  const auto found = document.find(field);
  if (found == document.end() || !found->is_array())
    throw InvalidInput(file, std::string("has no list '") + field + "'");
  return *found;
}

double metresPerUnit(const std::string& file, const json& document) {
  const auto found = document.find("unit");
  if (found == document.end()) return 1;
  const auto metres = found->is_string() ? metresPer(found->get<std::string>()) : std::nullopt;
  if (!metres) throw InvalidInput(file, "unit is " + quotedWord(found->dump()) + "; want mm, cm, dm, m, in or ft");
  return *metres;
}

/// Index of the parent among the joints met so far; -1 for a root.
std::int32_t readParent(const Entry& entry, const std::vector<Joint>& before) {
  const auto found = entry.value.find("parent");
  if (found == entry.value.end() || found->is_null() || *found == -1) return -1;
  if (const auto index = wholeNumber(entry.value, "parent", 0, static_cast<std::int64_t>(before.size()) - 1))
    return static_cast<std::int32_t>(*index);
  for (std::size_t j = 0; j < before.size(); ++j)
    if (found->is_string() && before[j].name == found->get_ref<const std::string&>())
      return static_cast<std::int32_t>(j);
  entry.fail("has parent " + quotedWord(found->dump()) +
             ", want the name or index of a joint before it, or null for the root");
}

Joint readJoint(Entry& entry, const std::vector<Joint>& before) {
  const auto name = entry.value.is_object() ? entry.value.find("name") : entry.value.end();
  if (!entry.value.is_object() || name == entry.value.end() || !name->is_string() || *name == "")
    entry.fail("has no name");
  Joint joint{name->get<std::string>(), -1};
  entry.place += " (" + quotedWord(joint.name) + ")";
  joint.parent = readParent(entry, before);
  if (before.empty() != (joint.parent == -1))
    entry.fail(before.empty() ? "comes first and has a parent; want the root first"
                              : "has no parent; want one root, the first joint");
  return joint;
}

void readLimits(const Entry& entry, std::int32_t joint, std::int32_t joint_count, Rig& rig) {
  const auto found = entry.value.find("limits");
  if (found == entry.value.end()) return;
  if (!rig.limits)
    rig.limits =
        JointLimits{Vertices::Constant(joint_count, 3, -kUnlimited), Vertices::Constant(joint_count, 3, kUnlimited)};
  const Entry limits{entry.file, *found, entry.place + " limits"};
  const auto low = limits.vector("low", -kUnlimited), high = limits.vector("high", kUnlimited);
  if (!(low.array() <= high.array()).all()) limits.fail("have a low above its high");
  rig.limits->low.row(joint) = low;
  rig.limits->high.row(joint) = high;
}

/// The rig without its weights.
Rig readJoints(const std::string& file, const json& document) {
  const json& entries = list(file, document, "joints");
  if (entries.empty()) throw InvalidInput(file, "has no joints");
  const double metres = metresPerUnit(file, document);
  std::vector<Joint> joints;
  std::set<std::string> names;
  Rig rig{Skeleton({{"root", -1}}), Vertices(entries.size(), 3), {}, {}};
  for (const auto& value : entries) {
    Entry entry{file, value, "joints[" + std::to_string(joints.size()) + "]"};
    const auto joint = readJoint(entry, joints);
    if (!names.insert(joint.name).second) entry.fail("has the name of an earlier joint");
    const auto index = static_cast<std::int32_t>(joints.size());
    rig.rest_joints.row(index) = entry.vector("rest") * metres;
    if (!rig.rest_joints.row(index).allFinite()) entry.fail("has a rest position that is not finite");
    readLimits(entry, index, static_cast<std::int32_t>(entries.size()), rig);
    joints.push_back(joint);
  }
  rig.skeleton = Skeleton(std::move(joints));
  return rig;
}

/// One pair [joint, weight] of a vertex.
Eigen::Triplet<double> readPair(const Entry& vertex, const json& pair, std::int32_t row, std::int32_t joint_count) {
  if (!pair.is_array() || pair.size() != 2 || !pair[1].is_number()) vertex.fail("must be a list of [joint, weight]");
  if (!pair[0].is_number_integer() || pair[0] < 0 || pair[0] >= joint_count)
    vertex.fail("names joint " + quotedWord(pair[0].dump()) + ", outside [0, " + std::to_string(joint_count) + ")");
  const double weight = pair[1].get<double>();
  if (!std::isfinite(weight) || weight < 0)
    vertex.fail("gives joint " + pair[0].dump() + " the weight " + shortest(weight) + ", want one >= 0");
  return {row, pair[0].get<std::int32_t>(), weight};
}

SkinWeights readWeights(const std::string& file, const json& document, std::int32_t vertices, std::int32_t joints) {
  const json& lists = list(file, document, "weights");
  if (lists.size() != static_cast<std::size_t>(vertices))
    throw InvalidInput(file, "weights has lists for " + std::to_string(lists.size()) + " vertices, and the mesh has " +
                                 std::to_string(vertices));
  std::vector<Eigen::Triplet<double>> triplets;
  for (std::int32_t v = 0; v < vertices; ++v) {
    const json& pairs = lists[static_cast<std::size_t>(v)];
    const Entry vertex{file, pairs, "weights[" + std::to_string(v) + "]"};
    if (!pairs.is_array()) vertex.fail("must be a list of [joint, weight]");
    std::set<std::int32_t> seen;
    double sum = 0;
    for (const auto& pair : pairs) {
      triplets.push_back(readPair(vertex, pair, v, joints));
      if (!seen.insert(triplets.back().col()).second) vertex.fail("names joint " + pair[0].dump() + " twice");
      sum += triplets.back().value();
    }
    if (!(sum > 0)) vertex.fail("has no weight above 0: no bone carries this vertex");
    if (!std::isfinite(sum)) vertex.fail("has weights whose sum is not finite");
  }
  SkinWeights weights(vertices, joints);
  weights.setFromTriplets(triplets.begin(), triplets.end());
  return weights;
}

std::string quotedJson(const std::string& text) {
  return json(text).dump(-1, ' ', false, json::error_handler_t::replace);
}

std::string numbers(const Eigen::RowVector3d& row) {
  std::string text = "[";
  for (const double x : row) text += (text.size() > 1 ? ", " : "") + (std::isfinite(x) ? shortest(x) : "null");
  return text + "]";
}

std::string formatJoint(const Rig& rig, std::int32_t j) {
  const auto parent = rig.skeleton.parent(j);
  std::string text = "{\"name\": " + quotedJson(rig.skeleton.name(j)) +
                     ", \"parent\": " + (parent < 0 ? "null" : std::to_string(parent)) +
                     ", \"rest\": " + numbers(rig.rest_joints.row(j));
  if (rig.limits &&
      !(rig.limits->low.row(j).array() == -kUnlimited && rig.limits->high.row(j).array() == kUnlimited).all())
    text += ", \"limits\": {\"low\": " + numbers(rig.limits->low.row(j)) +
            ", \"high\": " + numbers(rig.limits->high.row(j)) + "}";
  return text + "}";
}

std::string formatVertex(const SkinWeights& weights, Eigen::Index vertex) {
  std::string text = "[";
  for (SkinWeights::InnerIterator entry(weights, vertex); entry; ++entry) {
    text += text.size() > 1 ? ", [" : "[";
    text += std::to_string(entry.col());
    text += ", " + shortest(entry.value()) + "]";
  }
  return text + "]";
}

}  // namespace

RigFile parseRig(const std::string& file, std::string_view text, std::int32_t vertex_count) {
  const auto document = parseJson(file, text);
  if (!document.is_object()) throw InvalidInput(file, "is no JSON object with 'joints' and 'weights'");
  Rig rig = readJoints(file, document);
  auto [weights, change] = normaliseWeights(readWeights(file, document, vertex_count, rig.skeleton.jointCount()));
  rig.weights = std::move(weights);
  return {std::move(rig), change};
}

RigFile readRig(const std::filesystem::path& path, std::int32_t vertex_count) {
  return parseRig(path.string(), readFile(path), vertex_count);
}

void writeRig(const std::filesystem::path& path, const Rig& rig) {
  rig.requireValid(static_cast<std::int32_t>(rig.weights.rows()));
  std::string text = "{\"unit\": \"m\",\n\"joints\": [\n";
  for (std::int32_t j = 0; j < rig.skeleton.jointCount(); ++j) text += (j > 0 ? ",\n" : "") + formatJoint(rig, j);
  text += "],\n\"weights\": [\n";
  for (Eigen::Index v = 0; v < rig.weights.rows(); ++v) text += (v > 0 ? ",\n" : "") + formatVertex(rig.weights, v);
  writeFile(path, text + "]}\n");
}

}  // namespace shaped
