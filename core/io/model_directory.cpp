#include "core/io/model_directory.h"

#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <future>

#include "core/io/file.h"
#include "core/io/file_error.h"
#include "core/io/folder.h"
#include "core/io/sha256.h"
#include "core/io/text_scanner.h"

namespace shaped {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

constexpr std::int64_t kMostVersions = 1'000'000'000'000;
constexpr const char* kHighestVersion = ".highest-version";  ///< ever given; only written when that version is removed

constexpr const char* kLabels = "labels.json";

void requireName(const std::string& model, const char* field = "model") {
  const auto allowed = [](char c) {
    return (c >= 'A' && c <= 'Z') || (c >= 'a' && c <= 'z') || (c >= '0' && c <= '9') || c == '.' || c == '_' ||
           c == '-';
  };
  if (model.empty() || model.size() > 100 || model.front() == '.' || !std::all_of(model.begin(), model.end(), allowed))
    throw InvalidInput(
        field,
        quotedWord(model) + " is no name for a model or label; want 1 to 100 of A-Z a-z 0-9 . _ -, the first no dot");
}

/// The number of a version's folder; 0 for any other entry.
std::int64_t versionOf(const fs::path& folder) {
  const auto name = folder.filename().string();
  std::int64_t version = 0;
  if (!parseInteger(name, version) || version < 1 || version > kMostVersions || std::to_string(version) != name)
    return 0;
  return version;
}

std::vector<std::int64_t> versionsIn(const fs::path& model_folder) {
  std::vector<std::int64_t> versions;
  std::error_code none;
  for (const auto& entry : fs::directory_iterator(model_folder, none))
    if (const auto version = versionOf(entry.path()); version > 0 && entry.is_directory(none))
      versions.push_back(version);
  std::sort(versions.begin(), versions.end());
  return versions;
}

/// The highest version ever given in this folder. Call with the folder locked.
std::int64_t highestVersion(const fs::path& model_folder) {
  const auto versions = versionsIn(model_folder);
  std::int64_t highest = versions.empty() ? 0 : versions.back(), removed = 0;
  std::error_code none;
  const auto note = model_folder / kHighestVersion;
  if (fs::exists(note, none) && parseInteger(readFile(note), removed)) highest = std::max(highest, removed);
  return highest;
}

/// A scratch folder in the model's folder, which is made when it is missing.
ScratchFolder beginPublishing(const fs::path& folder) {
  for (int attempt = 0;; ++attempt) {
    makeFolder(folder);
    try {
      const FolderLock lock(folder);  // nobody clears the scratch folder away before its owner holds it
      removeAbandoned(folder);
      return ScratchFolder(folder);
    } catch (const FileError&) {
      // Another publisher that failed may have removed the folder of a model without versions at this moment.
      if (fs::exists(folder) || attempt == 10) throw;
    }
  }
}

/// Gives a whole version its number. The folder of a model without versions may be removed at any moment by a publisher
/// that failed.
std::int64_t nameVersion(ScratchFolder& scratch, const fs::path& folder) {
  for (int attempt = 0;; ++attempt) {
    makeFolder(folder);
    try {
      const FolderLock lock(folder);
      const auto version = highestVersion(folder) + 1;
      scratch.rename(folder / std::to_string(version));
      return version;
    } catch (const FileError&) {
      if (fs::exists(folder) || attempt == 10) throw;
    }
  }
}

ModelManifest parseManifest(const fs::path& path, const std::string& text) {
  try {
    return manifestFrom(text);
  } catch (const InvalidInput& problem) {
    throw FileError(path.string(), std::string("is no model manifest: ") + problem.what());
  }
}

std::string readManifestText(const fs::path& path) {
  try {
    return readFile(path);
  } catch (const InvalidInput& problem) {
    throw FileError(path.string(), std::string("is no model manifest: ") + problem.what());
  }
}

ModelManifest readManifest(const fs::path& path) { return parseManifest(path, readManifestText(path)); }

/// Writes both files; the manifest learns size and hash of the tensors while they are written.
void writeFiles(const fs::path& folder, ModelManifest& manifest, const TensorWriter& tensors) {
  Sha256 hash;
  manifest.tensors_bytes = 0;
  FileWriter file(folder / kTensorsFile);
  tensors.write([&](std::string_view bytes) {
    hash.update(bytes);
    manifest.tensors_bytes += bytes.size();
    file.write(bytes);
  });
  file.commit();
  manifest.tensors_sha256 = hash.finish();
  writeFile(folder / kManifestFile, textOf(manifest));
  syncFolder(folder);
}

/// Maps the tensors, which must be as long as the manifest says.
std::shared_ptr<const TensorFile> mapTensors(const fs::path& path, const ModelManifest& manifest) {
  std::shared_ptr<const TensorFile> tensors;
  try {
    tensors = std::make_shared<const TensorFile>(path);
  } catch (const InvalidInput& problem) {
    throw FileError(path.string(), std::string("is damaged: ") + problem.what());
  }
  if (tensors->bytes().size() != manifest.tensors_bytes)
    throw FileError(path.string(), "has " + std::to_string(tensors->bytes().size()) + " bytes, its manifest says " +
                                       std::to_string(manifest.tensors_bytes) + "; restore or remove this version");
  return tensors;
}

/// Compares all bytes of the tensors with what the manifest says of them.
void requireHash(const fs::path& path, const ModelManifest& manifest, const TensorFile& tensors) {
  Sha256 hashing;
  try {
    tensors.readThrough([&](std::string_view piece) { hashing.update(piece); });
  } catch (const InvalidInput& problem) {
    throw FileError(path.string(), std::string("is damaged: ") + problem.what());
  }
  if (const auto hash = hashing.finish(); hash != manifest.tensors_sha256)
    throw FileError(path.string(), "has SHA-256 " + hash + ", its manifest says " + manifest.tensors_sha256 +
                                       "; restore or remove this version");
}

/// Removes what crashed publishers and removers left in a model's folder, and the folder if nothing else is in it.
void tidy(const fs::path& model_folder) {
  {
    const FolderLock lock(model_folder);
    removeAbandoned(model_folder);
    std::error_code none;
    for (const auto& entry : fs::directory_iterator(model_folder, none))
      if (entry.path().filename().string().starts_with(std::string(kHighestVersion) + ".partial-"))
        fs::remove(entry.path(), none);
  }
  ::rmdir(model_folder.c_str());  // fails, as it should, where there is a version
}

}  // namespace

