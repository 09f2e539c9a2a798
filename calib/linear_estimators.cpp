#include "calib/linear_estimators.h"

#include <cmath>
#include <cstddef>
#include <utility>

namespace lowlux::calib {
namespace {

constexpr double singular = 1e-12;  // of a column's own square: what elimination leaves of dependent columns

}  // namespace

std::optional<Design> linear_estimators(const Design& design, std::span<const double> weights) {
  const std::size_t observations = design.size();
  const std::size_t parameters = observations > 0 ? design.front().size() : 0;
  if (parameters == 0) return std::nullopt;
  Design normal(parameters, std::vector<double>(parameters)), out(parameters, std::vector<double>(observations));
  for (std::size_t i = 0; i < parameters; ++i) {
    for (std::size_t k = 0; k < observations; ++k) {
      out[i][k] = weights[k] * design[k][i];
      for (std::size_t j = 0; j < parameters; ++j) normal[i][j] += out[i][k] * design[k][j];
    }
  }
  const Design before = normal;
  // Symmetric and not negative: the diagonal holds the pivots.
  for (std::size_t i = 0; i < parameters; ++i) {
    const double pivot = normal[i][i];
    if (!(pivot > singular * before[i][i])) return std::nullopt;
    for (std::size_t row = 0; row < parameters; ++row) {
      if (row == i) continue;
      const double factor = normal[row][i] / pivot;
      for (std::size_t j = 0; j < parameters; ++j) normal[row][j] -= factor * normal[i][j];
      for (std::size_t k = 0; k < observations; ++k) out[row][k] -= factor * out[i][k];
    }
  }
  for (std::size_t i = 0; i < parameters; ++i) {
    for (double& weight : out[i]) weight /= normal[i][i];
  }
  return out;
}

}  // namespace lowlux::calib
