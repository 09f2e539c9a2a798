#include "isp/pipeline/render/pixel_noise_reducer.h"

#include <algorithm>
#include <cassert>
#include <cstdint>
#include <memory>
#include <span>
#include <utility>

#include "isp/pipeline/render/level_parts.h"
#include "isp/pipeline/render/map_views.h"
#include "isp/pipeline/render/pixel_cells.h"
#include "isp/raw/corrections.h"

namespace lowlux::isp {
namespace {

/// Returns a region of sites in pixels. Cores and their margins begin and end at even columns and rows.
Rect pixels_of(const Rect& sites) { return {sites.x / 2, sites.y / 2, sites.width / 2, sites.height / 2}; }

/// Returns the decision in sites: the blocks of the noise ratio are twice as large.
NoiseReduction in_sites(const NoiseReduction& how) {
  NoiseReduction out = how;
  out.options.sites_coincide = true;
  if (!how.noise_ratio) return out;
  const Plane<float>& of_pixels = how.noise_ratio->ratio;
  NoiseRatio ratio{.block_px = 2 * how.noise_ratio->block_px,
                   .ratio = Plane<float>(of_pixels.width(), of_pixels.height())};
  std::copy_n(of_pixels.data(), of_pixels.size(), ratio.ratio.data());
  out.noise_ratio = std::make_shared<const NoiseRatio>(std::move(ratio));
  return out;
}

struct TileSize {
  int width = 0;
  int height = 0;
};

/// Returns the largest width and height of a padded tile, in sites.
TileSize largest_tile(const TileGrid& grid, const TileMargin& margin, int width, int height) {
  TileSize out;
  for (int i = 0; i < grid.count(); ++i) {
    const Rect whole = with_margin(grid.core(i), margin, width, height);
    out = {std::max(out.width, whole.width), std::max(out.height, whole.height)};
  }
  return out;
}

}  // namespace

std::size_t PixelNoiseReducer::bytes(const RawDn& raw, const NoiseReduction& how, int threads) {
  if (!how.level) return 0;
  const int width = raw.active.width, height = raw.active.height;
  const TileGrid grid({0, 0, 2 * width, 2 * height}, TileLimits{}.side_px);
  const TileSize tile = largest_tile(grid, margin_of(*how.level), 2 * width, 2 * height);
  const std::size_t cells = static_cast<std::size_t>(tile.width) * static_cast<std::size_t>(tile.height);
  const std::size_t pixels = static_cast<std::size_t>(width) * static_cast<std::size_t>(height);
  return sizeof(float) * (cells + static_cast<std::size_t>(planes_of(raw)) * pixels) +
         denoise::Denoiser::bytes(tile.width, tile.height, threads, *how.level);
}

void PixelNoiseReducer::run(std::span<Plane<float>> planes, const NoiseReduction& how, NoiseReducer& noise,
                            NoiseMaps* maps) {
  assert(how.level && how.cell_e && !how.regions && !how.temporal && how.lines.empty());
  const int width = 2 * planes[0].width(), height = 2 * planes[0].height();
  const TileGrid grid({0, 0, width, height}, side_px_);
  const TileMargin margin = margin_of(*how.level);
  const TileSize most = largest_tile(grid, margin, width, height);
  fit(cells_, most.width, most.height);
  Frame frame{planes, view_of(how.noise_ratio.get()), in_sites(how), {}};
  if (maps != nullptr) {
    fit(tile_maps_, most.width, most.height);
    fit(*maps, width, height);
    frame.maps = views_of(*maps);
  }
  noise.reserve_pieces(most.width, most.height, how);
  for (std::size_t c = 0; c < planes.size(); ++c) fit(clean_[c], planes[c].width(), planes[c].height());
  for (int i = 0; i < grid.count(); ++i) {
    const Rect core = grid.core(i);
    if (core.width <= 0 || core.height <= 0) continue;
    const Rect whole = with_margin(core, margin, width, height);
    reduce_tile(frame, {core, whole, width, height, BayerPhase::rggb}, noise);
  }
  for (std::size_t c = 0; c < planes.size(); ++c) std::swap(planes[c], clean_[c]);
}

void PixelNoiseReducer::reduce_tile(const Frame& frame, const NoiseReducer::Piece& piece, NoiseReducer& noise) {
  const Rect &core = piece.core, &whole = piece.whole;
  const Rect from = pixels_of(whole), to = pixels_of(core);
  const NoiseReduction& how = frame.of_sites;
  const std::size_t count = frame.planes.size();
  std::array<PlaneView<const float>, 3> noisy;
  std::array<PlaneView<float>, 3> clean;
  for (std::size_t c = 0; c < count; ++c) {
    noisy[c] = frame.planes[c].view().crop(from.x, from.y, from.width, from.height);
    clean[c] = clean_[c].view().crop(to.x, to.y, to.width, to.height);
  }
  const PlaneView<float> in = cells_.view().crop(0, 0, whole.width, whole.height);
  const PlaneView<float> out = noise.result_memory(whole.width, whole.height, how);
  CellCharge charge{
      .cell_e = *how.cell_e, .noise_ratio = frame.noise_ratio.from(from.x, from.y), .x = from.x, .y = from.y};
  if (count == 3) charge.half_variance_e2 = how.noise.variance_e2[1];
  make_cells(std::span(noisy).first(count), charge, in, executor_);
  denoise::DenoiseMaps maps;
  if (frame.maps.residual_variance.data != nullptr) {
    maps = crop_of(views_of(tile_maps_), {0, 0, whole.width, whole.height});
  }
  noise.run(piece, how, in, out, maps);
  const Rect kept{core.x - whole.x, core.y - whole.y, core.width, core.height};
  join_cells(out.crop(kept.x, kept.y, kept.width, kept.height), *how.cell_e, std::span(clean).first(count), executor_);
  copy(crop_of(maps, kept), crop_of(frame.maps, core));
}

void scale_to_pixels(const RawDn& raw, NoiseMaps& maps) {
  const auto part = static_cast<float>(parts_of(raw)[1]);  // by which the luma of a cell is smaller
  Plane<float>& variance = maps.residual_variance_e2;
  std::transform(variance.data(), variance.data() + variance.size(), variance.data(),
                 [part](float v) { return v / (part * part); });
}

void apply_gains_to_maps(const RawCorrections& corrections, NoiseMaps& maps, Executor& executor) {
  if (corrections.gain_maps.empty() && corrections.radial_gains.empty()) return;
  Plane<float>& variance = maps.residual_variance_e2;
  std::array<Plane<float>, 3> gain;
  for (Plane<float>& plane : gain) {
    plane = Plane<float>(variance.width(), variance.height());
    std::fill_n(plane.data(), plane.size(), 1.0F);
  }
  apply_gains(corrections, RgbView<float>{gain[0].view(), gain[1].view(), gain[2].view()}, executor);
  for (std::size_t i = 0; i < variance.size(); ++i) variance.data()[i] *= gain[1].data()[i] * gain[1].data()[i];
}

}  // namespace lowlux::isp
