#include "core/rendering/shading.h"

#include <Eigen/Geometry>
#include <cmath>
#include <cstdint>
#include <numbers>

namespace shaped {
namespace {

/// Seen instead of the surface where a triangle shows its back.
const Color kBackFace(0.93f, 0.08f, 0.62f);

/// Integer hash with full avalanche (the finaliser of MurmurHash3).
std::uint32_t mixed(std::uint32_t value) {
  value = (value ^ (value >> 16)) * 0x85ebca6bu;
  value = (value ^ (value >> 13)) * 0xc2b2ae35u;
  return value ^ (value >> 16);
}

/// Two unit vectors that make an orthonormal frame with a unit normal.
Eigen::Matrix<double, 3, 2> tangents(const Eigen::Vector3d& normal) {
  Eigen::Matrix<double, 3, 2> frame;
  frame.col(0) = normal.unitOrthogonal();
  frame.col(1) = normal.cross(frame.col(0));
  return frame;
}

/// A direction of the hemisphere above the normal with density cos(angle) / pi.
Eigen::Vector3d cosineDirection(const Eigen::Vector3d& normal, const Eigen::Vector2d& sample) {
  const double radius = std::sqrt(sample.x()), angle = 2 * std::numbers::pi * sample.y();
  const Eigen::Vector2d disc(radius * std::cos(angle), radius * std::sin(angle));
  return tangents(normal) * disc + std::sqrt(1 - sample.x()) * normal;
}

template <class Curve>
Color perChannel(const Color& color, Curve curve) {
  return color.unaryExpr([&](float value) { return curve(std::clamp(value, 0.0f, 1.0f)); });
}

}  // namespace

Color toLinear(const Color& screen) {
  return perChannel(screen, [](float v) { return v <= 0.04045f ? v / 12.92f : std::pow((v + 0.055f) / 1.055f, 2.4f); });
}

Color toScreen(const Color& linear) {
  return perChannel(linear,
                    [](float v) { return v <= 0.0031308f ? 12.92f * v : 1.055f * std::pow(v, 1 / 2.4f) - 0.055f; });
}

SampleSequence::SampleSequence(int x, int y, std::uint32_t stream) {
  const std::uint32_t row = mixed(static_cast<std::uint32_t>(y) + stream * 0x632be5abu);
  const std::uint32_t hash = mixed(static_cast<std::uint32_t>(x) * 0x9e3779b9u ^ row);
  shift_ << hash * 0x1p-32, mixed(hash) * 0x1p-32;
}

Eigen::Vector2d SampleSequence::next() {
  // The generalised golden ratio g, g^3 = g + 1: multiples of (1/g, 1/g^2) cover the square evenly.
  constexpr double g = 1.32471795724474602596;
  ++index_;
  Eigen::Vector2d point = shift_ + index_ * Eigen::Vector2d(1 / g, 1 / (g * g));
  return point.array() - point.array().floor();
}

Shader::Shader(const RayScene& scene, const Faces& faces, const Vertices& vertex_colors, const Color& base_color,
               const Lighting& lighting)
    : scene_(scene),
      faces_(faces),
      vertex_colors_(vertex_colors),
      base_color_(toLinear(base_color)),
      lighting_(lighting) {}

Shade Shader::operator()(const Eigen::Vector3d& eye, const Eigen::Vector3d& direction, PixelSamples& samples) const {
  const auto hit = scene_.firstHit(eye, direction);
  return hit ? Shade{surface(*hit, direction, samples), false} : Shade{background(eye, direction, samples), true};
}

Color Shader::pigment(const RayHit& hit) const {
  if (vertex_colors_.rows() == 0) return base_color_;
  Eigen::RowVector3d mixed_color = Eigen::RowVector3d::Zero();
  for (int c = 0; c < 3; ++c) mixed_color += hit.barycentric[c] * vertex_colors_.row(faces_(hit.face, c));
  return toLinear(mixed_color.transpose().cast<float>());
}

double Shader::openSky(const Eigen::Vector3d& position, const Eigen::Vector3d& normal, SampleSequence& samples) const {
  int open = 0;
  for (int ray = 0; ray < lighting_.sky_rays; ++ray)
    open += !scene_.occluded(position, cosineDirection(normal, samples.next()));
  return static_cast<double>(open) / lighting_.sky_rays;
}

double Shader::keyLight(const Eigen::Vector3d& position, SampleSequence& samples) const {
  const Eigen::Vector2d sample = samples.next();
  const double spread = 0.12 * std::sqrt(sample.x()), angle = 2 * std::numbers::pi * sample.y();
  const Eigen::Vector3d towards =
      lighting_.key_direction +
      tangents(lighting_.key_direction) * Eigen::Vector2d(spread * std::cos(angle), spread * std::sin(angle));
  return scene_.occluded(position, towards.normalized()) ? 0 : 1;
}

Color Shader::surface(const RayHit& hit, const Eigen::Vector3d& direction, PixelSamples& samples) const {
  const Eigen::Vector3d normal = hit.back_face ? Eigen::Vector3d(-hit.face_normal) : hit.smooth_normal;
  const Eigen::Vector3d from = hit.back_face ? hit.position : hit.lifted;
  const double facing = std::max(0.0, normal.dot(lighting_.key_direction));
  const double key = facing > 0 ? facing * keyLight(from, samples.key) : 0;
  const double sky = openSky(from, normal, samples.sky) * (0.75 + 0.25 * normal.y());
  const Color pigment_color = hit.back_face ? toLinear(kBackFace) : pigment(hit);
  const Eigen::Vector3d halfway = (lighting_.key_direction - direction).normalized();
  const double gloss = key > 0 ? 0.07 * std::pow(std::max(0.0, normal.dot(halfway)), 24.0) : 0;
  const auto light = static_cast<float>(0.62 * key + 0.58 * sky + 0.03);
  return light * pigment_color + Color::Constant(static_cast<float>(gloss));
}

Color Shader::background(const Eigen::Vector3d& eye, const Eigen::Vector3d& direction, PixelSamples& samples) const {
  if (!lighting_.ground || direction.y() >= -1e-3) return Color::Ones();
  const Eigen::Vector3d position = eye + (scene_.floor() - eye.y()) / direction.y() * direction;
  const double sky = openSky(position, Eigen::Vector3d::UnitY(), samples.sky);
  const double key = keyLight(position, samples.key);
  return Color::Constant(static_cast<float>(1 - 0.5 * (1 - sky) - 0.16 * (1 - key)));
}

}  // namespace shaped
