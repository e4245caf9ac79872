#include "core/registration/scan_checks.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "core/numerics/error.h"

namespace shaped {
namespace {

double percentile(std::vector<double> values, double share) {
  const auto at = values.begin() + static_cast<std::ptrdiff_t>(share * static_cast<double>(values.size() - 1));
  std::nth_element(values.begin(), at, values.end());
  return *at;
}

void requireFinite(const Vertices& rows, const std::string& field) {
  for (Eigen::Index i = 0; i < rows.rows(); ++i)
    if (!rows.row(i).allFinite())
      throw InvalidInput(field + "[" + std::to_string(i) + "]", "has a coordinate that is not a finite number");
}

void requirePoints(const Vertices& points, const std::string& field) {
  if (points.rows() == 0) throw InvalidInput(field, "has no points");
  if (points.rows() < kFewestScanPoints)
    throw InvalidInput(
        field, "has " + std::to_string(points.rows()) + " points, want at least " + std::to_string(kFewestScanPoints));
  requireFinite(points, field + ".points");
  if ((points.rowwise() - points.row(0)).cwiseAbs().maxCoeff() == 0)
    throw InvalidInput(field + ".points", "all lie in one place");
}

void requireNormals(const Scan& scan, const std::string& field) {
  if (scan.normals.rows() != 0 && scan.normals.rows() != scan.points.rows())
    throw InvalidInput(field + ".normals", "has " + std::to_string(scan.normals.rows()) + " rows, want " +
                                               std::to_string(scan.points.rows()) + " (one a point) or none");
  requireFinite(scan.normals, field + ".normals");
}

void requireFaces(const Scan& scan, const std::string& field) {
  for (Eigen::Index f = 0; f < scan.faces.rows(); ++f)
    if (scan.faces.row(f).minCoeff() < 0 || scan.faces.row(f).maxCoeff() >= scan.points.rows())
      throw InvalidInput(field + ".faces[" + std::to_string(f) + "]",
                         "has a vertex index outside [0, " + std::to_string(scan.points.rows()) + ")");
}

}  // namespace

void requireUsableScan(const Scan& scan, const std::string& field) {
  requirePoints(scan.points, field);
  requireNormals(scan, field);
  requireFaces(scan, field);
}

double robustExtent(const Vertices& points) {
  if (points.rows() == 0) return 0;
  Eigen::RowVector3d middle;
  for (int axis = 0; axis < 3; ++axis) {
    const Eigen::VectorXd column = points.col(axis);
    middle[axis] = percentile({column.begin(), column.end()}, 0.5);
  }
  const Eigen::VectorXd distances = (points.rowwise() - middle).rowwise().norm();
  return 2 * percentile({distances.begin(), distances.end()}, 0.95);
}

std::optional<double> suspectedUnitFactor(const Scan& scan, double template_extent) {
  if (!(template_extent > 0) || !std::isfinite(template_extent))
    throw InvalidInput("template_extent", "must be a finite number > 0");
  const double extent = robustExtent(scan.points);
  if (!(extent > 0)) return std::nullopt;
  const double power = std::log10(template_extent / extent), whole = std::round(power);
  if (whole == 0 || std::abs(whole) > 3 || std::abs(power - whole) > std::log10(3.0)) return std::nullopt;
  return std::pow(10.0, whole);
}

}  // namespace shaped
