#pragma once

#include <cstdint>
#include <span>

namespace lowlux::capture {

/// A row of a sensor's fixed pattern. Draws depend on the seed and the pixel alone: the pattern is the same in all
/// frames.
struct PatternRow {
  std::uint64_t seed = 0;
  std::uint32_t x0 = 0;
  std::uint32_t y = 0;
};

/// Multiplies each value by 1 + deviation * z, at least 0, z standard normal: PRNU on signal rates.
/// @param scratch as long as `values`
void apply_prnu(const PatternRow& row, float deviation, std::span<float> values, std::span<float> scratch);

/// Multiplies each value like apply_prnu(), with independent draws: DSNU on dark charge.
void apply_dsnu(const PatternRow& row, float deviation, std::span<float> values, std::span<float> scratch);

/// Adds the charge of hot pixels: a fraction `fraction` of all, each with an exponentially distributed charge.
/// @param mean_e mean of a hot pixel's extra charge
void add_hot_pixels(const PatternRow& row, double fraction, double mean_e, std::span<float> charge_e,
                    std::span<std::uint32_t> scratch);

/// Sets each element to 1 where add_hot_pixels() adds charge, else to 0.
/// @param scratch as long as `hot`
void find_hot_pixels(const PatternRow& row, double fraction, std::span<std::uint32_t> scratch,
                     std::span<std::uint8_t> hot);

/// Adds the column pattern to a row of offsets [e-].
void add_column_pattern(const PatternRow& row, float deviation_e, std::span<float> offset_e, std::span<float> scratch);

/// Adds random telegraph noise to a row of offsets [e-]: a fraction of the pixels, a fixed pattern, has a trap in its
/// transistor, which moves the level between +A/2 and -A/2, with A exponentially distributed. The trap is captured in
/// half of the frames, drawn for each frame by itself: frames are farther apart than the time constants of most traps.
/// The read-noise histogram of the sensor gets exponential tails (Wang and others 2006).
/// @param seed, frame  of the frame
/// @param mean_e       mean of A
void add_telegraph_noise(const PatternRow& row, std::uint64_t seed, std::uint32_t frame, double fraction, double mean_e,
                         std::span<float> offset_e, std::span<std::uint32_t> scratch);

/// Returns the offset of one row of one frame [e-].
float row_offset_e(std::uint64_t seed, std::uint32_t frame, std::uint32_t y, float deviation_e);

}  // namespace lowlux::capture
