#include "isp/merge/stars/normal_equations.h"

#include <cassert>
#include <cmath>
#include <cstddef>

namespace lowlux::merge {
namespace {

/// Lower triangular matrix, full storage.
struct Triangle {
  std::size_t size;
  std::vector<double> values;
  double& at(std::size_t i, std::size_t j) { return values[i * size + j]; }
  double at(std::size_t i, std::size_t j) const { return values[i * size + j]; }
};

std::optional<Triangle> cholesky(const std::vector<double>& normal, std::size_t n) {
  Triangle out{n, std::vector<double>(n * n, 0.0)};
  for (std::size_t i = 0; i < n; ++i) {
    for (std::size_t j = 0; j <= i; ++j) {
      double sum = normal[i * n + j];
      for (std::size_t k = 0; k < j; ++k) sum -= out.at(i, k) * out.at(j, k);
      if (i == j && !(sum > 1e-12 * normal[i * n + i])) return std::nullopt;
      out.at(i, j) = i == j ? std::sqrt(sum) : sum / out.at(j, j);
    }
  }
  return out;
}

/// Solves L L^T x = b in place.
void substitute(const Triangle& l, std::span<double> b) {
  const std::size_t n = l.size;
  for (std::size_t i = 0; i < n; ++i) {
    for (std::size_t k = 0; k < i; ++k) b[i] -= l.at(i, k) * b[k];
    b[i] /= l.at(i, i);
  }
  for (std::size_t i = n; i-- > 0;) {
    for (std::size_t k = i + 1; k < n; ++k) b[i] -= l.at(k, i) * b[k];
    b[i] /= l.at(i, i);
  }
}

}  // namespace

NormalEquations::NormalEquations(int unknowns)
    : unknowns_(static_cast<std::size_t>(unknowns)), normal_(unknowns_ * unknowns_, 0.0), right_(unknowns_, 0.0) {}

void NormalEquations::add(std::span<const double> row, double value, double weight) {
  assert(row.size() == unknowns_);
  for (std::size_t i = 0; i < unknowns_; ++i) {
    const double weighted = weight * row[i];
    if (weighted == 0) continue;
    right_[i] += weighted * value;
    for (std::size_t j = 0; j <= i; ++j) normal_[i * unknowns_ + j] += weighted * row[j];
  }
}

std::optional<LeastSquares> NormalEquations::solve() const {
  const std::optional<Triangle> l = cholesky(normal_, unknowns_);
  if (!l) return std::nullopt;
  LeastSquares out{right_, std::vector<double>(unknowns_ * unknowns_, 0.0)};
  substitute(*l, out.coefficients);
  for (std::size_t i = 0; i < unknowns_; ++i) {
    const std::span<double> row(out.covariance.data() + i * unknowns_, unknowns_);
    row[i] = 1;
    substitute(*l, row);
  }
  return out;
}

}  // namespace lowlux::merge
