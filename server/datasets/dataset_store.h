#pragma once

#include <filesystem>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "core/io/frames.h"
#include "core/mesh/topology.h"
#include "server/datasets/dataset_info.h"
#include "server/datasets/scan_files.h"
#include "server/datasets/scan_upload.h"

namespace shaped::server {

/// Shapes that share a connectivity.
struct Dataset {
  TopologyPtr topology;
  std::vector<Vertices> shapes;            ///< V x 3 each, metres
  std::optional<Vertices> template_shape;  ///< V x 3: marker offsets are given in its axes
};

/// A dataset whose frames are read one by one. It stays readable when it is deleted meanwhile. For one thread at a
/// time.
class DatasetFrames {
 public:
  const TopologyPtr& topology() const { return topology_; }
  std::int64_t count() const { return reader_->frameCount(); }
  /// V x 3 [m], of index in [0, count()). Throws Corrupted when the file does not hold what was uploaded.
  Vertices frame(std::int64_t index) const;

 private:
  friend class DatasetStore;
  DatasetFrames(std::string name, TopologyPtr topology, std::unique_ptr<FrameReader> reader)
      : name_(std::move(name)), topology_(std::move(topology)), reader_(std::move(reader)) {}

  std::string name_;
  TopologyPtr topology_;
  std::unique_ptr<FrameReader> reader_;
};

class DatasetStore;

/// A dataset on its way in: frames are checked and written as they come. Destroyed before commit(), it leaves nothing.
class DatasetUpload {
 public:
  ~DatasetUpload();
  DatasetUpload(const DatasetUpload&) = delete;
  DatasetUpload& operator=(const DatasetUpload&) = delete;

  const Topology& topology() const { return *topology_; }
  /// Keeps a template beside the frames. Throws InvalidInput naming "template" when it is faulty, FileError when the
  /// disk fails.
  void setTemplate(const Vertices& shape);
  /// label: what errors call the frame beside its index. Throws InvalidInput naming frame and vertex or face when the
  /// shape is faulty or one too many; FileError when the disk fails.
  void append(const Vertices& shape, const std::string& label);
  /// Publishes the dataset. Throws InvalidInput when frames are missing, AlreadyExists when the name holds other
  /// shapes, FileError when the disk fails. Call once, last.
  DatasetInfo commit();

 private:
  friend class DatasetStore;
  DatasetUpload(DatasetStore& store, std::string name, TopologyPtr topology, std::int64_t frames,
                std::filesystem::path folder);
  void discard();

  DatasetStore& store_;
  const std::string name_;
  const TopologyPtr topology_;
  const std::int64_t frames_;
  const std::filesystem::path folder_;
  std::optional<FrameWriter> writer_;
};

/// Reads a dataset of shapes out of a folder that DatasetStore::keep() made. Throws Corrupted when the files do not
/// hold what was uploaded.
Dataset readDataset(const std::filesystem::path& folder);

/// Datasets under <root>/<name>/, each with a dataset.json. Of shapes: frames.npy (n x V x 3 floats), faces.npy (F x
/// 3), and template.npy (1 x V x 3) where there is one. Of scans: a file a scan (scan_files.h). They appear and go by
/// one rename each, so a crash leaves whole datasets and rubbish that the next start removes. Safe from any thread.
class DatasetStore {
 public:
  /// Creates the folder if need be and indexes what is there. Throws FileError when the disk fails.
  explicit DatasetStore(std::filesystem::path root);

  /// frames >= 1 announced frames. Throws InvalidInput for a bad name or count, or faces that are no one-component
  /// two-manifold (field "faces[i]").
  std::unique_ptr<DatasetUpload> begin(const std::string& name, std::int32_t vertex_count, Faces faces,
                                       std::int64_t frames);
  /// scans >= 1 announced raw scans. Throws InvalidInput for a bad name or count.
  std::unique_ptr<ScanUpload> beginScans(const std::string& name, std::int64_t scans);
  /// Of both kinds, by name.
  std::vector<DatasetInfo> list() const;
  /// One of shapes. Throws NotFound; InvalidInput naming "dataset" when it holds scans, as do the functions below.
  DatasetInfo get(const std::string& name) const;
  /// One of scans. Throws NotFound; InvalidInput naming `field` when it holds shapes.
  DatasetInfo getScans(const std::string& name, const std::string& field) const;
  /// Reads a dataset. Throws NotFound; Corrupted when its files do not hold what was uploaded.
  Dataset load(const std::string& name) const;
  /// Opens a dataset for reading frame by frame. Throws as load().
  DatasetFrames open(const std::string& name) const;
  /// Its connectivity alone. Throws as load().
  TopologyPtr topology(const std::string& name) const;
  /// Gives a folder that is to be the same files by hard links (copies where the disk has none): whoever works on a
  /// dataset for days has it then whatever becomes of its name. The folder appears complete or not at all; one that is
  /// there already is left as it is. Throws NotFound; FileError when the disk fails.
  void keep(const std::string& name, const std::filesystem::path& folder) const;
  /// Throws NotFound; FileError when the disk fails.
  void remove(const std::string& name);

 private:
  friend class DatasetUpload;
  friend class ScanUpload;
  std::filesystem::path scratchFolder();
  DatasetInfo find(const std::string& name) const;
  /// What read(info, folder, topology) returns.
  template <class Read>
  auto reading(const std::string& name, const Read& read) const;
  /// Publishes what lies complete in a scratch folder.
  DatasetInfo publish(DatasetInfo info, const std::filesystem::path& folder);

  const std::filesystem::path root_;
  mutable std::mutex mutex_;
  std::map<std::string, DatasetInfo> datasets_;
  std::uint64_t next_scratch_ = 0;
};

}  // namespace shaped::server
