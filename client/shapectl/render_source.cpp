#include "client/shapectl/render_source.h"

#include <filesystem>
#include <limits>

#include "client/shapectl/frame_range.h"
#include "core/io/frames.h"
#include "core/io/mesh_file.h"
#include "core/io/scan_file.h"
#include "core/numerics/error.h"
#include "core/rendering/point_balls.h"
#include "core/surface/closest_point.h"

namespace shaped::shapectl {
namespace {

bool isStack(const std::string& file) { return std::filesystem::path(file).extension() == ".npy"; }

std::string stemOf(const std::string& file) { return std::filesystem::path(file).stem().string(); }

void addFrames(std::vector<RenderItem>& items, const std::string& file, const RenderSource& source) {
  if (source.template_file.empty())
    throw InvalidInput(file, "has no faces; name a mesh of its connectivity with --template");
  const Faces faces = readMesh(source.template_file).faces;
  const FrameReader frames(file);
  if (faces.maxCoeff() >= frames.vertexCount())
    throw InvalidInput(file, "has " + std::to_string(frames.vertexCount()) +
                                 " vertices a frame, too few for the faces of " + source.template_file);
  constexpr std::int64_t most = 24, any = std::numeric_limits<std::int64_t>::max();
  for (const auto frame : thinned(framesOf(source.frames, frames.frameCount()), source.frames.empty() ? most : any))
    items.push_back({frames.frame(frame), faces, stemOf(file) + " " + std::to_string(frame), {}});
}

RenderItem scanItem(const std::string& file) {
  auto scan = readScan(file);
  if (scan.faces.rows() > 0) return {std::move(scan.points), std::move(scan.faces), stemOf(file), {}};
  auto balls = pointBalls(scan.points, touchingRadius(scan.points));
  return {std::move(balls.vertices), std::move(balls.faces), stemOf(file), {}};
}

ItemErrors errorsOf(const RenderItem& item, const RenderItem& reference) {
  if (item.vertices.rows() == reference.vertices.rows() && item.faces == reference.faces)
    return {(item.vertices - reference.vertices).rowwise().norm()};
  return {distancesToSurface(item.vertices, reference.vertices, reference.faces)};
}

}  // namespace

std::vector<RenderItem> RenderSource::items() const {
  std::vector<RenderItem> result;
  for (const auto& file : files) {
    if (isStack(file)) {
      addFrames(result, file, *this);
      continue;
    }
    auto mesh = readMesh(file);
    result.push_back({std::move(mesh.vertices), std::move(mesh.faces), stemOf(file), {}});
  }
  for (const auto& file : scans) result.push_back(scanItem(file));
  return result;
}

std::vector<ItemErrors> errorsAgainst(const std::vector<RenderItem>& items, const RenderSource& reference) {
  const auto references = reference.items();
  if (references.size() != 1 && references.size() != items.size())
    throw InvalidInput(reference.files.front(), "has " + std::to_string(references.size()) + " shapes for " +
                                                    std::to_string(items.size()) +
                                                    " pictures; want one shape, or one for each picture");
  std::vector<ItemErrors> errors;
  for (std::size_t i = 0; i < items.size(); ++i)
    errors.push_back(errorsOf(items[i], references.size() == 1 ? references.front() : references[i]));
  return errors;
}

}  // namespace shaped::shapectl
