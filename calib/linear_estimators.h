#pragma once

#include <optional>
#include <span>
#include <vector>

namespace lowlux::calib {

/// One row for each observation, one column for each parameter.
using Design = std::vector<std::vector<double>>;

/// Weighted least squares as what it is: each parameter a weighted sum of the observations. Row i holds the weights of
/// parameter i: (A^T W A)^-1 A^T W. nullopt where the observations do not determine all parameters.
/// @param weights one for each observation, above 0
std::optional<Design> linear_estimators(const Design& design, std::span<const double> weights);

}  // namespace lowlux::calib
