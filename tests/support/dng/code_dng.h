#pragma once

#include <cstdint>
#include <vector>

#include "isp/base/plane.h"
#include "tests/support/dng/dng_builder.h"

namespace lowlux::test {

/// How a DNG of integers stores its samples in strips or tiles, uncompressed or deflated.
struct CodeStore {
  int bits = 16;            // 8 to 16
  int samples = 1;          // per pixel
  bool deflate = false;     // zlib streams
  int predictor = 1;        // of deflated samples: 1 (none), 2, 34892 or 34893
  int tile_width = 0;       // 0: strips
  int rows = 0;             // of a strip or tile; 0: all
  bool planar = false;      // colour after colour
  bool big_endian = false;  // the file
};

/// Returns a DNG of these codes, height x (width * samples). What lies outside of the image in a tile is filled with
/// ones.
DngBuilder code_dng(const Plane<std::uint16_t>& codes, const CodeStore& how);

}  // namespace lowlux::test
