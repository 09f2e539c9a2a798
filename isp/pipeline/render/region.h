#pragma once

#include "isp/base/frame.h"
#include "isp/pipeline/plan.h"
#include "isp/pipeline/render/frame_tiles.h"

namespace lowlux::isp {

/// Describes a region of a frame that is rendered at once: the whole frame, or a tile. In pixels of the active area;
/// each rectangle lies in the next.
struct Region {
  Rect core;    // becomes a part of the image
  Rect seen;    // is demosaiced: at the border of the image the mosaic ends, elsewhere it continues
  Rect signal;  // its noise is reduced
  Rect
      mosaic;  // is read, with the margin that repair and noise reduction need; its corner is at an even column and row
};

/// Views the mosaic of a region. The corner of Region::mosaic is at an even column and row, so the phase is the
/// frame's.
template <class Unit, class Dark>
struct LinearMosaicView {
  PlaneView<float> value;
  BayerPhase phase;

  LinearMosaicView(PlaneView<float> of_region, BayerPhase of_frame) : value(of_region), phase(of_frame) {}
  LinearMosaicView(LinearMosaic<Unit, Dark>& whole) : value(whole.value.view()), phase(whole.phase) {}
};
using SignalElectronsView = LinearMosaicView<Electrons, DarkOut>;
using SignalFractionView = LinearMosaicView<FractionOfWhite, DarkOut>;

/// Returns the region of a frame that is rendered as a whole.
Region whole_frame(const RawDn& raw);

/// Returns the region of a tile: `core` and as far around it as the steps of the plan reach.
Region tile_region(const RawDn& raw, const DevelopPlan& plan, const Rect& core);

/// Returns where a core lies in the rendered image.
Rect pixels_of(const RawDn& raw, const DevelopPlan& plan, const Rect& core);

/// Holds the sizes of a region, or the largest of several, for which memory is allocated.
struct RegionSize {
  int mosaic_width = 0;
  int mosaic_height = 0;
  int seen_width = 0;
  int seen_height = 0;
};

RegionSize size_of(const Region& region);

/// Returns the largest sizes of the tiles that a frame is split into.
RegionSize largest_tile(const RawDn& raw, const DevelopPlan& plan, const TileLimits& limits);

/// Returns whether a frame is rendered in tiles: a Bayer frame above TileLimits::max_whole_px whose mosaic is
/// processed in floats. Frames rendered directly from codes need no mosaic. Never split, whatever their size, are
/// frames that are demosaiced or monochrome, looks that are made of the entire image or tabulated (`--look`), noise
/// that is held to a limit, maps of the noise, reconstructed highlights, sharpening, local tone, and frames in which
/// previous ones take part.
bool is_tiled(const RawDn& raw, const DevelopPlan& plan, const TileLimits& limits);

}  // namespace lowlux::isp
