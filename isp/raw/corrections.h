#pragma once

#include <array>

#include "isp/base/correction.h"
#include "isp/base/executor.h"
#include "isp/base/image.h"

namespace lowlux::isp {

/// Returns whether the map changes anything, that is, whether some gain differs from 1.
bool has_effect(const GainMap& map);

/// Multiplies a mosaic (height x width, black and dark already subtracted) by the gain maps and radial gains, in that
/// order. A gain map multiplies every row_pitch-th row and column_pitch-th column of its area; between its points it is
/// bilinear, outside them it keeps the value of the nearest (DNG 1.4, opcode 9). Radial gains follow DNG 1.4, opcode 3.
void apply_gains(const RawCorrections& corrections, PlaneView<float> mosaic, Executor& executor);
/// Locates a tile of a mosaic in its frame, so that apply_gains can correct the tile alone.
struct FramePlace {
  int x = 0;  // column of the tile's corner in the frame
  int y = 0;
  int frame_width = 0;
  int frame_height = 0;
};
void apply_gains(const RawCorrections& corrections, const FramePlace& place, PlaneView<float> mosaic,
                 Executor& executor);
/// Propagates the gains g of a mosaic, and the relative variance r of those that were measured, to the variance of each
/// 2x2 cell:
///     V -> mean(g^2) V + mean(r s^2)
/// s is a pixel after the gains, and the means are over the pixels of the cell. For g = 1 / f of a flat f this is
/// V / f^2 + s0^2 V_f / f^4, with s0 the signal before the gains. A cell may reach beyond the frame's last column or
/// row, where it has fewer pixels.
/// @param gained  the frame after apply_gains
void apply_gains_to_variance(const RawCorrections& corrections, PlaneView<const float> gained, PlaneView<float> cells,
                             Executor& executor);
/// Multiplies demosaiced planes by the gains; GainMap::first_plane and planes choose among R, G, B.
void apply_gains(const RawCorrections& corrections, RgbView<float> rgb, Executor& executor);

}  // namespace lowlux::isp
