#pragma once

#include <array>
#include <cstdint>

#include "denoise/denoise_options.h"
#include "denoise/spatial/bands.h"
#include "isp/base/memory.h"
#include "isp/base/plane.h"

/// Detection of stars and specular dots of a few pixels. A delta of one cell spreads over all 64 coefficients of a
/// block, each below the thresholds at a signal to noise ratio of 10, so that shrinkage leaves a third of its flux:
/// such sources are found first, replaced by the background around them, and added back as they were measured.
namespace lowlux::denoise {

/// Minimum significance of a source: V h(t / V) with h(u) = (1 + u) ln(1 + u) - u, t the sum of a 2x2 window less its
/// expected value and V its variance. By Bennett's inequality, flat noise exceeds it with a probability below exp(-13);
/// for normal noise it is 5.1 standard deviations, 1.7e-7, and there are four windows for each cell. Where the noise
/// ratio is r, values over r are as Poisson-like as values are where it is 1: they have variance V / r^2, and excess t
/// / r.
inline constexpr double min_significance = 13;

/// Minimum distance in sites from each side of a source's window to the border of the frame.
inline constexpr int source_margin = 6;

/// Search memory of one thread.
struct SearchMemory {
  Scratch scratch;                // scratch memory of the rows below
  std::array<float*, 14> pair{};  // sums of two rows; each as long as a row and its padding
  std::array<float*, 2> sums{};
  float* ratio = nullptr;         // length: a row and its padding
  std::int32_t* found = nullptr;  // length: the width of the frame
};

/// Sets cells[x, y] to 1 where the 2x2 cell holds a part of a point source, to 0 elsewhere. A source is a 2x2 window of
/// sites, at any position, that
///   - is significant against the mean of the 14 x 14 sites around it without the inner 6 x 6, and no less than the
///     adjacent windows;
///   - is detected, at 2.5 standard deviations, without its brightest site too: one hot site is not a star;
///   - lies on a background that is flat within its noise: structure is left to the transform.
/// Nothing is found within source_margin sites of the border.
/// @param memory one for each of the workers' threads
/// @param cells  ceil(height / 2) x ceil(width / 2)
void find_point_sources(const RawElectronsView& raw, const RawNoise& noise, const Workers& workers,
                        const SearchMemory* memory, PlaneView<std::uint8_t> cells);

/// Returns the expected value at raw site (x, y) without the source: the mean of the sites of this kind in the 7 x 7
/// cells around that belong to no source; the value itself if there are none.
double background_e(const RawElectronsView& raw, PlaneView<const std::uint8_t> cells, int x, int y);

}  // namespace lowlux::denoise
