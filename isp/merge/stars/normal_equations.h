#pragma once

#include <optional>
#include <span>
#include <vector>

namespace lowlux::merge {

/// Solution of a linear least squares problem.
struct LeastSquares {
  std::vector<double> coefficients;
  std::vector<double> covariance;  // row after row; that of the coefficients if weights are 1 / variance
};

/// Collects the equations of a weighted linear least squares problem.
class NormalEquations {
 public:
  explicit NormalEquations(int unknowns);

  /// Adds weight * (sum of row_i coefficient_i - value)^2 to what is minimised.
  void add(std::span<const double> row, double value, double weight);

  /// Solves by Cholesky's decomposition; nullopt if the equations do not determine all unknowns, to about 1e-12.
  std::optional<LeastSquares> solve() const;

 private:
  std::size_t unknowns_;
  std::vector<double> normal_;  // lower triangle, row after row
  std::vector<double> right_;
};

}  // namespace lowlux::merge
