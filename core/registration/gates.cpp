#include "core/registration/gates.h"

#include <cmath>
#include <numbers>

#include "core/numerics/error.h"

namespace shaped {
namespace {

enum class Verdict { kAccepted, kTooFar, kWrongNormal, kAtBoundary };

Verdict judge(const CorrespondenceGates& gates, bool oriented, const ScanPoint& found,
              const Eigen::RowVector3d& normal) {
  if (found.distance > gates.max_distance) return Verdict::kTooFar;
  if (!normalsAgree(gates, oriented, found.normal, normal)) return Verdict::kWrongNormal;
  return gates.reject_boundary && found.boundary ? Verdict::kAtBoundary : Verdict::kAccepted;
}

}  // namespace

std::optional<std::string> CorrespondenceGates::firstViolation() const {
  if (!(max_distance > 0)) return "max_distance = " + std::to_string(max_distance) + ", want > 0";
  if (!(max_normal_angle > 0 && max_normal_angle <= 180))
    return "max_normal_angle = " + std::to_string(max_normal_angle) + ", want (0, 180] degrees";
  return std::nullopt;
}

bool normalsAgree(const CorrespondenceGates& gates, bool oriented, const Eigen::RowVector3d& one,
                  const Eigen::RowVector3d& other) {
  if (one.squaredNorm() == 0 || other.squaredNorm() == 0) return true;
  const double cosine = oriented ? one.dot(other) : std::abs(one.dot(other));
  return cosine >= std::cos(gates.max_normal_angle * std::numbers::pi / 180);
}

double RobustLoss::value(double squared_residual) const {
  const double square = scale * scale;
  switch (kind) {
    case Kind::kSquares:
      return squared_residual;
    case Kind::kGemanMcClure:
      return square * squared_residual / (square + squared_residual);
    case Kind::kWelsch:
      return -square * std::expm1(-squared_residual / square);
  }
  return squared_residual;
}

double RobustLoss::weight(double squared_residual) const {
  const double square = scale * scale;
  switch (kind) {
    case Kind::kSquares:
      return 1;
    case Kind::kGemanMcClure:
      return std::pow(square / (square + squared_residual), 2);
    case Kind::kWelsch:
      return std::exp(-squared_residual / square);
  }
  return 1;
}

Correspondences findCorrespondences(const ScanSurface& scan, const Vertices& vertices, const Vertices& normals,
                                    const CorrespondenceGates& gates) {
  if (const auto violation = gates.firstViolation()) throw InvalidInput("gates", *violation);
  if (normals.rows() != vertices.rows())
    throw InvalidInput("normals",
                       "has " + std::to_string(normals.rows()) + " rows, want " + std::to_string(vertices.rows()));
  const auto count = vertices.rows();
  Correspondences found{Vertices(count, 3), Vertices(count, 3), Eigen::VectorXd(count), Eigen::VectorXd(count)};
  for (Eigen::Index v = 0; v < count; ++v) {
    const ScanPoint point = scan.closest(vertices.row(v));
    const Verdict verdict = judge(gates, scan.hasOrientedNormals(), point, normals.row(v));
    found.targets.row(v) = point.position;
    found.normals.row(v) = point.normal;
    found.distances[v] = point.distance;
    found.accepted[v] = verdict == Verdict::kAccepted;
    found.too_far += verdict == Verdict::kTooFar;
    found.wrong_normal += verdict == Verdict::kWrongNormal;
    found.at_boundary += verdict == Verdict::kAtBoundary;
  }
  return found;
}

}  // namespace shaped