ModelDirectory::ModelDirectory(fs::path folder) : folder_(fs::absolute(folder)) {
  std::error_code error;
  fs::create_directories(folder_, error);
  if (error) throw FileError(folder_.string(), "cannot be made: " + error.message());
  const FolderLock lock(folder_);
  removeAbandoned(folder_);
  std::error_code none;
  for (const auto& entry : fs::directory_iterator(folder_, none))
    if (entry.is_directory(none) && !entry.path().filename().string().starts_with('.')) tidy(entry.path());
}

fs::path ModelDirectory::folderOf(const std::string& model) const {
  requireName(model);
  return folder_ / model;
}

fs::path ModelDirectory::folderOf(const std::string& model, std::optional<std::int64_t>& version) const {
  const auto known = versions(model);
  if (known.empty()) throw ModelNotFound("model", "there is no model " + quotedWord(model));
  if (!version) version = known.back();
  if (!std::binary_search(known.begin(), known.end(), *version))
    throw ModelNotFound("model", quotedWord(model) + " has no version " + std::to_string(*version) +
                                     "; the newest is " + std::to_string(known.back()));
  return folderOf(model) / std::to_string(*version);
}

std::int64_t ModelDirectory::publish(const std::string& model, ModelManifest manifest,
                                     const TensorWriter& tensors) const {
  const auto folder = folderOf(model);
  textOf(manifest);  // throws before anything is written
  try {
    auto scratch = beginPublishing(folder);
    writeFiles(scratch.path(), manifest, tensors);
    return nameVersion(scratch, folder);
  } catch (const FileError&) {
    ::rmdir(folder.c_str());  // fails, as it should, unless the model is new
    throw;
  }
}

std::unique_ptr<IncomingModel> ModelDirectory::receive(const std::string& model, std::string manifest_text) const {
  requireName(model);
  return std::make_unique<IncomingModel>(model, std::move(manifest_text), folder_);
}

std::int64_t ModelDirectory::publish(IncomingModel& incoming) const {
  const auto folder = folderOf(incoming.name());
  try {
    return nameVersion(incoming.scratch_, folder);
  } catch (const FileError&) {
    ::rmdir(folder.c_str());  // fails, as it should, unless the model is new
    throw;
  }
}

