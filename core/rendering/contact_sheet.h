#pragma once

#include <optional>
#include <stop_token>
#include <string>
#include <vector>

#include "core/mesh/types.h"
#include "core/rendering/image.h"

namespace shaped {

/// One mesh of a contact sheet.
struct RenderItem {
  Vertices vertices;  ///< V x 3, any unit
  Faces faces;        ///< F x 3
  std::string caption;
  Vertices colors;  ///< V x 3 in [0, 1] (errorColors), or empty for the options' colour
};

/// What the colours of an error map mean, drawn below the pictures.
struct ColorLegend {
  double limit = 1;         ///< value of the last colour, > 0
  std::string unit = "mm";  ///< of the limit
  std::string title = "error";
};

enum class UpAxis { kY, kZ };

struct RenderOptions {
  int columns = 0;           ///< pictures in a row; 0: chosen for a sheet about 4:3
  int tile_width = 320;      ///< pixels, 32 to 4096; the height follows from the meshes
  double azimuth = 35;       ///< degrees around the up axis, from the front (+z, or -y with z up) to the mesh's left
  double elevation = 18;     ///< degrees above the horizon, -85 to 85
  UpAxis up = UpAxis::kY;    ///< which axis of the meshes points up
  bool common_scale = true;  ///< all meshes at one scale; otherwise each fills its tile
  /// All meshes are seen from one place, where they are in space: frames of a motion. Otherwise each in its tile's
  /// middle.
  bool common_view = false;
  bool ground = true;                 ///< a soft shadow below each mesh
  int samples = 3;                    ///< per pixel and axis, 1 to 8
  Color color{0.86f, 0.70f, 0.52f};   ///< of meshes without colours of their own
  std::optional<ColorLegend> legend;  ///< drawn below where given

  std::optional<std::string> firstViolation() const;  ///< "samples = 0, want 1 to 8"
};

/// Ray-casts every mesh from the same three-quarter view on white: smooth shading, soft sky with ambient occlusion, key
/// light with a soft shadow. Triangles that show their back are magenta, so inverted ones stand out. The same input
/// gives the same pixels.
///
/// Throws InvalidInput, naming options or item, when there is no item, an option is out of range, or a mesh has no
/// faces, indices out of range, coordinates that are not finite, no extent, or as many colours as it has not vertices.
/// When the stop token fires, remaining rows stay white.
Image renderContactSheet(const std::vector<RenderItem>& items, const RenderOptions& options = {},
                         std::stop_token stop = {});

/// The same pictures one by one, all of one size, without captions and legend: frames of an animated picture.
std::vector<Image> renderSeparately(const std::vector<RenderItem>& items, const RenderOptions& options = {},
                                    std::stop_token stop = {});

}  // namespace shaped
