#pragma once

#include <array>
#include <optional>

#include "denoise/denoise_options.h"
#include "isp/base/executor.h"
#include "isp/base/frame.h"
#include "isp/base/result.h"
#include "isp/pipeline/noise_reduction.h"
#include "isp/pipeline/plan/levels.h"
#include "isp/pipeline/plan/noise_facts.h"
#include "isp/raw/measure/thumbnail.h"

namespace lowlux::isp {

/// Holds the noise of the sites of cells.
struct CellNoise {
  std::array<double, 3> cell_e{};  // charge at white
  denoise::RawNoise noise;
};

/// Returns the noise of cells whose sites get these parts of a pixel's charge, {1, 1, 1} for that of the pixels
/// themselves; nullopt where a gain is not usable. Precondition: frame.noise.
std::optional<CellNoise> cell_noise(const RawFrame& frame, const RawLevels& levels, const std::array<double, 3>& part);

/// Returns the fraction of a frame that plan_pixel_noise compares with the noise model.
double checked_fraction(const RawFrame& frame, const RawLevels& levels);

/// Decides how the noise of a frame that is not a mosaic is reduced, in cells of pixel_cells.h. Row and column noise is
/// left, and dark charge that the black point does not hold counts as light. The noise is compared with its model on a
/// sample of at most 2048 x 2048 pixels: frames that were demosaiced before have less noise on fine scales.
/// Error: a colour of unusable noise (insufficient). Precondition: no noise_obstacle.
Result<NoiseReduction> plan_pixel_noise(const RawFrame& frame, const Thumbnail& thumbnail, const RawLevels& levels,
                                        const NoiseRequest& request, Executor& executor);

}  // namespace lowlux::isp
