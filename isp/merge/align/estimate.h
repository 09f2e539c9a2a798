#pragma once

#include "isp/merge/align/small_matrix.h"

namespace lowlux::merge {

/// A linear measurement of a small displacement p: the score has the mean information * p and the covariance variance.
template <int N>
struct Measurement {
  SmallVector<N> score{};
  SmallMatrix<N> information{};
  SmallMatrix<N> variance{};
};

/// An estimate of p, and the directions in which there is one.
template <int N>
struct DisplacementEstimate {
  SmallVector<N> value{};  // 0 in directions that are not determined
  SmallMatrix<N> covariance{};
  int determined = 0;     // number of these directions
  double chi_square = 0;  // chi square of the score against p = 0, with N degrees of freedom
};

/// Returns the mean of p given the measurement s and a normal prior: with information K, variance M and prior
/// information P about a mean value of -before,
///     (K M^-1 K + P) p = K M^-1 s - P before.
/// K M^-1 K is the information that a noisy reference leaves: M grows with the gradients of its noise, K does not.
/// Directions (in units of p) whose standard deviation is larger than max_error do not count as determined; their
/// variance is undetermined_variance.
template <int N>
DisplacementEstimate<N> estimate(const Measurement<N>& m, const SmallVector<N>& prior, const SmallVector<N>& before,
                                 double max_error, double undetermined_variance) {
  SmallMatrix<N> variance = m.variance;
  double trace = 0;
  for (int i = 0; i < N; ++i) trace += variance[i][i];
  for (int i = 0; i < N; ++i) variance[i][i] += 1e-9 * trace + 1e-300;
  const SmallMatrix<N> l = cholesky<N>(variance);
  const SmallVector<N> white_score = solve_lower<N>(l, m.score);
  SmallMatrix<N> white{};  // row i: L^-1 times column i of K, which is symmetric
  for (int i = 0; i < N; ++i) white[i] = solve_lower<N>(l, m.information[i]);
  SmallMatrix<N> a{};
  SmallVector<N> target{};
  DisplacementEstimate<N> out;
  for (int i = 0; i < N; ++i) {
    for (int j = 0; j < N; ++j) {
      for (int k = 0; k < N; ++k) a[i][j] += white[i][k] * white[j][k];
    }
    for (int k = 0; k < N; ++k) target[i] += white[i][k] * white_score[k];
    a[i][i] += prior[i];
    target[i] -= prior[i] * before[i];
    out.chi_square += white_score[i] * white_score[i];
  }
  const Eigen<N> eigen = eigen_of<N>(a);
  for (int e = 0; e < N; ++e) {
    const bool is_determined = eigen.value[e] * max_error * max_error > 1;
    const double variance_along = is_determined ? 1 / eigen.value[e] : undetermined_variance;
    double along = 0;
    for (int i = 0; i < N; ++i) along += eigen.vector[i][e] * target[i];
    for (int i = 0; i < N; ++i) {
      if (is_determined) out.value[i] += eigen.vector[i][e] * along * variance_along;
      for (int j = 0; j < N; ++j) out.covariance[i][j] += eigen.vector[i][e] * eigen.vector[j][e] * variance_along;
    }
    if (is_determined) ++out.determined;
  }
  return out;
}

}  // namespace lowlux::merge