ModelManifest ModelDirectory::manifest(const std::string& model, std::optional<std::int64_t> version) const {
  return readManifest(folderOf(model, version) / kManifestFile);
}

StoredModel ModelDirectory::load(const std::string& model, std::optional<std::int64_t> version,
                                 const std::function<void(const StoredModel&)>& meanwhile) const {
  const auto folder = folderOf(model, version);
  const auto path = folder / kTensorsFile;
  auto manifest = readManifest(folder / kManifestFile);
  auto tensors = mapTensors(path, manifest);
  const StoredModel stored{model, *version, std::move(manifest), std::move(tensors)};
  const auto verify = [&] { requireHash(path, stored.manifest, *stored.tensors); };
  if (!meanwhile) {
    verify();
    return stored;
  }
  auto verified = std::async(std::launch::async, verify);
  std::exception_ptr failure;
  try {
    meanwhile(stored);
  } catch (...) {
    failure = std::current_exception();
  }
  verified.get();  // first: of damaged files it says so, whatever else has come of that
  if (failure) std::rethrow_exception(failure);
  return stored;
}

ModelFiles ModelDirectory::files(const std::string& model, std::optional<std::int64_t> version) const {
  const auto folder = folderOf(model, version);
  auto text = readManifestText(folder / kManifestFile);
  auto manifest = parseManifest(folder / kManifestFile, text);
  auto tensors = mapTensors(folder / kTensorsFile, manifest);
  return {model, *version, std::move(text), std::move(manifest), std::move(tensors)};
}

std::vector<std::string> ModelDirectory::models() const {
  std::vector<std::string> names;
  std::error_code none;
  for (const auto& entry : fs::directory_iterator(folder_, none)) {
    const auto name = entry.path().filename().string();
    if (!name.starts_with('.') && !versionsIn(entry.path()).empty()) names.push_back(name);
  }
  std::sort(names.begin(), names.end());
  return names;
}

std::vector<std::int64_t> ModelDirectory::versions(const std::string& model) const {
  return versionsIn(folderOf(model));
}

std::string ModelDirectory::fingerprint(const std::string& model, std::int64_t version) const {
  std::string print;
  for (const auto* name : {kManifestFile, kTensorsFile}) {
    struct stat status {};
    if (::stat((folderOf(model) / std::to_string(version) / name).c_str(), &status) != 0) continue;
    for (const auto number : {static_cast<std::int64_t>(status.st_ino), static_cast<std::int64_t>(status.st_size),
                              static_cast<std::int64_t>(status.st_mtim.tv_sec), status.st_mtim.tv_nsec})
      print += std::to_string(number) + " ";
  }
  return print;
}

std::map<std::string, std::int64_t> ModelDirectory::labels(const std::string& model) const {
  const auto path = folderOf(model) / kLabels;
  std::error_code none;
  if (!fs::exists(path, none)) return {};
  try {
    return json::parse(readFile(path)).get<std::map<std::string, std::int64_t>>();
  } catch (const json::exception& problem) {
    throw FileError(path.string(), std::string("is no list of labels: ") + problem.what());
  }
}

void ModelDirectory::setLabel(const std::string& model, const std::string& label, std::int64_t version) const {
  requireName(label, "label");
  std::optional<std::int64_t> wanted;
  if (version != 0) wanted = version;
  folderOf(model, wanted);  // throws when there is no such model or version
  const FolderLock lock(folderOf(model));
  auto all = labels(model);
  if (version == 0)
    all.erase(label);
  else
    all[label] = version;
  writeFile(folderOf(model) / kLabels, json(all).dump(2) + "\n");
}

void ModelDirectory::remove(const std::string& model, std::int64_t version) const {
  std::optional<std::int64_t> wanted = version;
  const auto folder = folderOf(model, wanted);
  const FolderLock lock(folderOf(model));
  if (highestVersion(folderOf(model)) == version) writeFile(folderOf(model) / kHighestVersion, std::to_string(version));
  removeFolder(folder);
}

void ModelDirectory::remove(const std::string& model) const {
  if (versions(model).empty()) throw ModelNotFound("model", "there is no model " + quotedWord(model));
  const FolderLock lock(folder_);
  removeFolder(folderOf(model));
}

}  // namespace shaped
