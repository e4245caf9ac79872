#include "core/mesh/shape_stack.h"

#include <algorithm>

#include "core/numerics/error.h"

namespace shaped {
namespace {

/// Whether the triangle has an area above 1e-11 of its longest edge squared, without a root or a branch. False, too,
/// where a square overflows or underflows, or a number is not finite: then the longest edge or the normal is not,
/// either.
inline bool clearlyValid(const std::int32_t* corners, const double* shape) {
  constexpr double least = 4e-22;  // of twice the area squared: ten times what is required, which no rounding bridges
  const double *p = shape + 3 * static_cast<std::ptrdiff_t>(corners[0]),
               *q = shape + 3 * static_cast<std::ptrdiff_t>(corners[1]),
               *r = shape + 3 * static_cast<std::ptrdiff_t>(corners[2]);
  const double ax = q[0] - p[0], ay = q[1] - p[1], az = q[2] - p[2];
  const double bx = r[0] - p[0], by = r[1] - p[1], bz = r[2] - p[2];
  const double cx = bx - ax, cy = by - ay, cz = bz - az;
  const double nx = ay * bz - az * by, ny = az * bx - ax * bz, nz = ax * by - ay * bx;
  const double longest =
      std::max(ax * ax + ay * ay + az * az, std::max(bx * bx + by * by + bz * bz, cx * cx + cy * cy + cz * cz));
  return nx * nx + ny * ny + nz * nz > least * longest * longest;
}

/// Every vertex has a face, so this looks at every number.
bool clearlyValid(const Faces& faces, const double* shape) {
  bool valid = true;
  for (const auto *face = faces.data(), *end = face + faces.size(); face != end; face += 3)
    valid &= clearlyValid(face, shape);
  return valid;
}

}  // namespace

ShapeStack::ShapeStack(const std::vector<Vertices>& shapes) : count_(shapes.size()) {
  if (shapes.empty()) return;
  vertices_ = shapes.front().rows();
  auto stack = std::make_shared<Vertices>(static_cast<Eigen::Index>(count_) * vertices_, 3);
  for (std::size_t i = 0; i < count_; ++i) {
    if (shapes[i].rows() != vertices_)
      throw InvalidInput("shapes[" + std::to_string(i) + "]",
                         "has " + std::to_string(shapes[i].rows()) + " vertices, want " + std::to_string(vertices_));
    stack->middleRows(static_cast<Eigen::Index>(i) * vertices_, vertices_) = shapes[i];
  }
  numbers_ = stack->data();
  bytes_ = sizeof(double) * static_cast<std::size_t>(stack->size());
  owner_ = std::move(stack);
}

ShapeStack::ShapeStack(std::shared_ptr<const void> owner, const double* numbers, std::size_t count,
                       Eigen::Index vertices, std::size_t bytes)
    : owner_(std::move(owner)), numbers_(numbers), count_(count), bytes_(bytes), vertices_(vertices) {}

std::vector<Vertices> ShapeStack::shapes() const {
  std::vector<Vertices> copies;
  for (std::size_t i = 0; i < count_; ++i) copies.emplace_back((*this)[i]);
  return copies;
}

void requireValidShapes(const Topology& topology, const ShapeStack& shapes, const std::string& field) {
  for (std::size_t i = 0; i < shapes.size(); ++i) {
    const auto shape = shapes[i];
    if (shape.rows() == topology.vertexCount() && clearlyValid(topology.faces(), shape.data())) continue;
    requireValidShape(topology, shape, field + "[" + std::to_string(i) + "]");  // in doubt; says what is wrong
  }
}

}  // namespace shaped
