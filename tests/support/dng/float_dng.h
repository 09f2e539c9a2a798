#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "isp/base/plane.h"
#include "tests/support/dng/dng_builder.h"

namespace lowlux::test {

/// How a floating-point DNG stores its samples.
struct FloatStore {
  int bits = 32;            // 16, 24 or 32
  int samples = 1;          // per pixel
  bool deflate = false;     // zlib streams
  int predictor = 1;        // of deflated samples: 1 (none), 3, 34894 or 34895
  int tile_width = 0;       // 0: strips
  int rows = 0;             // of a strip or tile; 0: all
  bool big_endian = false;  // the file
};

/// Returns the value of an IEEE 754 pattern of 16, 24 (7 bits of exponent) or 32 bits, in double and by ldexp.
double value_of_pattern(std::uint32_t pattern, int bits);

/// Returns the bytes of one row as a part stores it before it is deflated.
std::vector<std::byte> stored_row(const std::vector<std::uint32_t>& patterns, const FloatStore& how);

std::vector<std::byte> deflated(const std::vector<std::byte>& bytes);

/// Returns a DNG of samples with these bit patterns, height x (width * samples); tiles are filled up with zeros. Black
/// is 0; white is not stated, which makes it 1.
DngBuilder float_dng(const Plane<std::uint32_t>& patterns, const FloatStore& how);

/// Returns a DNG of a mosaic as uncompressed 32-bit floats.
DngBuilder float_dng(const Plane<float>& mosaic, std::optional<double> white);

}  // namespace lowlux::test
