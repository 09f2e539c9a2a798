#pragma once

#include <cstdint>

#include "isp/base/frame.h"
#include "isp/base/image.h"
#include "isp/base/plane.h"

namespace lowlux::calib {

/// A raw frame at half size, as charts are looked for and measured: a pixel for each 2x2 cell of the mosaic, its R,
/// the mean of its two G, its B. Nothing is interpolated, so its pixels are independent.
struct ChartPicture {
  CameraRgb rgb;                // 0 black, 1 white level; signed
  Plane<std::uint8_t> clipped;  // 1 where one of the four codes reached the white level
};

/// @param mosaic active area of `raw`, black off, gains applied
/// @param raw    a Bayer frame; its codes tell what is clipped
/// An odd last row or column is left out.
ChartPicture chart_picture(const SignalFraction& mosaic, const RawDn& raw);

}  // namespace lowlux::calib
