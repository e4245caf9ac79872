#include "core/shell/face_element.h"

#include <Eigen/Eigenvalues>
#include <cmath>

#include "core/shell/block_updates.h"

namespace shaped {
namespace {

template <class Matrix>
Matrix positivePart(const Matrix& symmetric) {
  const Eigen::SelfAdjointEigenSolver<Matrix> eigen(symmetric);
  return eigen.eigenvectors() * eigen.eigenvalues().cwiseMax(0).asDiagonal() * eigen.eigenvectors().transpose();
}

/// Orthonormal functions on the corners that are orthogonal to the constant one.
Eigen::Matrix<double, 2, 3> cornerDifferences() {
  Eigen::Matrix<double, 2, 3> t;
  t << std::sqrt(1.0 / 2), -std::sqrt(1.0 / 2), 0, std::sqrt(1.0 / 6), std::sqrt(1.0 / 6), -std::sqrt(2.0 / 3);
  return t;
}

/// sum_ij a_i b_j (block of corners i, j)
Eigen::Matrix3d combine(const FaceElement& element, const Eigen::RowVector3d& a, const Eigen::RowVector3d& b) {
  Eigen::Matrix3d sum = Eigen::Matrix3d::Zero();
  for (int k = 0; k < 3; ++k) {
    const int i = (k + 2) % 3, j = (k + 1) % 3;
    const auto& between = element.between[static_cast<std::size_t>(k)];
    // the corner's own block is minus the sum of the others in its row
    sum += a[i] * (b[j] - b[i]) * between + a[j] * (b[i] - b[j]) * between.transpose();
  }
  return sum;
}

/// Columns: two directions in the plane, then the normal.
Eigen::Matrix3d frame(const FaceGeometry& face) {
  Eigen::Matrix3d r;
  r.col(0) = face.e[0].normalized();
  r.col(2) = face.doubled_area_vector.normalized();
  r.col(1) = r.col(2).cross(r.col(0));
  return r;
}

}  // namespace

FaceElement lengthElement(const FaceGeometry& face, const FaceCurvature& curvature) {
  const auto& e = face.e;
  const auto& f = curvature.length;
  const double form[3][3] = {{f[0], f[3], f[5]}, {f[3], f[1], f[4]}, {f[5], f[4], f[2]}};
  FaceElement element;
  for (std::size_t k = 0; k < 3; ++k) {
    const std::size_t next = (k + 1) % 3, last = (k + 2) % 3;
    // dl_k = 2 e_k . (dx_{k+2} - dx_{k+1}): the row corner k + 2 ends edges k (+) and k + 1 (-), the column corner
    // k + 1 ends edges k (-) and k + 2 (+)
    const Eigen::Vector3d by_this = 4 * (form[k][last] * e[last] - form[k][k] * e[k]);
    const Eigen::Vector3d by_next = 4 * (form[next][k] * e[k] - form[next][last] * e[last]);
    auto& block = element.between[k];
    block = Eigen::Vector3d::Constant(-2 * curvature.weight[k]).asDiagonal();
    addOuter(e[k], by_this, block.data());
    addOuter(e[next], by_next, block.data());
  }
  return element;
}

// With M_i = n x e_i and c_i, u_i of FaceGeometry, differentiating sum_k w_k d(theta_k)/dx_i = c_i n / |N| gives
//   block (i, j) = n p^T + q n^T,  p = -c_j M_i / |N|^2 - s_k M_k,  q = -c_i M_j / |N|^2 - s_k M_k
// for the edge k between i and j, s_k = w_k / (2 |e_k|^3).
void addFoldElement(const FaceGeometry& face, const std::array<double, 3>& w, FaceElement& element) {
  const auto& e = face.e;
  const std::array<double, 3> l{face.d[1] + face.d[2], face.d[2] + face.d[0], face.d[0] + face.d[1]};
  const std::array<double, 3> u{w[0] / std::sqrt(l[0]), w[1] / std::sqrt(l[1]), w[2] / std::sqrt(l[2])};
  const double inverse = 1 / face.squared_norm;
  auto c = face.foldCoefficients(u);
  for (auto& value : c) value *= inverse;
  const Eigen::Vector3d n = face.doubled_area_vector * std::sqrt(inverse);
  const std::array<Eigen::Vector3d, 3> M{n.cross(e[0]), n.cross(e[1]), n.cross(e[2])};
  for (std::size_t k = 0; k < 3; ++k) {
    const std::size_t i = (k + 2) % 3, j = (k + 1) % 3;
    const Eigen::Vector3d along = (u[k] / (2 * l[k])) * M[k];
    const Eigen::Vector3d p = -c[j] * M[i] - along, q = -c[i] * M[j] - along;
    addOuter(n, p, element.between[k].data());
    addOuter(q, n, element.between[k].data());
  }
}

// Translations and the normal direction split off, which leaves a 2 x 2 and a 4 x 4 eigenvalue problem: the lengths'
// second derivatives act in the plane, and their slopes weigh all directions alike.
void projectToPositive(const FaceGeometry& face, FaceElement& element) {
  static const Eigen::Matrix<double, 2, 3> t = cornerDifferences();
  const Eigen::Matrix3d r = frame(face);
  Eigen::Matrix4d plane;
  Eigen::Matrix2d normal;
  for (int a = 0; a < 2; ++a)
    for (int b = 0; b < 2; ++b) {
      const Eigen::Matrix3d block = r.transpose() * combine(element, t.row(a), t.row(b)) * r;
      plane.block<2, 2>(2 * a, 2 * b) = block.topLeftCorner<2, 2>();
      normal(a, b) = block(2, 2);
    }
  plane = positivePart(plane);
  normal = positivePart(normal);
  for (auto& block : element.between) block.setZero();
  for (int a = 0; a < 2; ++a)
    for (int b = 0; b < 2; ++b) {
      Eigen::Matrix3d block = normal(a, b) * r.col(2) * r.col(2).transpose();
      block += r.leftCols<2>() * plane.block<2, 2>(2 * a, 2 * b) * r.leftCols<2>().transpose();
      for (int k = 0; k < 3; ++k)
        element.between[static_cast<std::size_t>(k)] += t(a, (k + 2) % 3) * t(b, (k + 1) % 3) * block;
    }
}

}  // namespace shaped
