#include "core/rendering/contact_sheet.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>
#include <numbers>

#include "core/numerics/error.h"
#include "core/rendering/camera.h"
#include "core/rendering/color_map.h"
#include "core/rendering/shading.h"
#include "core/rendering/text.h"

namespace shaped {
namespace {

constexpr int kCaptionDot = 2, kPadding = 8;
constexpr double kMargin = 0.06;  // of a tile, left free on every side
const Color kInk(0.25f, 0.27f, 0.30f);

template <class Value>
std::string violation(const std::string& field, Value value, const std::string& wanted) {
  return field + " = " + std::to_string(value) + ", want " + wanted;
}

/// A mesh in its final place: y up, seen by its own camera.
struct Placed {
  const RenderItem* item;
  Vertices vertices;
  Camera camera;
  PlaneBox box;
  double floor;  ///< y of the ground
};

struct Layout {
  int columns, rows, tile_width, picture_height, caption_height, legend_height;
  std::vector<double> pixels_per_unit;  ///< of each item: of the picture plane

  int tileHeight() const { return picture_height + caption_height; }
  int width() const { return columns * tile_width; }
  int height() const { return rows * tileHeight() + legend_height; }
};

void requireItem(const RenderItem& item, std::size_t index) {
  const std::string field =
      "items[" + std::to_string(index) + "]" + (item.caption.empty() ? "" : " (" + item.caption + ")");
  if (item.faces.rows() == 0) throw InvalidInput(field, "has no faces to draw");
  if (!item.vertices.allFinite()) throw InvalidInput(field, "has a coordinate that is not a finite number");
  if (item.faces.minCoeff() < 0 || item.faces.maxCoeff() >= item.vertices.rows())
    throw InvalidInput(field, "has a vertex index outside [0, " + std::to_string(item.vertices.rows()) + ")");
  if (item.colors.rows() != 0 && item.colors.rows() != item.vertices.rows())
    throw InvalidInput(field, "has " + std::to_string(item.colors.rows()) + " colours for " +
                                  std::to_string(item.vertices.rows()) + " vertices");
  if ((item.vertices.rowwise() - item.vertices.row(0)).isZero(0))
    throw InvalidInput(field, "has no extent: all its vertices lie in one point");
}

Vertices withYUp(const Vertices& vertices, UpAxis up) {
  if (up == UpAxis::kY) return vertices;
  Vertices turned(vertices.rows(), 3);
  turned << vertices.col(0), vertices.col(2), -vertices.col(1);
  return turned;
}

double halfDiagonal(const Vertices& vertices) {
  return 0.5 * (vertices.colwise().maxCoeff() - vertices.colwise().minCoeff()).norm();
}

Placed place(const RenderItem& item, double radius, const RenderOptions& options) {
  constexpr double radian = std::numbers::pi / 180;
  Vertices vertices = withYUp(item.vertices, options.up);
  const Eigen::RowVector3d centre = 0.5 * (vertices.colwise().minCoeff() + vertices.colwise().maxCoeff());
  const Camera camera =
      orbitCamera(centre.transpose(), 6 * radius, options.azimuth * radian, options.elevation * radian);
  const PlaneBox box = coveredBox(camera, vertices);
  const double floor = vertices.col(1).minCoeff();
  return {&item, std::move(vertices), camera, box, floor};
}

/// All of them seen as their union is.
std::vector<Placed> placeTogether(const std::vector<RenderItem>& items, const RenderOptions& options) {
  Eigen::RowVector3d low = items.front().vertices.row(0), high = low;
  for (const auto& item : items) {
    low = low.cwiseMin(item.vertices.colwise().minCoeff());
    high = high.cwiseMax(item.vertices.colwise().maxCoeff());
  }
  Vertices corners(2, 3);
  corners << low, high;
  const RenderItem whole{corners, {}, {}, {}};
  const auto view = place(whole, halfDiagonal(corners), options);
  std::vector<Placed> placed;
  PlaneBox box = coveredBox(view.camera, withYUp(items.front().vertices, options.up));
  for (const auto& item : items) {
    Vertices vertices = withYUp(item.vertices, options.up);
    const auto covered = coveredBox(view.camera, vertices);
    placed.push_back({&item, std::move(vertices), view.camera, covered, view.floor});
    box = {box.low.cwiseMin(covered.low), box.high.cwiseMax(covered.high)};
  }
  for (auto& p : placed) p.box = box;
  return placed;
}

std::vector<Placed> place(const std::vector<RenderItem>& items, const RenderOptions& options) {
  if (options.common_view) return placeTogether(items, options);
  double radius = 0;
  for (const auto& item : items) radius = std::max(radius, halfDiagonal(item.vertices));
  std::vector<Placed> placed;
  for (const auto& item : items)
    placed.push_back(place(item, options.common_scale ? radius : halfDiagonal(item.vertices), options));
  return placed;
}

/// The column count that leaves few tiles empty on a sheet of about 4:3.
int chosenColumns(int count, const Layout& layout) {
  int best = 1;
  double least = std::numeric_limits<double>::infinity();
  for (int columns = 1; columns <= count; ++columns) {
    const int rows = (count + columns - 1) / columns;
    const double aspect = static_cast<double>(columns * layout.tile_width) / (rows * layout.tileHeight());
    const double cost = std::abs(std::log(aspect * 3 / 4)) + 2.0 * (rows * columns - count) / count;
    if (cost < least) least = cost, best = columns;
  }
  return best;
}

void requireItems(const std::vector<RenderItem>& items, const RenderOptions& options) {
  if (const auto problem = options.firstViolation()) throw InvalidInput("options", *problem);
  if (items.empty()) throw InvalidInput("items", "there is no mesh to draw");
  for (std::size_t i = 0; i < items.size(); ++i) requireItem(items[i], i);
}

Layout layOut(const std::vector<Placed>& placed, const RenderOptions& options) {
  Layout layout{};
  PlanePoint largest = PlanePoint::Zero();
  for (const auto& p : placed) largest = largest.cwiseMax(p.box.size());
  const double aspect = std::clamp(largest.y() / largest.x(), 0.6, 1.6);
  layout.tile_width = options.tile_width;
  layout.picture_height = static_cast<int>(std::lround(options.tile_width * aspect));
  const bool captions =
      std::any_of(placed.begin(), placed.end(), [](const Placed& p) { return !p.item->caption.empty(); });
  layout.caption_height = captions ? kTextLineHeight * kCaptionDot + kPadding : 0;
  const auto count = static_cast<int>(placed.size());
  layout.columns = options.columns > 0 ? std::min(options.columns, count) : chosenColumns(count, layout);
  layout.rows = (count + layout.columns - 1) / layout.columns;
  layout.legend_height = options.legend ? 64 : 0;
  for (const auto& p : placed) {
    const PlanePoint size = options.common_scale ? largest : p.box.size();
    layout.pixels_per_unit.push_back((1 - 2 * kMargin) *
                                     std::min(layout.tile_width / size.x(), layout.picture_height / size.y()));
  }
  return layout;
}

/// How much of the ground's shadow is drawn at a pixel: it fades out before the tile's border, where it would be cut.
float groundStrength(const Layout& layout, int x, int y) {
  const double border = 0.12 * layout.tile_width;
  const int nearest = std::min({x, y, layout.tile_width - 1 - x, layout.picture_height - 1 - y});
  const double t = std::clamp(nearest / border, 0.0, 1.0);
  return static_cast<float>(t * t * (3 - 2 * t));
}

Color pixelColor(const Shader& shader, const Placed& placed, const Layout& layout, double pixels_per_unit, int samples,
                 int x, int y) {
  Color sum = Color::Zero();
  PixelSamples sequences(x, y);
  const float ground = groundStrength(layout, x, y);
  for (int j = 0; j < samples; ++j)
    for (int i = 0; i < samples; ++i) {
      const PlanePoint pixel(x + (i + 0.5) / samples, y + (j + 0.5) / samples);
      const PlanePoint offset(pixel.x() - 0.5 * layout.tile_width, 0.5 * layout.picture_height - pixel.y());
      const Eigen::Vector3d direction = placed.camera.direction(placed.box.centre() + offset / pixels_per_unit);
      const Shade shade = shader(placed.camera.eye, direction, sequences);
      // Clamped before the mean: an over-bright sample must not undo the smoothing of an edge.
      sum += shade.ground ? Color(Color::Ones() - ground * (Color::Ones() - shade.color))
                          : Color(shade.color.cwiseMin(1.0f));
    }
  return toScreen(sum / static_cast<float>(samples * samples));
}

/// The key light stands to the upper left behind the viewer.
Eigen::Vector3d keyDirection(const Camera& camera) {
  return (-0.75 * camera.right + 1.1 * Eigen::Vector3d::UnitY() - 0.9 * camera.forward).normalized();
}

/// left, top: of its tile.
void drawPicture(Image& image, int left, int top, const Placed& placed, const Layout& layout, double pixels_per_unit,
                 const RenderOptions& options, const std::stop_token& stop) {
  const RayScene scene(placed.vertices, placed.item->faces, placed.floor);
  Lighting lighting{keyDirection(placed.camera)};
  lighting.ground = options.ground;
  const Shader shader(scene, placed.item->faces, placed.item->colors, options.color, lighting);
  tbb::parallel_for(0, layout.picture_height, [&](int y) {
    if (stop.stop_requested()) return;
    for (int x = 0; x < layout.tile_width; ++x)
      image.blend(left + x, top + y, pixelColor(shader, placed, layout, pixels_per_unit, options.samples, x, y));
  });
}

void drawCaption(Image& image, int left, int top, const Placed& placed, const Layout& layout) {
  const std::string caption = fittedText(placed.item->caption, (layout.tile_width - 2 * kPadding) / kCaptionDot);
  const int caption_left = left + (layout.tile_width - textWidth(caption) * kCaptionDot) / 2;
  drawText(image, caption_left, top + layout.picture_height, caption, kCaptionDot, kInk);
}

std::string shortNumber(double value) {
  char text[32];
  std::snprintf(text, sizeof text, "%.3g", value);
  return text;
}

/// A colour bar with its ends and middle named.
void drawLegend(Image& image, int top, const ColorLegend& legend) {
  const int bar_width = std::min(320, image.width() - 8 * kPadding), bar_height = 14;
  const int left = (image.width() - bar_width) / 2;
  for (int x = 0; x < bar_width; ++x)
    for (int y = 0; y < bar_height; ++y) image.blend(left + x, top + y, errorColor((x + 0.5) / bar_width));
  for (const double place : {0.0, 0.5, 1.0}) {
    const std::string label = shortNumber(place * legend.limit) + (place == 1.0 ? " " + legend.unit : "");
    const int centre = left + static_cast<int>(place * bar_width);
    drawText(image, centre - textWidth(label) * kCaptionDot / 2, top + bar_height + 6, label, kCaptionDot, kInk);
  }
  const int title_left = left - (textWidth(legend.title) + 3) * kCaptionDot;
  drawText(image, title_left, top, legend.title, kCaptionDot, kInk);
}

}  // namespace

std::optional<std::string> RenderOptions::firstViolation() const {
  if (columns < 0) return violation("columns", columns, ">= 0");
  if (tile_width < 32 || tile_width > 4096) return violation("tile_width", tile_width, "32 to 4096");
  if (!std::isfinite(azimuth)) return violation("azimuth", azimuth, "a finite number of degrees");
  if (!(std::abs(elevation) <= 85)) return violation("elevation", elevation, "-85 to 85");
  if (samples < 1 || samples > 8) return violation("samples", samples, "1 to 8");
  if (legend && !(legend->limit > 0)) return violation("legend.limit", legend->limit, "> 0");
  return std::nullopt;
}

Image renderContactSheet(const std::vector<RenderItem>& items, const RenderOptions& options, std::stop_token stop) {
  requireItems(items, options);
  const auto placed = place(items, options);
  const Layout layout = layOut(placed, options);
  Image image(layout.width(), layout.height());
  for (std::size_t i = 0; i < placed.size() && !stop.stop_requested(); ++i) {
    const int left = static_cast<int>(i) % layout.columns * layout.tile_width;
    const int top = static_cast<int>(i) / layout.columns * layout.tileHeight();
    drawPicture(image, left, top, placed[i], layout, layout.pixels_per_unit[i], options, stop);
    drawCaption(image, left, top, placed[i], layout);
  }
  if (options.legend) drawLegend(image, layout.rows * layout.tileHeight() + kPadding, *options.legend);
  return image;
}

std::vector<Image> renderSeparately(const std::vector<RenderItem>& items, const RenderOptions& options,
                                    std::stop_token stop) {
  requireItems(items, options);
  const auto placed = place(items, options);
  const Layout layout = layOut(placed, options);
  std::vector<Image> images;
  for (std::size_t i = 0; i < placed.size() && !stop.stop_requested(); ++i) {
    images.emplace_back(layout.tile_width, layout.picture_height);
    drawPicture(images.back(), 0, 0, placed[i], layout, layout.pixels_per_unit[i], options, stop);
  }
  return images;
}

}  // namespace shaped
