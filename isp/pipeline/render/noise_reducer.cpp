#include "isp/pipeline/render/noise_reducer.h"

#include <algorithm>
#include <cassert>
#include <cstddef>
#include <utility>

#include "isp/pipeline/render/frame_tiles.h"
#include "isp/pipeline/render/map_views.h"

namespace lowlux::isp {
namespace {

template <class T>
PlaneView<T> crop_of(const PlaneView<T>& view, const Rect& part) {
  return view.crop(part.x, part.y, part.width, part.height);
}

/// Returns `part` relative to the corner of `piece`.
Rect seen_from(const Rect& piece, const Rect& part) {
  return {part.x - piece.x, part.y - piece.y, part.width, part.height};
}

/// Returns a region of the frame that lies in a tile, with its noise ratio.
denoise::RawElectronsView region_of(const NoiseReducer::Piece& piece, const NoiseReduction& how,
                                    const PlaneView<const float>& raw_e, const Rect& region) {
  return {crop_of(raw_e, seen_from(piece.whole, region)), piece.phase,
          view_of(how.noise_ratio.get()).from(region.x, region.y)};
}

/// Extends a core to an even column and row: it may begin one pixel behind one; what is before then belongs to the
/// margin.
Rect from_even_site(const Rect& core) {
  return {core.x & ~1, core.y & ~1, core.width + (core.x & 1), core.height + (core.y & 1)};
}

/// Returns the padded tile in which the noise of a tile that has a level is reduced.
Rect with_own_margin(const LevelPart& part, const NoiseReducer::Piece& piece) {
  return overlap(with_margin(part.core, margin_of(*part.level), piece.frame_width, piece.frame_height), piece.whole);
}

/// Holds the largest width and height of the tiles that have a level; 0 where none has.
struct PartSize {
  int width = 0;
  int height = 0;
};

PartSize largest(const std::vector<LevelPart>& parts, const NoiseReducer::Piece& piece) {
  PartSize out;
  for (const LevelPart& part : parts) {
    if (!part.level) continue;
    const Rect whole = with_own_margin(part, piece);
    out = {std::max(out.width, whole.width), std::max(out.height, whole.height)};
  }
  return out;
}

/// Holds the sites of one column parity of one row of mosaics, where a mean over frames and a level's result are
/// blended.
struct BlendSites {
  const float* mean_e;    // dark charge included; every second sample
  const float* share;     // one for each cell
  const float* level_e2;  // variance of the level's result, one for each cell
  float dark_e;
  float variance_e2;
};

void blend_sites(const BlendSites& in, int sites, float* signal_e) {
  for (int i = 0; i < sites; ++i) {
    const float mean_e = in.mean_e[2 * i];
    // The charge is that of the level's result: with the noisy mean itself, low values would count more than high ones.
    const float charge_e = std::max(signal_e[2 * i] + in.dark_e, 0.0f);
    const float time_e2 = in.share[i] * (charge_e + in.variance_e2);
    const float level_e2 = NoiseReducer::variance_penalty(in.share[i]) * in.level_e2[i];
    const float way = level_e2 / (level_e2 + time_e2);
    signal_e[2 * i] += way * (mean_e - in.dark_e - signal_e[2 * i]);
  }
}

}  // namespace

void NoiseReducer::reserve_level(int width, int height, denoise::Level most) {
  if (denoiser_ && width <= width_ && height <= height_ && most <= most_) return;
  width_ = std::max(width, width_);
  height_ = std::max(height, height_);
  most_ = std::max(most, most_);
  denoiser_.reset();  // frees its memory before the next one is allocated
  denoiser_ = std::make_unique<denoise::Denoiser>(width_, height_, executor_.width(), most_);
}

void NoiseReducer::reserve_time(int width, int height) {
  if (!temporal_ || width != temporal_width_ || height != temporal_height_) {
    temporal_.reset();
    temporal_ = std::make_unique<denoise::TemporalMean>(width, height, executor_.width());
    temporal_width_ = width;
    temporal_height_ = height;
  }
  fit(mean_e_, width, height);
  fit(variance_fraction_, (width + 1) / 2, (height + 1) / 2);
}

std::size_t NoiseReducer::maps_bytes(int width, int height) {
  return 5 * sizeof(float) * static_cast<std::size_t>((width + 1) / 2) * static_cast<std::size_t>((height + 1) / 2);
}

std::size_t NoiseReducer::bytes(int width, int height, const NoiseReduction& how, bool maps, int threads) {
  if (!how.has_level()) return 0;
  const Piece frame{{0, 0, width, height}, {0, 0, width, height}, width, height};
  std::vector<LevelPart> parts;
  cut_by_level(how, frame.core, TileLimits{}.side_px, parts);
  const PartSize most = largest(parts, frame);
  const std::size_t denoiser = denoise::Denoiser::bytes(most.width, most.height, threads, max_level_of(how));
  if (parts.size() == 1) return denoiser;
  return denoiser + sizeof(float) * static_cast<std::size_t>(most.width) * static_cast<std::size_t>(most.height) +
         (maps ? maps_bytes(most.width, most.height) : 0);
}

void NoiseReducer::reserve_pieces(int width, int height, const NoiseReduction& how) {
  if (how.has_level()) reserve_level(width, height, max_level_of(how));
}

void NoiseReducer::reduce_part(const LevelPart& part, const Piece& piece, const NoiseReduction& how,
                               PlaneView<const float> raw_e, PlaneView<float> signal_e,
                               const denoise::DenoiseMaps& maps) {
  const Rect core = seen_from(piece.whole, part.core);
  if (!part.level) {
    const Rect even = from_even_site(core);
    take_dark_off(crop_of(raw_e, even), how.noise, crop_of(signal_e, even), executor_);
    const denoise::DenoiseMaps of_core = crop_of(maps, core);
    if (of_core.residual_variance.data == nullptr) return;
    return set_own_noise(region_of(piece, how, raw_e, part.core), how, of_core);
  }
  const Rect whole = with_own_margin(part, piece);
  denoise::DenoiseOptions options = how.options;
  options.level = *part.level;
  denoise::DenoiseMaps of_part;
  if (maps.residual_variance.data != nullptr) {
    of_part = crop_of(views_of(part_maps_), {0, 0, whole.width, whole.height});
  }
  const PlaneView<float> out = part_e_.view().crop(0, 0, whole.width, whole.height);
  denoiser_->run(region_of(piece, how, raw_e, whole), how.noise, options, out, of_part, executor_);
  const Rect place = seen_from(whole, part.core);
  copy(crop_of(out, place), crop_of(signal_e, core));
  copy(crop_of(of_part, place), crop_of(maps, core));
}

void NoiseReducer::reduce_by_level(const Piece& piece, const NoiseReduction& how, PlaneView<const float> raw_e,
                                   PlaneView<float> signal_e, const denoise::DenoiseMaps& maps) {
  cut_by_level(how, piece.core, TileLimits{}.side_px, parts_);
  if (parts_.size() == 1 && parts_.front().level) {
    reserve_level(piece.whole.width, piece.whole.height, *parts_.front().level);
    denoise::DenoiseOptions options = how.options;
    options.level = *parts_.front().level;
    return denoiser_->run(region_of(piece, how, raw_e, piece.whole), how.noise, options, signal_e, maps, executor_);
  }
  if (const auto [width, height] = largest(parts_, piece); width > 0) {
    reserve_level(width, height, max_level_of(how));
    if (width > part_e_.width() || height > part_e_.height()) {
      part_e_ = Plane<float>(std::max(width, part_e_.width()), std::max(height, part_e_.height()));
    }
    if (maps.residual_variance.data != nullptr) fit(part_maps_, part_e_.width(), part_e_.height());
  }
  for (const LevelPart& part : parts_) reduce_part(part, piece, how, raw_e, signal_e, maps);
}

void NoiseReducer::reduce_by_time(const denoise::RawElectronsView& raw, const NoiseReduction& how) {
  if (how.temporal->restart) temporal_->reset();
  moved_ = temporal_->run(raw, how.noise, how.temporal->light, how.temporal->options, mean_e_.view(),
                          variance_fraction_.view(), executor_);
}

void NoiseReducer::blend(BayerPhase phase, const NoiseReduction& how, const denoise::DenoiseMaps& level,
                         PlaneView<float> signal_e) {
  for_each_band(executor_, signal_e.height, [&](RowBand band, int) {
    for (int y = band.first; y < band.last; ++y) {
      for (int column = 0; column < std::min(2, signal_e.width); ++column) {
        const auto colour = static_cast<std::size_t>(colour_at(phase, column, y));
        const BlendSites sites{mean_e_.row(y) + column, variance_fraction_.row(y / 2),
                               level.site_variance[colour].row(y / 2),
                               static_cast<float>(how.noise.dark_mean_e[site_of(column, y)]),
                               static_cast<float>(how.noise.variance_e2[colour])};
        blend_sites(sites, (signal_e.width + 1 - column) / 2, signal_e.row(y) + column);
      }
    }
  });
}

void NoiseReducer::run(const Piece& piece, const NoiseReduction& how, PlaneView<const float> raw_e,
                       PlaneView<float> signal_e, const denoise::DenoiseMaps& maps) {
  assert(how.reduces());
  moved_ = 0;
  if (!how.temporal) return reduce_by_level(piece, how, raw_e, signal_e, maps);
  assert(piece.whole.width == piece.frame_width && piece.whole.height == piece.frame_height);
  reserve_time(raw_e.width, raw_e.height);
  reduce_by_time({raw_e, piece.phase}, how);
  if (!how.has_level()) return take_dark_off(std::as_const(mean_e_).view(), how.noise, signal_e, executor_);
  denoise::DenoiseMaps of_level = maps;
  if (maps.residual_variance.data == nullptr) {
    fit(level_maps_, raw_e.width, raw_e.height);
    of_level = views_of(level_maps_);
  }
  reduce_by_level(piece, how, raw_e, signal_e, of_level);
  blend(piece.phase, how, of_level, signal_e);
}

}  // namespace lowlux::isp
