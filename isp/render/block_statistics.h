#pragma once

#include <optional>
#include <span>
#include <vector>

#include "isp/base/image.h"
#include "isp/base/matrix3.h"

namespace lowlux::isp {

/// Returns a luminance-like value of each block of a planar thumbnail, weights . rgb, row by row.
std::vector<float> block_luminance(const RgbView<const float>& blocks, const Vector3& weights = {0.25, 0.5, 0.25});

/// Returns the finite value at rank floor(share * (n - 1)) of n finite values in rising order; nullopt if there is
/// none.
/// @param share  0..1
std::optional<double> quantile(std::span<const float> values, double share);

/// Returns the same value as quantile() without allocating memory; it leaves the values in another order.
std::optional<double> quantile_reordering(std::span<float> values, double share);

/// Returns the extent of the black noise of block means: the depth of the 1st percentile below zero, 0 if it is above.
/// Means of black blocks scatter symmetrically around 0, so the scatter below 0 equals the scatter above it.
double black_scatter(std::span<const float> values);
/// Returns the same value as black_scatter() without allocating memory; it leaves the values in another order.
double black_scatter_reordering(std::span<float> values);

}  // namespace lowlux::isp
