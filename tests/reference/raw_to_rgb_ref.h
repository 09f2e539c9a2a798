#pragma once

#include <array>
#include <vector>

#include "isp/base/cfa.h"
#include "isp/base/look_grid.h"
#include "isp/base/tone_table.h"
#include "isp/raw/kernel/raw_to_rgb.h"

/// These functions compute what isp/raw/kernel/raw_to_rgb.h promises, one pixel at a time, in double, written to be
/// read against its sources.
namespace lowlux::reference {

using Rgb = std::array<double, 3>;

/// Holds a mosaic after black and gain, row by row.
struct LinearisedMosaic {
  int width = 0;
  int height = 0;
  BayerPhase phase = BayerPhase::rggb;
  std::vector<double> value;

  /// Returns the value at any column and row, borders mirrored without repeating the edge: -1 is 1, n is n - 2.
  double at(int x, int y) const;
};

LinearisedMosaic linearised(const isp::DnMosaic& in);
LinearisedMosaic linearised(const isp::SignedMosaic& in);

/// Returns camera RGB at one site: Malvar, He, Cutler, ICASSP 2004, figure 2.
Rgb malvar(const LinearisedMosaic& mosaic, int x, int y);

/// Returns camera RGB of one pixel of planes, gains applied.
Rgb camera_rgb(const isp::CameraPlanes& in, int x, int y);

/// Applies LookGrid at pixel (x, y).
Rgb seen(const Rgb& v, const LookGrid& look, int x, int y);

/// Applies min(c, clip), matrix, and the move into the gamut where it is requested.
Rgb transformed(const Rgb& camera, const isp::RgbTransform& transform);

/// Moves a colour along the line to neutral until all channels are in 0..1, as RgbTransform says.
Rgb moved_into_gamut(const Rgb& v, const std::array<float, 3>& luminance);

/// Returns the IEC 61966-2-1 transfer function of v in 0..1; values outside are clamped first.
double srgb_encoded(double v);

/// Returns srgb_encoded as a table.
ToneTable srgb_tone_table();

}  // namespace lowlux::reference
