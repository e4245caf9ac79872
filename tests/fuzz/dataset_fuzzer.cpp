#include "server/convert/dataset.h"
#include "server/datasets/dataset_store.h"
#include "server/errors/errors.h"
#include "tests/fuzz/fuzz.h"

using namespace shaped;
using namespace shaped::fuzz;

namespace {

/// The three files of a dataset: dataset.json up to the first NUL, faces.npy of a length in two bytes, frames.npy.
void writeDataset(std::string_view bytes) {
  const auto end = std::min(bytes.find('\0'), bytes.size());
  scratchFile("datasets/d/dataset.json", bytes.substr(0, end));
  bytes.remove_prefix(std::min(end + 1, bytes.size()));
  std::size_t length = 0;
  for (std::size_t i = 0; i < 2 && i < bytes.size(); ++i) length += static_cast<unsigned char>(bytes[i]) << (8 * i);
  bytes.remove_prefix(std::min<std::size_t>(2, bytes.size()));
  scratchFile("datasets/d/faces.npy", bytes.substr(0, length));
  scratchFile("datasets/d/frames.npy", bytes.substr(std::min(length, bytes.size())));
}

}  // namespace

FUZZ_TARGET(dataset) {
  std::filesystem::create_directories(scratchFolder() / "datasets" / "d");
  writeDataset(bytes);
  const server::DatasetStore store(scratchFolder() / "datasets");
  for (const auto& info : store.list()) {
    v1::Dataset message;
    server::toProto(info, message);
    require(message.frames() > 0 && message.vertex_count() > 0, "a dataset that is listed has shapes");
  }
  const auto dataset = accepted<server::Corrupted>(
      [&] { return accepted<server::NotFound>([&] { return store.load("d"); }).value_or(server::Dataset()); });
  if (!dataset || !dataset->topology) return;
  for (const auto& shape : dataset->shapes) requireValidShape(*dataset->topology, shape, "shape");
}
