#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

namespace lowlux::test {

/// Holds samples as lossless JPEG has them: `columns` of `components` interleaved values, `rows` of those.
struct JpegSamples {
  int columns = 0, rows = 0, components = 1;
  int precision = 16;                  // bits
  std::vector<std::uint16_t> samples;  // rows x (columns * components)
};

/// Encodes lossless JPEG (ITU-T T.81, process 14) with predictor 1 and one Huffman table, as DNG files use it.
std::vector<std::byte> encode_lossless_jpeg(const JpegSamples& image);

}  // namespace lowlux::test
