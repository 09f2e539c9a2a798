#pragma once

#include <array>
#include <cmath>

namespace lowlux::merge {

template <int N>
using SmallVector = std::array<double, N>;
template <int N>
using SmallMatrix = std::array<SmallVector<N>, N>;  // rows

template <int N>
SmallVector<N> times(const SmallMatrix<N>& m, const SmallVector<N>& v) {
  SmallVector<N> out{};
  for (int i = 0; i < N; ++i) {
    for (int j = 0; j < N; ++j) out[i] += m[i][j] * v[j];
  }
  return out;
}

/// Replaces a positive definite symmetric matrix by its Cholesky factor L, m = L L^T. A pivot that rounding has made
/// smaller than 1e-14 of its diagonal element is set to that.
template <int N>
SmallMatrix<N> cholesky(SmallMatrix<N> m) {
  for (int j = 0; j < N; ++j) {
    double pivot = m[j][j];
    for (int k = 0; k < j; ++k) pivot -= m[j][k] * m[j][k];
    m[j][j] = std::sqrt(std::fmax(pivot, 1e-14 * m[j][j] + 1e-300));
    for (int i = j + 1; i < N; ++i) {
      for (int k = 0; k < j; ++k) m[i][j] -= m[i][k] * m[j][k];
      m[i][j] /= m[j][j];
    }
    for (int k = j + 1; k < N; ++k) m[j][k] = 0;
  }
  return m;
}

/// Returns L^-1 v for a lower triangular matrix.
template <int N>
SmallVector<N> solve_lower(const SmallMatrix<N>& l, SmallVector<N> v) {
  for (int i = 0; i < N; ++i) {
    for (int k = 0; k < i; ++k) v[i] -= l[i][k] * v[k];
    v[i] /= l[i][i];
  }
  return v;
}

/// Eigenvalues and eigenvectors (columns) of a symmetric matrix.
template <int N>
struct Eigen {
  SmallVector<N> value;
  SmallMatrix<N> vector;
};

/// Decomposes a symmetric matrix by cyclic Jacobi rotations.
template <int N>
Eigen<N> eigen_of(SmallMatrix<N> m) {
  SmallMatrix<N> v{};
  for (int i = 0; i < N; ++i) v[i][i] = 1;
  for (int sweep = 0; sweep < 30; ++sweep) {
    bool is_diagonal = true;
    for (int p = 0; p < N; ++p) {
      for (int q = p + 1; q < N; ++q) {
        if (std::fabs(m[p][q]) <= 1e-15 * std::sqrt(std::fabs(m[p][p] * m[q][q])) + 1e-300) continue;
        is_diagonal = false;
        const double theta = (m[q][q] - m[p][p]) / (2 * m[p][q]);
        const double t = (theta >= 0 ? 1 : -1) / (std::fabs(theta) + std::sqrt(theta * theta + 1));
        const double c = 1 / std::sqrt(t * t + 1), s = t * c;
        for (int k = 0; k < N; ++k) {
          const double a = m[k][p], b = m[k][q];
          m[k][p] = c * a - s * b;
          m[k][q] = s * a + c * b;
        }
        for (int k = 0; k < N; ++k) {
          const double a = m[p][k], b = m[q][k];
          m[p][k] = c * a - s * b;
          m[q][k] = s * a + c * b;
        }
        for (int k = 0; k < N; ++k) {
          const double a = v[k][p], b = v[k][q];
          v[k][p] = c * a - s * b;
          v[k][q] = s * a + c * b;
        }
      }
    }
    if (is_diagonal) break;
  }
  Eigen<N> out{{}, v};
  for (int i = 0; i < N; ++i) out.value[i] = m[i][i];
  return out;
}

}  // namespace lowlux::merge
