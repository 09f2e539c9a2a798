#include "isp/pipeline/render/noise_reducer.h"

#include <algorithm>
#include <array>
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

constexpr int block_cells = 4;   // of a side of the blocks in which lost detail is measured
constexpr int strip_cells = 64;  // blocks are blended side by side
constexpr float max_detail = 4;  // variance of lost detail, over that of the level's noise
constexpr float smallest_e2 = 1e-20f;

/// Holds the sites of one column parity of one row of mosaics, where a mean over frames and a level's result are
/// blended.
struct BlendSites {
  const float* mean_e;    // dark charge included; every second sample
  const float* share;     // variance of the mean over that of a raw value, one for each cell
  const float* level_e2;  // variance of the level's result, one for each cell
  float* signal_e;        // the level's result; every second sample
  int sites;
  std::size_t colour;
  float dark_e;
  float variance_e2;

  float difference(int i) const { return mean_e[2 * i] - dark_e - signal_e[2 * i]; }
  /// Returns the variance of the mean. The charge is that of the level's result: with the noisy mean itself, low values
  /// would count more than high ones.
  float mean_e2(int i) const { return share[i] * (std::max(signal_e[2 * i] + dark_e, 0.0f) + variance_e2); }
};

/// Sums over the sites of cells.
struct CellSums {
  std::array<float, strip_cells> squares{};                     // squares of differences, less their expectation
  std::array<std::array<float, strip_cells>, 3> differences{};  // of R, G, B
  std::array<std::array<float, strip_cells>, 3> sites{};        // their number
};

/// Adds the differences to the sums of cells. The frame is in both results, so that the mean shares a part `share` of
/// the level's noise.
void add_detail(const BlendSites& in, CellSums& sums) {
  for (int i = 0; i < in.sites; ++i) {
    const float d = in.difference(i);
    sums.differences[in.colour][i] += d;
    sums.sites[in.colour][i] += 1;
    sums.squares[i] += d * d - in.mean_e2(i) - (1 - 2 * in.share[i]) * in.level_e2[i];
  }
}

/// @param detail_e2  variance of the detail that the level has lost, for each cell
void blend_sites(const BlendSites& in, const float* detail_e2) {
  for (int i = 0; i < in.sites; ++i) {
    const float level_e2 = in.level_e2[i] + std::min(detail_e2[i], max_detail * in.level_e2[i]);
    const float without_frame = (1 - in.share[i]) * level_e2;
    in.signal_e[2 * i] += without_frame / (without_frame + in.mean_e2(i) + smallest_e2) * in.difference(i);
  }
}

/// Replaces the sums of squares by the mean over the sites of their block without those of the mean differences of
/// colours, at least 0: a level keeps the means of blocks, so that what differs there has moved.
/// @param columns  number of columns of sites
void average_blocks(CellSums& sums, int columns, int rows) {
  constexpr int block = 2 * block_cells;
  for (int x = 0; x < columns; x += block) {
    const int first = x / 2, sites = std::min(block, columns - x), last = first + (sites + 1) / 2;
    const auto count = static_cast<float>(sites * rows);
    float squares = 0;
    for (int i = first; i < last; ++i) squares += sums.squares[i];
    for (int c = 0; c < 3; ++c) {
      float difference = 0, of_colour = 0;
      for (int i = first; i < last; ++i) difference += sums.differences[c][i], of_colour += sums.sites[c][i];
      squares -= difference * difference / std::max(of_colour, 1.0f);
    }
    const float detail_e2 = std::max(squares / count, 0.0f);
    std::fill(sums.squares.begin() + first, sums.squares.begin() + last, detail_e2);
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
  split_by_level(how, frame.core, TileLimits{}.side_px, parts);
  const PartSize most = largest(parts, frame);
  const std::size_t denoiser = denoise::Denoiser::bytes(most.width, most.height, threads, max_level_of(how));
  if (parts.size() == 1) return denoiser;
  return denoiser + sizeof(float) * static_cast<std::size_t>(most.width) * static_cast<std::size_t>(most.height) +
         (maps ? maps_bytes(most.width, most.height) : 0);
}

void NoiseReducer::reserve_pieces(int width, int height, const NoiseReduction& how) {
  if (how.has_level()) reserve_level(width, height, max_level_of(how));
}

PlaneView<float> NoiseReducer::result_memory(int width, int height, const NoiseReduction& how) {
  assert(has_result_memory(how));
  reserve_level(width, height, *how.level);
  return denoiser_->result_memory(width, height);
}

void NoiseReducer::reduce_part(const LevelPart& part, const Piece& piece, const NoiseReduction& how,
                               PlaneView<const float> raw_e, PlaneView<float> signal_e,
                               const denoise::DenoiseMaps& maps) {
  const Rect core = seen_from(piece.whole, part.core);
  if (!part.level) {
    const Rect even = from_even_site(core);
    subtract_dark_charge(crop_of(raw_e, even), how.noise, crop_of(signal_e, even), executor_);
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
  split_by_level(how, piece.core, TileLimits{}.side_px, parts_);
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
  constexpr int block = 2 * block_cells;
  const auto sites_at = [&](int cell, int column, int y) {
    const auto colour = static_cast<std::size_t>(colour_at(phase, column, y));
    const int x = 2 * cell + column;
    return BlendSites{mean_e_.row(y) + x,
                      variance_fraction_.row(y / 2) + cell,
                      level.site_variance[colour].row(y / 2) + cell,
                      signal_e.row(y) + x,
                      std::min(strip_cells, (signal_e.width + 1 - x) / 2),
                      colour,
                      static_cast<float>(how.noise.dark_mean_e[site_of(column, y)]),
                      static_cast<float>(how.noise.variance_e2[colour])};
  };
  const int cells = (signal_e.width + 1) / 2, columns = std::min(2, signal_e.width);
  for_each_band(executor_, (signal_e.height + block - 1) / block, [&](RowBand band, int) {
    for (int top = block * band.first; top < std::min(block * band.last, signal_e.height); top += block) {
      const int bottom = std::min(top + block, signal_e.height);
      for (int cell = 0; cell < cells; cell += strip_cells) {
        CellSums sums;
        const auto each_row = [&](const auto& work) {
          for (int y = top; y < bottom; ++y) {
            for (int column = 0; column < columns; ++column) {
              if (2 * cell + column < signal_e.width) work(sites_at(cell, column, y));
            }
          }
        };
        each_row([&](const BlendSites& sites) { add_detail(sites, sums); });
        average_blocks(sums, std::min(2 * strip_cells, signal_e.width - 2 * cell), bottom - top);
        each_row([&](const BlendSites& sites) { blend_sites(sites, sums.squares.data()); });
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
  if (!how.has_level()) return subtract_dark_charge(std::as_const(mean_e_).view(), how.noise, signal_e, executor_);
  denoise::DenoiseMaps of_level = maps;
  if (maps.residual_variance.data == nullptr) {
    fit(level_maps_, raw_e.width, raw_e.height);
    of_level = views_of(level_maps_);
  }
  reduce_by_level(piece, how, raw_e, signal_e, of_level);
  blend(piece.phase, how, of_level, signal_e);
}

}  // namespace lowlux::isp
