#pragma once

#include <bit>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "isp/base/plane.h"
#include "tests/support/dng_builder.h"

namespace lowlux::test {

/// Returns a DNG of the mosaic as uncompressed 32-bit floats. Its halves of 16 bits are pixels of a builder of twice
/// the width.
inline DngBuilder float_dng(const Plane<float>& mosaic, std::optional<double> white) {
  DngBuilder dng;
  dng.width = 2 * mosaic.width();
  dng.height = mosaic.height();
  for (std::size_t i = 0; i < mosaic.size(); ++i) {
    const auto bits = std::bit_cast<std::uint32_t>(mosaic.data()[i]);
    dng.pixels.push_back(static_cast<std::uint16_t>(bits & 0xFFFFU));
    dng.pixels.push_back(static_cast<std::uint16_t>(bits >> 16U));
  }
  dng.set(256, Tag::numbers(TagType::u32, {static_cast<double>(mosaic.width())}));
  dng.set(258, Tag::numbers(TagType::u16, {32}));
  dng.set(339, Tag::numbers(TagType::u16, {3}));
  if (white) {
    dng.set(50717, Tag::numbers(TagType::u32, {*white}));
  } else {
    dng.remove(50717);
  }
  return dng;
}

}  // namespace lowlux::test
