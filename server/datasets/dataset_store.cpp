#include "server/datasets/dataset_store.h"

#include <limits>

#include "core/io/file.h"
#include "core/io/folder.h"
#include "core/io/npy.h"
#include "core/io/text_scanner.h"
#include "core/numerics/error.h"
#include "server/datasets/name.h"
#include "server/errors/errors.h"

namespace shaped::server {
namespace {

namespace fs = std::filesystem;

constexpr char kFrames[] = "frames.npy", kFaces[] = "faces.npy", kTemplate[] = "template.npy";
constexpr char kScratchPrefix[] = ".scratch-";  // no dataset's name begins with a dot

void writeFaces(const fs::path& folder, const Faces& faces) {
  writeNpy(folder / kFaces, {faces.rows(), 3},
           std::span<const std::int32_t>(faces.data(), static_cast<std::size_t>(faces.size())));
}

Faces readFaces(const fs::path& folder) {
  constexpr std::int64_t any_by_three[] = {-1, 3};
  const auto array = readNpy(folder / kFaces, any_by_three);
  for (const double index : array.values)
    if (!(index >= 0 && index <= std::numeric_limits<std::int32_t>::max()))
      throw InvalidInput((folder / kFaces).string(), "holds " + shortest(index) + ", which is no vertex");
  using Stored = Eigen::Matrix<double, Eigen::Dynamic, 3, Eigen::RowMajor>;
  return Eigen::Map<const Stored>(array.values.data(), array.shape[0], 3).cast<std::int32_t>();
}

std::vector<std::string> filesOf(const DatasetInfo& info) {
  return info.kind == DatasetKind::kScans ? scanFiles(info.frames)
                                          : std::vector<std::string>{kFaces, kFrames, kTemplate};
}

bool sameContent(const DatasetInfo& info, const fs::path& one, const fs::path& other) {
  for (const auto& file : filesOf(info)) {
    if (fs::exists(one / file) != fs::exists(other / file)) return false;
    if (!fs::exists(one / file)) continue;
    if (fs::file_size(one / file) != fs::file_size(other / file)) return false;
    if (readFile(one / file) != readFile(other / file)) return false;
  }
  return true;
}

std::string framePath(std::int64_t index, const std::string& label) {
  return "frames[" + std::to_string(index) + "]" + (label.empty() ? "" : " (" + label + ")");
}

Corrupted notAsUploaded(const std::string& name) {
  return Corrupted("dataset \"" + name + "\" does not hold what was uploaded; delete it and upload it again");
}

TopologyPtr readTopology(const DatasetInfo& info, const fs::path& folder) {
  auto topology = std::make_shared<const Topology>(info.vertex_count, readFaces(folder));
  if (topology->id() != info.topology_id) throw notAsUploaded(info.name);
  return topology;
}

Dataset readShapes(const DatasetInfo& info, const fs::path& folder, TopologyPtr topology) {
  auto shapes = readFrames(folder / kFrames);
  if (std::ssize(shapes) != info.frames) throw notAsUploaded(info.name);
  std::optional<Vertices> template_shape;
  if (fs::exists(folder / kTemplate)) template_shape = readFrames(folder / kTemplate).front();
  for (const auto& shape : shapes) requireValidShape(*topology, shape, info.name);
  if (template_shape) requireValidShape(*topology, *template_shape, info.name);
  return {std::move(topology), std::move(shapes), std::move(template_shape)};
}

Corrupted unreadable(const std::string& name, const InvalidInput& error) {
  return Corrupted("dataset \"" + name + "\" cannot be read: " + error.what());
}

InvalidInput otherKind(const std::string& field, const DatasetInfo& info) {
  const bool scans = info.kind == DatasetKind::kScans;
  return {field, "\"" + info.name + "\" holds " + (scans ? "raw scans" : "shapes of one connectivity") + ", want " +
                     (scans ? "shapes of one connectivity" : "raw scans")};
}

/// A second name for a file, or a copy on a disk that gives none.
void linkOrCopy(const fs::path& file, const fs::path& link) {
  std::error_code no_links;
  fs::create_hard_link(file, link, no_links);
  if (no_links) fs::copy_file(file, link);
}

}  // namespace

DatasetUpload::DatasetUpload(DatasetStore& store, std::string name, TopologyPtr topology, std::int64_t frames,
                             fs::path folder)
    : store_(store),
      name_(std::move(name)),
      topology_(std::move(topology)),
      frames_(frames),
      folder_(std::move(folder)) {
  fs::create_directory(folder_);
  try {
    writeFaces(folder_, topology_->faces());
    writer_.emplace(folder_ / kFrames);
  } catch (...) {  // on a full disk; what has not been made has no destructor that would clear away
    discard();
    throw;
  }
}

DatasetUpload::~DatasetUpload() { discard(); }

void DatasetUpload::discard() {
  writer_.reset();
  std::error_code ignored;  // what stays behind is removed at the next start
  fs::remove_all(folder_, ignored);
}

void DatasetUpload::setTemplate(const Vertices& shape) {
  requireValidShape(*topology_, shape, "template");
  writeFrames(folder_ / kTemplate, {shape});
}

void DatasetUpload::append(const Vertices& shape, const std::string& label) {
  const auto index = writer_->frameCount();
  const auto field = framePath(index, label);
  if (index >= frames_)
    throw InvalidInput(field, "is one too many: the header announced " + std::to_string(frames_) + " frames");
  requireValidShape(*topology_, shape, field);
  writer_->append(shape);
}

DatasetInfo DatasetUpload::commit() {
  if (writer_->frameCount() != frames_)
    throw InvalidInput("frames", "the header announced " + std::to_string(frames_) + ", " +
                                     std::to_string(writer_->frameCount()) + " came");
  writer_->close();
  return store_.publish({.name = name_,
                         .frames = frames_,
                         .vertex_count = topology_->vertexCount(),
                         .face_count = topology_->faces().rows(),
                         .topology_id = topology_->id(),
                         .created = {}},
                        folder_);
}

DatasetStore::DatasetStore(fs::path root) : root_(std::move(root)) {
  fs::create_directories(root_);
  for (const auto& entry : fs::directory_iterator(root_)) {
    const auto name = entry.path().filename().string();
    if (name.starts_with(kScratchPrefix)) {
      fs::remove_all(entry.path());
      continue;
    }
    try {
      const auto info = readDatasetInfo(entry.path());
      if (info.name == name) datasets_.emplace(name, info);
    } catch (const std::exception&) {
      // Not a dataset of ours: left alone, not served.
    }
  }
}

std::unique_ptr<DatasetUpload> DatasetStore::begin(const std::string& name, std::int32_t vertex_count, Faces faces,
                                                   std::int64_t frames) {
  requireName(name, "name");
  if (frames < 1) throw InvalidInput("frames", "= " + std::to_string(frames) + ", want >= 1");
  auto topology = std::make_shared<const Topology>(vertex_count, std::move(faces));
  requireOneComponent(*topology, "faces");
  return std::unique_ptr<DatasetUpload>(new DatasetUpload(*this, name, std::move(topology), frames, scratchFolder()));
}

std::unique_ptr<ScanUpload> DatasetStore::beginScans(const std::string& name, std::int64_t scans) {
  requireName(name, "name");
  if (scans < 1) throw InvalidInput("scans", "= " + std::to_string(scans) + ", want >= 1");
  return std::unique_ptr<ScanUpload>(new ScanUpload(*this, name, scans, scratchFolder()));
}

DatasetInfo DatasetStore::publish(DatasetInfo info, const fs::path& folder) {
  info.created = std::chrono::floor<std::chrono::seconds>(std::chrono::system_clock::now());
  writeDatasetInfo(folder, info);
  const std::scoped_lock lock(mutex_);
  if (const auto found = datasets_.find(info.name); found != datasets_.end()) {
    if (found->second.kind == info.kind && found->second.frames == info.frames &&
        sameContent(info, root_ / info.name, folder))
      return found->second;
    throw AlreadyExists("dataset \"" + info.name + "\" exists and holds other " +
                        (info.kind == DatasetKind::kScans ? "scans" : "shapes") + "; delete it or take another name");
  }
  fs::rename(folder, root_ / info.name);
  datasets_.emplace(info.name, info);
  return info;
}

std::vector<DatasetInfo> DatasetStore::list() const {
  const std::scoped_lock lock(mutex_);
  std::vector<DatasetInfo> result;
  for (const auto& [name, info] : datasets_) result.push_back(info);
  return result;
}

DatasetInfo DatasetStore::find(const std::string& name) const {
  const std::scoped_lock lock(mutex_);
  const auto found = datasets_.find(name);
  if (found == datasets_.end()) throw NotFound("there is no dataset \"" + name + "\"");
  return found->second;
}

DatasetInfo DatasetStore::get(const std::string& name) const {
  auto info = find(name);
  if (info.kind != DatasetKind::kShapes) throw otherKind("dataset", info);
  return info;
}

DatasetInfo DatasetStore::getScans(const std::string& name, const std::string& field) const {
  auto info = find(name);
  if (info.kind != DatasetKind::kScans) throw otherKind(field, info);
  return info;
}

template <class Read>
auto DatasetStore::reading(const std::string& name, const Read& read) const {
  const auto info = get(name);
  const auto folder = root_ / name;
  try {
    return read(info, folder, readTopology(info, folder));
  } catch (const InvalidInput& error) {
    get(name);  // deleted while we read it: NotFound says so
    throw unreadable(name, error);
  }
}

Dataset DatasetStore::load(const std::string& name) const { return reading(name, readShapes); }

Dataset readDataset(const fs::path& folder) {
  const auto info = readDatasetInfo(folder);
  try {
    return readShapes(info, folder, readTopology(info, folder));
  } catch (const InvalidInput& error) {
    throw unreadable(info.name, error);
  }
}

void DatasetStore::keep(const std::string& name, const fs::path& folder) const {
  if (fs::exists(folder)) return;
  removeAbandoned(folder.parent_path());
  ScratchFolder scratch(folder.parent_path());
  {
    const std::scoped_lock lock(mutex_);  // it must not go, and another come, half-way
    if (!datasets_.contains(name)) throw NotFound("there is no dataset \"" + name + "\"");
    for (const auto& file : fs::directory_iterator(root_ / name))
      linkOrCopy(file.path(), scratch.path() / file.path().filename());
  }
  scratch.rename(folder);
}

DatasetFrames DatasetStore::open(const std::string& name) const {
  return reading(name, [&](const DatasetInfo& info, const fs::path& folder, TopologyPtr topology) {
    auto reader = std::make_unique<FrameReader>(folder / kFrames);
    if (reader->frameCount() != info.frames || reader->vertexCount() != info.vertex_count) throw notAsUploaded(name);
    return DatasetFrames(name, std::move(topology), std::move(reader));
  });
}

TopologyPtr DatasetStore::topology(const std::string& name) const {
  return reading(name, [](const DatasetInfo&, const fs::path&, TopologyPtr topology) { return topology; });
}

Vertices DatasetFrames::frame(std::int64_t index) const {
  try {
    auto shape = reader_->frame(index);
    requireValidShape(*topology_, shape, framePath(index, ""));
    return shape;
  } catch (const InvalidInput& error) {
    throw unreadable(name_, error);
  }
}

void DatasetStore::remove(const std::string& name) {
  const auto doomed = scratchFolder();
  {
    const std::scoped_lock lock(mutex_);
    if (datasets_.erase(name) == 0) throw NotFound("there is no dataset \"" + name + "\"");
    fs::rename(root_ / name, doomed);
  }
  fs::remove_all(doomed);
}

fs::path DatasetStore::scratchFolder() {
  const std::scoped_lock lock(mutex_);
  return root_ / (kScratchPrefix + std::to_string(next_scratch_++));
}

}  // namespace shaped::server
