#include "server/trainer/job_spec.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <set>

#include "core/io/file.h"
#include "core/io/json_fields.h"
#include "core/numerics/error.h"

namespace shaped::server {
namespace {

using nlohmann::json;

/// The fields of one object of the file: each is asked for by name, and what nobody asked for is an error.
class Fields {
 public:
  Fields(const json& object, std::string name) : object_(object), name_(std::move(name)) {
    if (!object.is_object()) throw InvalidInput(name_, "must be an object");
  }

  const json* find(const char* field) {
    known_.insert(field);
    const auto found = object_.find(field);
    return found == object_.end() ? nullptr : &*found;
  }

  const json& require(const char* field) {
    if (const auto* found = find(field)) return *found;
    throw InvalidInput(of(field), "is missing");
  }

  std::string text(const char* field) {
    const auto& found = require(field);
    if (!found.is_string()) throw InvalidInput(of(field), "must be a text");
    return found.get<std::string>();
  }

  void read(const char* field, double& value) {
    const auto* found = find(field);
    if (!found) return;
    if (!found->is_number()) throw InvalidInput(of(field), "must be a number");
    value = found->get<double>();
  }

  void read(const char* field, int& value) {
    if (!find(field)) return;
    const auto number = wholeNumber(object_, field, 0, std::numeric_limits<int>::max());
    if (!number) throw InvalidInput(of(field), "must be a whole number from 0 to 2147483647");
    value = static_cast<int>(*number);
  }

  void read(const char* field, std::uint64_t& value) {
    if (!find(field)) return;
    const auto number = wholeNumber(object_, field, 0, std::numeric_limits<std::int64_t>::max());
    if (!number) throw InvalidInput(of(field), "must be a whole number >= 0");
    value = static_cast<std::uint64_t>(*number);
  }

  void read(const char* field, bool& value) {
    const auto* found = find(field);
    if (!found) return;
    if (!found->is_boolean()) throw InvalidInput(of(field), "must be true or false");
    value = found->get<bool>();
  }

  void read(const char* field, std::vector<int>& values) {
    const auto* found = find(field);
    if (!found) return;
    const auto small = [](const json& item) {
      return item.is_number_integer() && item >= 0 && item <= std::numeric_limits<int>::max();
    };
    if (!found->is_array() || !std::all_of(found->begin(), found->end(), small))
      throw InvalidInput(of(field), "must be an array of whole numbers");
    values = found->get<std::vector<int>>();
  }

  void refuseOthers() const {
    for (const auto& [field, value] : object_.items())
      if (!known_.contains(field)) throw InvalidInput(of(field), "is no field of a job");
  }

  std::string of(const std::string& field) const { return name_ + (name_.ends_with(": ") ? "" : ".") + field; }

 private:
  const json& object_;
  std::string name_;
  std::set<std::string> known_;
};

/// A name within the folder, so that a job cannot read or write elsewhere.
std::string requireFileName(const json& value, const std::string& field) {
  const auto name = value.is_string() ? value.get<std::string>() : "";
  if (name.empty() || name.front() == '.' || name.find('/') != std::string::npos ||
      name.find('\0') != std::string::npos)
    throw InvalidInput(field, "must be the name of a file in the folder");
  return name;
}

void readReferences(Fields& job, JobSpec& spec) {
  const auto& references = job.require("references");
  if (!references.is_object() || references.empty())
    throw InvalidInput(job.of("references"), "must be an object of at least one name and file");
  for (const auto& [name, file] : references.items())
    spec.references[name] = requireFileName(file, job.of("references." + name));
}

void requireReference(const JobSpec& spec, const std::string& name, const std::string& field) {
  if (!spec.references.contains(name)) throw InvalidInput(field, "\"" + name + "\" is none of the references");
}

void readPairs(Fields& job, JobSpec& spec) {
  const auto& pairs = job.require("pairs");
  if (!pairs.is_array() || pairs.empty()) throw InvalidInput(job.of("pairs"), "must be an array of at least one pair");
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    Fields pair(pairs[i], job.of("pairs[" + std::to_string(i) + "]"));
    spec.pairs.push_back({pair.text("reference"), requireFileName(pair.require("file"), pair.of("file"))});
    requireReference(spec, spec.pairs.back().reference, pair.of("reference"));
    pair.refuseOthers();
  }
}

void readArchitecture(Fields& job, FieldArchitecture& architecture) {
  const auto* found = job.find("architecture");
  if (!found) return;
  Fields fields(*found, job.of("architecture"));
  fields.read("source_net", architecture.source_net);
  fields.read("scan_net", architecture.scan_net);
  fields.read("mlp", architecture.mlp);
  fields.read("offsets", architecture.offsets);
  fields.refuseOthers();
}

void readOptions(Fields& job, FieldTrainingOptions& options) {
  const auto* found = job.find("options");
  if (!found) return;
  Fields fields(*found, job.of("options"));
  fields.read("epochs", options.epochs);
  fields.read("batch", options.batch);
  fields.read("learning_rate", options.learning_rate);
  fields.read("last_learning_rate", options.last_learning_rate);
  fields.read("warm_up", options.warm_up);
  fields.read("vertex_weight", options.vertex_weight);
  fields.read("jacobian_weight", options.jacobian_weight);
  fields.read("seed", options.seed);
  fields.refuseOthers();
}

void requireInRange(const JobSpec& spec, const Fields& job) {
  if (const auto violation = spec.architecture.firstViolation()) throw InvalidInput(job.of("architecture"), *violation);
  if (const auto violation = spec.options.firstViolation()) throw InvalidInput(job.of("options"), *violation);
  if (spec.threads < 1) throw InvalidInput(job.of("threads"), "must be >= 1");
  if (!(spec.checkpoint_seconds >= 0)) throw InvalidInput(job.of("checkpoint_seconds"), "must be >= 0");
}

}  // namespace

std::string JobSpec::training() const {
  json pair_list = json::array();
  for (const auto& [reference, file] : pairs) pair_list.push_back({reference, file});
  return json{
      {"references", references},
      {"pairs", pair_list},
      {"scaling", scaling},
      {"architecture", {architecture.source_net, architecture.scan_net, architecture.mlp, architecture.offsets}},
      {"options",
       {options.epochs, options.batch, options.learning_rate, options.last_learning_rate, options.warm_up,
        options.vertex_weight, options.jacobian_weight, options.seed}}}
      .dump();
}

JobSpec readJobSpec(const std::filesystem::path& folder) {
  const auto path = folder / "job.json";
  const auto document = parseJson(path.string(), readFile(path));
  Fields job(document, path.string() + ": ");
  JobSpec spec;
  if (const auto kind = job.text("kind"); kind != "jacobian_field")
    throw InvalidInput(job.of("kind"), "is \"" + kind + "\", want \"jacobian_field\"");
  readReferences(job, spec);
  readPairs(job, spec);
  spec.scaling = job.find("scaling") ? job.text("scaling") : spec.pairs.front().reference;
  requireReference(spec, spec.scaling, job.of("scaling"));
  readArchitecture(job, spec.architecture);
  readOptions(job, spec.options);
  job.read("threads", spec.threads);
  job.read("checkpoint_seconds", spec.checkpoint_seconds);
  job.refuseOthers();
  requireInRange(spec, job);
  return spec;
}

}  // namespace shaped::server
