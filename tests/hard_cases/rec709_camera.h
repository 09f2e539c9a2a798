#pragma once

#include <array>
#include <functional>

#include "isp/base/frame.h"
#include "isp/model/colour/colorimetry.h"

/// A camera whose white-balanced RGB is linear Rec. 709, white 1.
namespace lowlux::hard_cases {

/// Its codes: 14 bits, this far from black to white.
inline constexpr double rec709_black_dn = 512, rec709_range_dn = 15000;

using Rec709 = std::array<float, 3>;

/// As the codes of a frame hold it.
Rec709 in_codes(const Rec709& rgb);

/// @param rgb_at  of column and row. @param light  of white as it is in the scene, Y = 1; the camera sees it as 1, 1, 1
RawFrame rec709_frame(int width, int height, const std::function<Rec709(int, int)>& rgb_at, const isp::Xyz& light);

}  // namespace lowlux::hard_cases
