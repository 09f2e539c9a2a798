#pragma once

#include <array>
#include <cstdint>

#include "isp/base/frame.h"
#include "isp/base/matrix3.h"

namespace lowlux::test {

/// Describes how a ColorChecker lies in a raw frame, and how it was exposed. Lengths are in raw pixels.
struct ChartPhotograph {
  int width = 1000;
  int height = 760;
  double centre_x = 500;
  double centre_y = 380;
  double cell_px = 100;   // from patch to patch; 0.86 of it is patch
  double angle_deg = 0;   // clockwise
  double keystone = 0;    // how much larger its lower edge is than its upper
  bool mirrored = false;  // left and right
  double exposure = 0.8;  // fraction of the range that a perfect diffuser's largest channel reaches
  double light_x = 0;     // LightGradient of calib/chart/colour_fit.h
  double light_y = 0;
  double read_noise_dn = 2;
  double electrons_per_dn = 4;  // photon noise
  unsigned seed = 1;
};

inline constexpr double photograph_black_dn = 256;
inline constexpr double photograph_white_dn = 16383;

/// Returns the frame's point where the chart's plane has (u, v): cell (i, j) spans i..i+1, j..j+1.
std::array<double, 2> chart_point(const ChartPhotograph& photograph, double u, double v);

/// Returns a frame (RGGB, 14 bits, black tagged) of patches of these camera colours, 1 the perfect diffuser's largest
/// channel, in a black frame on a grey wall.
RawFrame photograph_patches(const ChartPhotograph& photograph, const std::array<Vector3, 24>& camera_rgb);

/// Adds another chart to a frame that photograph_patches has made.
void add_patches(const ChartPhotograph& photograph, const std::array<Vector3, 24>& camera_rgb, RawFrame& frame);

}  // namespace lowlux::test
