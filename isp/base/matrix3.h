#pragma once

#include <array>
#include <cmath>
#include <optional>

namespace lowlux {

using Vector3 = std::array<double, 3>;
using Matrix3 = std::array<Vector3, 3>;  // rows

constexpr Matrix3 identity3() { return {{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}}; }
constexpr Matrix3 diagonal3(const Vector3& d) { return {{{d[0], 0, 0}, {0, d[1], 0}, {0, 0, d[2]}}}; }

constexpr double dot(const Vector3& a, const Vector3& b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }

constexpr Vector3 operator*(const Matrix3& m, const Vector3& v) {
  Vector3 out{};
  for (int i = 0; i < 3; ++i) out[i] = m[i][0] * v[0] + m[i][1] * v[1] + m[i][2] * v[2];
  return out;
}

constexpr Matrix3 operator*(const Matrix3& a, const Matrix3& b) {
  Matrix3 out{};
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) out[i][j] = a[i][0] * b[0][j] + a[i][1] * b[1][j] + a[i][2] * b[2][j];
  }
  return out;
}

constexpr Matrix3 transposed(const Matrix3& m) {
  Matrix3 out{};
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) out[i][j] = m[j][i];
  }
  return out;
}

constexpr Matrix3 operator*(double s, const Matrix3& m) { return diagonal3({s, s, s}) * m; }

/// Returns the inverse by cofactors; nullopt if a value is not finite or the matrix is singular to about 1e-12 of its
/// scale.
inline std::optional<Matrix3> inverse(const Matrix3& m) {
  Matrix3 cofactor_transposed{};
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) {
      const int r0 = (j + 1) % 3, r1 = (j + 2) % 3, c0 = (i + 1) % 3, c1 = (i + 2) % 3;
      cofactor_transposed[i][j] = m[r0][c0] * m[r1][c1] - m[r0][c1] * m[r1][c0];
    }
  }
  double determinant = 0;
  double scale = 0;
  for (int j = 0; j < 3; ++j) determinant += m[0][j] * cofactor_transposed[j][0];
  for (const auto& row : m) {
    for (const double value : row) scale = std::fmax(scale, std::fabs(value));
  }
  if (!std::isfinite(determinant) || !std::isfinite(scale)) return std::nullopt;
  if (std::fabs(determinant) <= 1e-12 * scale * scale * scale) return std::nullopt;
  return (1.0 / determinant) * cofactor_transposed;
}

}  // namespace lowlux
