#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <vector>

#include "isp/base/noise_ratio.h"
#include "isp/base/result.h"

/// The noise ratio of a frame as the DNGPrivateData (tag 50740) of a DNG, which begins with the name of its maker:
///     0   "lowlux", NUL
///     7   1: the noise ratio, in this layout
///     8   columns of blocks, 12 rows: 32 bits each, little-endian
///     16  side of a block in pixels: 16 bits, little-endian
///     18  0, 0
///     20  one byte n for each block, row by row: the ratio is 2^((n - 96) / 16), from 0.0156 to 982
namespace lowlux::isp {

/// Returns the bytes. Ratios are rounded to the nearest of their logarithm, within 2.2 %, and limited to the range.
/// Precondition: ratio > 0, block_px 1..65535.
std::vector<std::byte> encode_noise_ratio(const NoiseRatio& ratio);

/// Returns the noise ratio of a frame; nullopt for bytes of another maker. Nothing is allocated before the sizes agree
/// with the number of bytes and with the frame.
/// @param width_px, height_px  active area of the frame
/// Errors (malformed): bytes of this maker that are of another layout, too few or too many, or of another frame.
Result<std::optional<NoiseRatio>> decode_noise_ratio(std::span<const std::byte> bytes, int width_px, int height_px);

}  // namespace lowlux::isp
