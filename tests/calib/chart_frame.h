#pragma once

#include <array>
#include <cstddef>

#include "calib/chart/chart_detector.h"
#include "calib/chart/chart_patches.h"
#include "tests/support/chart_photograph.h"
#include "tests/support/synthetic_chart.h"

namespace lowlux::test {

/// A ColorChecker as a camera under D65 sees it.
inline const SyntheticChart& daylight_chart() {
  static const SyntheticChart chart = *photograph_chart({});
  return chart;
}

/// The frame at half size, its tagged black off.
inline calib::ChartPicture half_size(const RawFrame& frame) {
  SignalFraction mosaic{Plane<float>(frame.raw.active.width, frame.raw.active.height), frame.raw.phase};
  for (std::size_t i = 0; i < mosaic.value.size(); ++i) {
    mosaic.value.data()[i] = static_cast<float>((frame.raw.dn.data()[i] - photograph_black_dn) /
                                                (photograph_white_dn - photograph_black_dn));
  }
  return calib::chart_picture(mosaic, frame.raw);
}

inline calib::ChartPicture photographed(const ChartPhotograph& photograph) {
  return half_size(photograph_patches(photograph, daylight_chart().camera_rgb));
}

/// Where a raw pixel's centre lies at half size.
inline calib::PicturePoint half_size_point(const ChartPhotograph& photograph, double u, double v) {
  const auto [x, y] = chart_point(photograph, u, v);
  return {(x - 0.5) / 2, (y - 0.5) / 2};
}

}  // namespace lowlux::test
