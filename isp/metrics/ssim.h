#pragma once

#include <optional>

#include "isp/base/executor.h"
#include "isp/base/plane.h"

namespace lowlux::isp {

/// Side of the window of SSIM [px].
inline constexpr int ssim_window_px = 11;

/// Returns the structural similarity, mean over all windows completely inside the planes (Wang, Bovik, Sheikh &
/// Simoncelli, IEEE Trans. Image Process. 13 (2004) 600-612, Eq. 13): Gaussian windows of 11 x 11 px, standard
/// deviation 1.5 px, K1 = 0.01, K2 = 0.03, of values in 0..1; variances of the window without correction for bias.
/// @return 1 for equal planes; nullopt where no window fits. The planes are of one size.
std::optional<double> ssim(const PlaneView<const float>& first, const PlaneView<const float>& second,
                           Executor& executor);

}  // namespace lowlux::isp
