#pragma once

#include <cstdint>

#include "core/rendering/image.h"
#include "core/rendering/ray_scene.h"

namespace shaped {

/// How a surface is lit: a soft sky, weakened where it is hidden (ambient occlusion), and one key light with a soft
/// shadow.
struct Lighting {
  Eigen::Vector3d key_direction;  ///< unit, towards the light
  int sky_rays = 8;               ///< per sample, >= 1
  bool ground = true;             ///< a soft shadow on the plane below the mesh
};

/// Numbers in [0, 1) that differ from pixel to pixel and cover the square evenly within one: pictures are reproducible.
class SampleSequence {
 public:
  /// x, y: the pixel; stream: of several sequences in one pixel.
  SampleSequence(int x, int y, std::uint32_t stream);
  Eigen::Vector2d next();

 private:
  Eigen::Vector2d shift_;
  int index_ = 0;
};

/// One sequence for each use: every n-th element of one sequence would no longer cover the square.
struct PixelSamples {
  SampleSequence sky, key;
  PixelSamples(int x, int y) : sky(x, y, 0), key(x, y, 1) {}
};

/// What one sample of a pixel sees.
struct Shade {
  Color color;  ///< linear light
  bool ground;  ///< the ground's shadow or white, not the mesh
};

/// Shades rays: the mesh, the ground's shadow or white.
/// vertex_colors: V x 3 in [0, 1] as shown on a screen, or empty for base_color everywhere.
class Shader {
 public:
  Shader(const RayScene& scene, const Faces& faces, const Vertices& vertex_colors, const Color& base_color,
         const Lighting& lighting);

  Shade operator()(const Eigen::Vector3d& eye, const Eigen::Vector3d& direction, PixelSamples& samples) const;

 private:
  Color surface(const RayHit& hit, const Eigen::Vector3d& direction, PixelSamples& samples) const;
  Color background(const Eigen::Vector3d& eye, const Eigen::Vector3d& direction, PixelSamples& samples) const;
  Color pigment(const RayHit& hit) const;
  double openSky(const Eigen::Vector3d& position, const Eigen::Vector3d& normal, SampleSequence& samples) const;
  double keyLight(const Eigen::Vector3d& position, SampleSequence& samples) const;

  const RayScene& scene_;
  const Faces& faces_;
  const Vertices& vertex_colors_;
  Color base_color_;
  Lighting lighting_;
};

/// Screen values (sRGB) to linear light and back, each in [0, 1].
Color toLinear(const Color& screen);
Color toScreen(const Color& linear);

}  // namespace shaped
