#pragma once

#include <array>

#include "isp/base/correction.h"
#include "isp/base/executor.h"
#include "isp/base/image.h"

namespace lowlux::isp {

/// Whether the map changes anything: some gain differs from 1.
bool has_effect(const GainMap& map);

/// Multiplies a mosaic (height x width, black and dark already off) by the gain maps and radial gains, in that order.
/// A gain map multiplies every row_pitch-th row and column_pitch-th column of its area; between its points it is
/// bilinear, outside them it keeps the value of the nearest (DNG 1.4, opcode 9). Radial: DNG 1.4, opcode 3.
void apply_gains(const RawCorrections& corrections, PlaneView<float> mosaic, Executor& executor);
/// The same on a piece of a mosaic.
struct FramePlace {
  int x = 0;  // of the piece's corner in the frame
  int y = 0;
  int frame_width = 0;
  int frame_height = 0;
};
void apply_gains(const RawCorrections& corrections, const FramePlace& place, PlaneView<float> mosaic,
                 Executor& executor);
/// The same on demosaiced planes: GainMap::first_plane and planes choose among R, G, B.
void apply_gains(const RawCorrections& corrections, RgbView<float> rgb, Executor& executor);

}  // namespace lowlux::isp
