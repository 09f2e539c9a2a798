#include "isp/pipeline/render/region.h"

#include <algorithm>
#include <cstdint>

#include "isp/pipeline/render/frame_needs.h"
#include "isp/pipeline/render/level_parts.h"
#include "isp/pipeline/render/pixel_cells.h"

namespace lowlux::isp {
namespace {

constexpr int repair_reach_px = 6;

/// Returns the margin of a tile: without noise reduction a pixel depends on its neighbours only, as far as demosaicing
/// and repair reach.
TileMargin margin_in(const DevelopPlan& plan) {
  const int reach = reach_px(plan.demosaic.demosaic.method) + repair_reach_px;
  if (!plan.noise_reduction.reduces()) return {.px = reach, .lattice = 2};
  return plan.noise_reduction.has_level() ? margin_of(max_level_of(plan.noise_reduction)) : TileMargin{};
}

}  // namespace

Region whole_frame(const RawDn& raw) {
  const Rect active{0, 0, raw.active.width, raw.active.height};
  return {raw.default_crop, raw.default_crop, active, active};
}

Region tile_region(const RawDn& raw, const DevelopPlan& plan, const Rect& core) {
  Rect seen = core;
  if (!plan.options.half) {
    const int reach = reach_px(plan.demosaic.demosaic.method);
    seen = overlap({core.x - reach, core.y - reach, core.width + 2 * reach, core.height + 2 * reach}, raw.default_crop);
  }
  return {core, seen, seen, with_margin(core, margin_in(plan), raw.active.width, raw.active.height)};
}

Rect pixels_of(const RawDn& raw, const DevelopPlan& plan, const Rect& core) {
  const int cell = plan.options.half ? 2 : 1;
  return {(core.x - raw.default_crop.x) / cell, (core.y - raw.default_crop.y) / cell, core.width / cell,
          core.height / cell};
}

RegionSize size_of(const Region& region) {
  return {region.mosaic.width, region.mosaic.height, region.seen.width, region.seen.height};
}

RegionSize largest_tile(const RawDn& raw, const DevelopPlan& plan, const TileLimits& limits) {
  const TileGrid grid(raw.default_crop, limits.side_px);
  RegionSize out;
  for (int i = 0; i < grid.count(); ++i) {
    const RegionSize tile = size_of(tile_region(raw, plan, grid.core(i)));
    out = {std::max(out.mosaic_width, tile.mosaic_width), std::max(out.mosaic_height, tile.mosaic_height),
           std::max(out.seen_width, tile.seen_width), std::max(out.seen_height, tile.seen_height)};
  }
  return out;
}

bool is_tiled(const RawDn& raw, const DevelopPlan& plan, const TileLimits& limits) {
  const std::int64_t pixels = std::int64_t{raw.active.width} * raw.active.height;
  return pixels > limits.max_whole_px && is_mosaic(raw) && !plan.from_codes && raw.default_crop.width > 0 &&
         raw.default_crop.height > 0 && !needs_grid(plan) && !needs_seeing_map(plan) && !needs_table(plan) &&
         !finishes(plan) && !keeps_maps(plan) && !plan.noise_reduction.temporal;
}

}  // namespace lowlux::isp
