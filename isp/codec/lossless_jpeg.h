#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "isp/base/plane.h"

namespace lowlux::isp {

/// Encodes samples as lossless JPEG (ITU-T T.81, process 14), in the form that LibRaw, RawSpeed and dcraw read:
/// predictor 1, and one Huffman table made for these samples.
/// @param samples        up to 65535 rows of interleaved components, each below 2^precision_bits
/// @param components     per column, 1 to 4; the width is a multiple of it, and up to 65535 times it
/// @param precision_bits 2 to 16
std::vector<std::byte> encode_lossless_jpeg(PlaneView<const std::uint16_t> samples, int components,
                                            int precision_bits = 16);

}  // namespace lowlux::isp
