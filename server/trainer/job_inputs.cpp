#include "server/trainer/job_inputs.h"

#include "core/io/sha256.h"
#include "core/io/tensor_file.h"
#include "core/numerics/error.h"

namespace shaped::server {
namespace {

/// Calls read() and says in which file what it finds wrong is.
template <class Read>
auto inFile(const std::filesystem::path& path, const Read& read) {
  try {
    return read();
  } catch (const InvalidInput& error) {
    const std::string text = error.what();
    if (text.starts_with(path.string())) throw;
    throw InvalidInput(path.string(), text);
  }
}

Vertices positions(const TensorFile& file, const char* name) {
  if (file.type(name) == TensorType::kFloat32) return file.matrix<float>(name, -1, 3).cast<double>();
  return file.matrix<double>(name, -1, 3);
}

using References = std::map<std::string, std::shared_ptr<const FieldReference>>;

std::shared_ptr<const FieldReference> readReference(const TensorFile& file, const std::stop_token& stop) {
  const auto shape = positions(file, "shape");
  const auto topology = std::make_shared<const Topology>(static_cast<std::int32_t>(shape.rows()),
                                                         Faces(file.matrix<std::int32_t>("faces", -1, 3)));
  auto reference = makeFieldReference(topology, shape, stop);
  return reference ? std::make_shared<const FieldReference>(std::move(*reference)) : nullptr;
}

FieldPair readPair(const TensorFile& file, std::shared_ptr<const FieldReference> reference,
                   const FieldScaling& scaling) {
  Scan scan{positions(file, "scan"), {}, {}};
  if (file.has("scan_normals")) scan.normals = positions(file, "scan_normals");
  return makeFieldPair(std::move(reference), positions(file, "source"), positions(file, "target"), scan, scaling);
}

}  // namespace

std::optional<JobInputs> readJobInputs(const std::filesystem::path& folder, const JobSpec& spec,
                                       const std::stop_token& stop) {
  Sha256 hash;
  const auto open = [&](const std::filesystem::path& path, const auto& read) {
    return inFile(path, [&] {
      const TensorFile file(path);
      hash.update(file.bytes());
      return read(file);
    });
  };
  References references;
  for (const auto& [name, file] : spec.references) {
    references[name] = open(folder / file, [&](const TensorFile& tensors) { return readReference(tensors, stop); });
    if (!references[name]) return std::nullopt;
  }
  JobInputs inputs;
  inputs.scaling = scalingOf(*references.at(spec.scaling));
  for (const auto& pair : spec.pairs) {
    if (stop.stop_requested()) return std::nullopt;
    inputs.pairs.push_back(open(folder / pair.file, [&](const TensorFile& tensors) {
      return readPair(tensors, references.at(pair.reference), inputs.scaling);
    }));
  }
  inputs.sha256 = hash.finish();
  return inputs;
}

}  // namespace shaped::server
