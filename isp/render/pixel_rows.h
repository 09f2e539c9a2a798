#pragma once

#include <array>
#include <cstdint>

namespace lowlux::isp {

/// Converts 8-bit codes to luma and colour differences, video range (luma 16..235, differences 16..240 about 128), in
/// 65536ths:
///     Y = 16 + luma . rgb,   Cb = 128 + blue . rgb,   Cr = 128 + red . rgb
struct YuvMatrix {
  std::array<std::int32_t, 3> luma{};
  std::array<std::int32_t, 3> blue{};
  std::array<std::int32_t, 3> red{};
};

/// Names the standards ITU-R BT.601 (kr 0.299, kb 0.114) and BT.709 (kr 0.2126, kb 0.0722).
enum class YuvStandard : std::uint8_t { bt601, bt709 };
YuvMatrix yuv_matrix(YuvStandard standard);

/// Writes the luma of a row of interleaved 8-bit codes R G B.
void luma_row(const YuvMatrix& matrix, const std::uint8_t* rgb, int width, std::uint8_t* out);
/// Writes Cb Cr of the mean of 2x2 pixels, ceil(width / 2) pairs: sited in the middle, as in JPEG. A last odd column
/// counts twice.
/// @param below  the second row; `rgb` itself where there is none
void chroma_row(const YuvMatrix& matrix, const std::uint8_t* rgb, const std::uint8_t* below, int width,
                std::uint8_t* out);

}  // namespace lowlux::isp
