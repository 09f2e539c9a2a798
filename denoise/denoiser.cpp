#include "denoise/denoiser.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <cstring>
#include <span>

#include "denoise/spatial/area_means.h"
#include "denoise/spatial/bands.h"
#include "denoise/spatial/chroma_start.h"
#include "denoise/spatial/frame_memory.h"
#include "denoise/spatial/local_noise.h"
#include "denoise/spatial/nl_bayes.h"
#include "denoise/spatial/passes.h"
#include "denoise/spatial/point_sources.h"
#include "denoise/spatial/rows.h"
#include "denoise/spatial/saturated_chroma.h"
#include "denoise/spatial/site_slopes.h"
#include "denoise/spatial/stabiliser.h"

namespace lowlux::denoise {
namespace {

/// The raw sites of a tile of cells.
struct TileOfSites {
  int left, top, right, bottom;
};

/// State of one call of Denoiser::run.
struct Run {
  FrameMemory& memory;
  const RawElectronsView& raw;
  const RawNoise& noise;
  const DenoiseOptions& options;
  Workers workers;
  int columns;
  int rows;
  int levels;
  std::array<double, 3> dark_e;     // R, G, B
  float max_ratio;                  // largest noise ratio
  double offset_e = 0;              // offset of the stabiliser
  PlaneView<std::uint8_t> sources;  // no data: no search for point sources

  Run(FrameMemory& m, const RawElectronsView& r, const RawNoise& n, const DenoiseOptions& o, Executor& executor)
      : memory(m),
        raw(r),
        noise(n),
        options(o),
        workers{executor, static_cast<int>(m.thread.size())},
        columns((r.value.width + 1) / 2),
        rows((r.value.height + 1) / 2),
        levels(levels_of(columns, rows)),
        max_ratio(r.noise_ratio.largest()) {
    const PerSite<int> site = sites_of(r.phase);
    dark_e = {n.dark_mean_e[site[0]], (n.dark_mean_e[site[1]] + n.dark_mean_e[site[2]]) / 2, n.dark_mean_e[site[3]]};
    offset_e = stabilising_offset(dark_e, noise, static_cast<double>(max_ratio), options);
    const int width = padded(columns, levels), height = padded(rows, levels);
    for (int l = 0; l < levels; ++l) {
      m.level[l].width = width >> l;
      m.level[l].height = height >> l;
    }
  }

  void find_sources();
  /// Calls work(x, raw value - background) for the sites of raw row y that belong to point sources.
  template <class Work>
  void for_each_source_site(int y, const Work& work) const;
  TileOfSites sites_of_tile(int x, int y) const;
  ChromaStarts starts() const;
  rows::PackRow packing(const FrontMemory& m) const;
  void pack(int virtual_row, bool planes, const FrontMemory& m) const;
  /// Returns the least raw mean that the variance of colour k is computed of.
  float min_e(int k) const { return static_cast<float>(0.3 * dark_e[k] + 0.02); }
  void front() const;
  std::span<const float> removed(const PlaneSet& planes) const;
  void keep_partly_saturated(int y, const UnpackMemory& m) const;
  void undo_excessive_changes(int y, float* ratio, float* signal) const;
  void unpack(const PlaneSet& planes, PlaneView<float> signal_e, const DenoiseMaps& maps) const;
  void restore_means(PlaneView<float> signal_e, const DenoiseMaps& maps) const;
};

void Run::find_sources() {
  if (!options.keep_point_sources) return;
  sources = memory.sources.view().crop(0, 0, columns, rows);
  find_point_sources(raw, noise, workers, memory.search.data(), sources);
}

template <class Work>
void Run::for_each_source_site(int y, const Work& work) const {
  if (sources.data == nullptr) return;
  const std::uint8_t *const cells = sources.row(y / 2), *const end = cells + columns;
  for (const std::uint8_t* at = std::find(cells, end, 1); at != end; at = std::find(at + 1, end, 1)) {
    const auto x = static_cast<int>(2 * (at - cells));
    for (int i = x; i < std::min(x + 2, raw.value.width); ++i) {
      const float e = raw.value.at(i, y);
      const double value = std::isnan(e) ? 0 : std::clamp(static_cast<double>(e), -largest_e, largest_e);
      work(i, static_cast<float>(value - background_e(raw, sources, i, y)));
    }
  }
}

TileOfSites Run::sites_of_tile(int x, int y) const {
  const auto edge = [](int i, int count, int size) { return i == count ? size : std::min(size, 2 * tile * i); };
  const int across = tiles_of(columns), down = tiles_of(rows);
  return {edge(x, across, raw.value.width), edge(y, down, raw.value.height), edge(x + 1, across, raw.value.width),
          edge(y + 1, down, raw.value.height)};
}

/// Finds the chroma start of each tile; one thread sums each row of tiles, so that sums are the same for every number
/// of threads.
ChromaStarts Run::starts() const {
  ChromaStarts out;
  out.columns = tiles_of(columns);
  out.rows = tiles_of(rows);
  const auto tiles = static_cast<std::size_t>(out.columns) * static_cast<std::size_t>(out.rows);
  out.start = std::span(memory.starts).first(tiles);
  out.has_chroma = std::span(memory.has_chroma).first(tiles * max_levels);
  const double dark = (dark_e[0] + 2 * dark_e[1] + dark_e[2]) / 4;
  const double variance = (noise.variance_e2[0] + 2 * noise.variance_e2[1] + noise.variance_e2[2]) / 4;
  in_bands(workers, out.rows, [&](int first, int last, int) {
    for (int i = first * out.columns; i < last * out.columns; ++i) {
      int start = options.chroma_start.value_or(0);
      if (!options.chroma_start) {
        const auto [left, top, right, bottom] = sites_of_tile(i % out.columns, i / out.columns);
        double sum = 0;
        for (int row = top; row < bottom; ++row) sum += rows::sum_of(raw.value.row(row) + left, right - left);
        const double mean = sum / (static_cast<double>(right - left) * (bottom - top));
        start = start_of(mean - dark, dark, variance, raw.noise_ratio.mean(left, top, right - left, bottom - top));
        if (options.level == Level::best && start == 1) start = 0;
      }
      out.start[i] = static_cast<float>(std::min(start, levels - 1));
    }
  });
  complete(out);
  return out;
}

rows::PackRow Run::packing(const FrontMemory& m) const {
  rows::PackRow in{};
  for (int i = 0; i < 2; ++i) in.raw[i] = m.raw[i];
  in.red_is_odd = red_column(raw.phase) == 1;
  in.cells = columns;
  in.offset_e = static_cast<float>(offset_e);
  for (int k = 0; k < 3; ++k) {
    in.saturation_e[k] = static_cast<float>(noise.saturation_e[k]);
    in.dark_e[k] = static_cast<float>(dark_e[k]);
    in.gain[k] = static_cast<float>(options.white_gain[k]);
  }
  return in;
}

/// Packs one row of cells, mirrored beyond the ends of the frame, into the window, and if `planes` into level 0.
void Run::pack(int virtual_row, bool planes, const FrontMemory& m) const {
  const int row = mirrored(virtual_row, rows), width = raw.value.width;
  const int red_y = red_row(raw.phase), slot = (virtual_row + 16) % 16, padded_columns = memory.level[0].width;
  for (int i = 0; i < 2; ++i) {
    const int raw_y = raw_of(row, i == 0 ? red_y : 1 - red_y, raw.value.height);
    std::memcpy(m.raw[i], raw.value.row(raw_y), width * sizeof(float));
    for_each_source_site(raw_y, [&](int x, float excess) { m.raw[i][x] -= excess; });
    if (width % 2 != 0) m.raw[i][width] = m.raw[i][width - 2];
  }
  rows::PackedRow out{};
  for (int k = 0; k < 3; ++k) out.raw_e[k] = m.window[k][slot];
  out.saturated = m.saturated;
  if (planes) {
    for (int p = 0; p < 4; ++p) out.plane[p] = memory.level[0].noisy.row(p, virtual_row);
  }
  rows::pack_row(packing(m), out);
  const auto mirror = [&](float* cells, int before, int after) {
    for (int i = 1; i <= before; ++i) cells[-i] = cells[mirrored(-i, columns)];
    for (int i = columns; i < padded_columns + after; ++i) cells[i] = cells[mirrored(i, columns)];
  };
  for (float* const raw_e : out.raw_e) mirror(raw_e, 4, 4);
  if (!planes) return;
  mirror(out.saturated, 0, 0);
  for (float* const plane : out.plane) mirror(plane, 0, 0);
  std::uint8_t* const saturated = memory.saturated.row(virtual_row);
  for (int i = 0; i < padded_columns; ++i) saturated[i] = out.saturated[i] != 0 ? 1 : 0;
}

/// Computes the planes and variances of level 0.
void Run::front() const {
  const PyramidLevel& level = memory.level[0];
  in_bands(workers, level.height / 2, [&](int first, int last, int thread) {
    const FrontMemory& m = memory.thread[thread].front;
    const ScratchUse use(m.scratch);
    int packed = 2 * first - 4;
    for (int pair = first; pair < last; ++pair) {
      for (; packed < 2 * pair + 6; ++packed) pack(packed, packed >= 2 * first && packed < 2 * last, m);
      rows::VarianceRow in{};
      for (int k = 0; k < 3; ++k) {
        for (int y = 0; y < 10; ++y) in.raw_e[k][y] = m.window[k][(2 * pair - 4 + y + 16) % 16];
        in.min_e[k] = min_e(k);
        in.gain[k] = static_cast<float>(options.white_gain[k] * std::sqrt(options.variance_scale[0]));
        in.balance[k] = static_cast<float>(options.white_gain[k]);
        in.dark_e[k] = static_cast<float>(dark_e[k]);
        in.variance_e2[k] = static_cast<float>(noise.variance_e2[k]);
      }
      in.cells = level.width;
      in.offset_e = static_cast<float>(offset_e);
      if (!raw.noise_ratio.is_one()) {
        ratio_of_squares(raw.noise_ratio, columns, rows, pair, {m.ratio, static_cast<std::size_t>(level.width / 2)});
        in.ratio = m.ratio;
        in.max_ratio = max_ratio;
        for (int p = 0; p < 3; ++p) {
          for (int i = 0; i < 2; ++i) in.plane[p][i] = level.noisy.row(p, 2 * pair + i);
        }
      }
      float* const out[4] = {level.variance.row(0, pair), level.variance.row(1, pair), level.variance.row(2, pair),
                             level.variance.row(3, pair)};
      rows::variance_row(in, m.variance, out);
    }
  });
}

/// Computes for each tile what removed noise is missing in the means, as a factor of the variance of RawNoise.
std::span<const float> Run::removed(const PlaneSet& planes) const {
  const int across = tiles_of(columns), down = tiles_of(rows);
  const auto out = std::span(memory.removed).first(static_cast<std::size_t>(across) * static_cast<std::size_t>(down));
  removed_noise(memory.level[0], planes, offset_e, columns, rows, workers, out);
  for (std::size_t i = 0; i < out.size(); ++i) {
    const TileOfSites at = sites_of_tile(static_cast<int>(i) % across, static_cast<int>(i) / across);
    const double ratio = raw.noise_ratio.mean(at.left, at.top, at.right - at.left, at.bottom - at.top);
    const double missing = static_cast<double>(max_ratio) - (1 - static_cast<double>(out[i])) * ratio;
    out[i] = static_cast<float>(options.variance_scale[0] * missing);
  }
  return out;
}

/// Gives the sites of cells that are saturated in part their measured values, and their variance: at the edge of a
/// lamp, a cell without chroma would spread it.
void Run::keep_partly_saturated(int y, const UnpackMemory& m) const {
  const PerSite<int> site = sites_of(raw.phase);
  const std::uint8_t* const first = memory.saturated.row(y);
  const std::uint8_t* const last = first + columns;
  for (const std::uint8_t* at = std::find(first, last, 1); at != last; at = std::find(at + 1, last, 1)) {
    const auto x = static_cast<int>(at - first);
    std::array<double, 4> value_e{};
    int saturated = 0;
    for (int k = 0; k < 4; ++k) {
      const float e = raw.value.at(raw_of(x, site[k] & 1, raw.value.width), raw_of(y, site[k] >> 1, raw.value.height));
      value_e[k] = std::isnan(e) ? 0 : std::clamp(static_cast<double>(e), -largest_e, largest_e);
      if (value_e[k] >= noise.saturation_e[(k + 1) / 2]) ++saturated;
    }
    if (saturated == 4) continue;
    for (int k = 0; k < 4; ++k) {
      const int row = (site[k] >> 1) == red_row(raw.phase) ? 0 : 1;
      m.signal[row][2 * x + (site[k] & 1)] = static_cast<float>(value_e[k] - dark_e[(k + 1) / 2]);
    }
    const double ratio = static_cast<double>(raw.noise_ratio.at(2 * x, 2 * y)) * options.variance_scale[0];
    const std::array<double, 3> mean_e{value_e[0], (value_e[1] + value_e[2]) / 2, value_e[3]};
    double luma = 0;
    for (int k = 0; k < 3; ++k) {
      const double own = ratio * (std::max(mean_e[k], static_cast<double>(min_e(k))) + noise.variance_e2[k]);
      m.residual[k + 1][x] = static_cast<float>(own);
      luma += (k == 1 ? 0.18 : 0.04) * own * options.white_gain[k] * options.white_gain[k];
    }
    m.residual[0][x] = static_cast<float>(luma);
  }
}

/// Takes back what changed values of row y by much more than their noise: see rows::ChangedRow. Lamps of a merged raw
/// can be 1e5 times as bright as the sites next to them and have 1000 times the noise ratio; errors below their noise
/// are not below that of these sites. Cells that hold saturated sites stay as they are.
void Run::undo_excessive_changes(int y, float* ratio, float* signal) const {
  const int width = raw.value.width;
  raw.noise_ratio.row(0, 1, y, {ratio, static_cast<std::size_t>(width)});
  const std::uint8_t *const first = memory.saturated.row(y / 2), *const last = first + columns;
  for (const std::uint8_t* at = std::find(first, last, 1); at != last; at = std::find(at + 1, last, 1)) {
    const auto x = 2 * (at - first);
    ratio[x] = ratio[x + 1] = std::numeric_limits<float>::infinity();
  }
  rows::ChangedRow in{.raw_e = raw.value.row(y), .ratio = ratio, .width = width};
  in.variance_scale = static_cast<float>(options.variance_scale[0]);
  for (int odd = 0; odd < 2; ++odd) {
    const auto k = static_cast<std::size_t>(colour_at(raw.phase, odd, y));
    in.dark_e[odd] = static_cast<float>(dark_e[k]);
    in.min_e[odd] = min_e(static_cast<int>(k));
    in.variance_e2[odd] = static_cast<float>(noise.variance_e2[k]);
  }
  rows::undo_excessive_row(in, signal);
}

/// Converts the planes of level 0 back to a mosaic.
void Run::unpack(const PlaneSet& planes, PlaneView<float> signal_e, const DenoiseMaps& maps) const {
  const PyramidLevel& level = memory.level[0];
  const SiteSlopes slopes = options.sites_coincide ? SiteSlopes{} : site_slopes(raw.phase);
  const std::span<const float> removed_of_tiles = removed(planes);
  repeat_luma_edges(planes, columns, rows, workers);
  in_bands(workers, rows, [&](int first, int last, int thread) {
    const UnpackMemory& m = memory.thread[thread].unpack;
    const ScratchUse use(m.scratch);
    for (int y = first; y < last; ++y) {
      rows::UnpackRow in{};
      const int half = level.height / 2, far = std::clamp(y % 2 == 0 ? y / 2 - 1 : y / 2 + 1, 0, half - 1);
      for (int p = 0; p < 4; ++p) {
        rows::smooth_row({{nullptr, level.residual.row(p, y / 2), nullptr},
                          {nullptr, level.residual.row(p, far), nullptr},
                          level.width / 2},
                         m.up, m.residual[p]);
        in.plane[p] = planes.row(p, y);
        in.residual[p] = m.residual[p];
      }
      interpolate_row(removed_of_tiles, tiles_of(columns), tiles_of(rows), 0, y,
                      {m.removed, static_cast<std::size_t>(columns)});
      in.removed = m.removed;
      in.offset_e = static_cast<float>(offset_e);
      const std::uint8_t* const saturated = memory.saturated.row(y);
      for (int x = 0; x < columns; ++x) m.seen[x] = saturated[x] != 0 ? 0.0f : 1.0f;
      in.seen = m.seen;
      in.cells = columns;
      in.rho = std::isinf(options.rho) ? -1.0f : static_cast<float>(options.rho);
      for (int k = 0; k < 3; ++k) {
        in.per_gain[k] = static_cast<float>(1 / options.white_gain[k]);
        in.dark_e[k] = static_cast<float>(dark_e[k]);
        in.min_e[k] = min_e(k);
        in.variance_e2[k] = static_cast<float>(noise.variance_e2[k]);
      }
      in.red_is_odd = red_column(raw.phase) == 1;
      in.sites_coincide = options.sites_coincide;
      const LumaRows luma = luma_rows(planes, y, rows);
      in.neighbour_luma[0] = luma.above;
      in.neighbour_luma[1] = luma.below;
      in.slopes = {slopes.c2_x, slopes.c2_y, slopes.c3_x, slopes.c3_y};
      rows::unpack_row(
          in, {{m.signal[0], m.signal[1]}, m.confidence, m.residual[0], {m.residual[1], m.residual[2], m.residual[3]}});
      keep_partly_saturated(y, m);
      for (int i = 0; i < 2; ++i) {
        const int raw_y = 2 * y + (i == 0 ? red_row(raw.phase) : 1 - red_row(raw.phase));
        if (raw_y >= signal_e.height) continue;
        for_each_source_site(raw_y, [&](int x, float excess) { m.signal[i][x] += excess; });
        if (!raw.noise_ratio.is_one()) undo_excessive_changes(raw_y, m.ratio, m.signal[i]);
        std::memcpy(signal_e.row(raw_y), m.signal[i], signal_e.width * sizeof(float));
      }
      const auto put = [&](PlaneView<float> map, const float* from) {
        if (map.data != nullptr) std::memcpy(map.row(y), from, columns * sizeof(float));
      };
      put(maps.residual_variance, m.residual[0]);
      put(maps.chroma_confidence, m.confidence);
      for (int k = 0; k < 3; ++k) put(maps.site_variance[k], m.residual[k + 1]);
    }
  });
}

void Run::restore_means(PlaneView<float> signal_e, const DenoiseMaps& maps) const {
  denoise::restore_means({.raw = raw,
                          .noise = noise,
                          .variance_scale = options.variance_scale[max_levels - 1],
                          .white_gain = options.white_gain,
                          .dark_e = dark_e,
                          .min_e = {min_e(0), min_e(1), min_e(2)},
                          .sources = sources,
                          .saturated = memory.saturated.view()},
                         memory, workers, signal_e, maps);
}

[[maybe_unused]] bool usable(const RawNoise& noise, const DenoiseOptions& options) {
  const auto within = [](double x, double least, double most) { return x >= least && x <= most; };
  bool good = options.rho > 0;
  for (const double saturation : noise.saturation_e) good = good && saturation > 0;
  for (const double variance : noise.variance_e2) good = good && within(variance, 0, largest_e);
  for (const double dark : noise.dark_mean_e) good = good && within(dark, 0, largest_e);
  for (const double gain : options.white_gain) good = good && within(gain, 1e-3, 1e3);
  for (const double scale : options.variance_scale) good = good && within(scale, 0.01, 100);
  return good && within(options.chroma_start.value_or(0), 0, 2);
}

}  // namespace

struct Denoiser::State {
  FrameMemory memory;
};

Denoiser::Denoiser(int max_width, int max_height, int threads, Level most)
    : state_(new State{FrameMemory(max_width, max_height, threads, most == Level::best)}) {}
Denoiser::~Denoiser() = default;

std::size_t Denoiser::bytes(int max_width, int max_height, int threads, Level most) {
  return FrameMemory::bytes(max_width, max_height, threads, most == Level::best);
}

PlaneView<float> Denoiser::result_memory(int width, int height) const {
  assert((width + 1) / 2 <= state_->memory.columns && (height + 1) / 2 <= state_->memory.rows);
  return state_->memory.mosaic(width, height);
}

void Denoiser::run(const RawElectronsView& raw, const RawNoise& noise, const DenoiseOptions& options,
                   PlaneView<float> signal_e, const DenoiseMaps& maps, Executor& executor) {
  assert(raw.value.width >= 2 && raw.value.height >= 2);
  assert(signal_e.width == raw.value.width && signal_e.height == raw.value.height);
  assert(usable(noise, options));
  assert(options.level != Level::best || !state_->memory.patches.empty());
  Run run(state_->memory, raw, noise, options, executor);
  assert(run.columns <= state_->memory.columns && run.rows <= state_->memory.rows);
  run.find_sources();
  const ChromaStarts starts = run.starts();
  const PassFrame frame{state_->memory, starts, run.levels, run.workers, options.variance_scale};
  run.front();
  if (!options.sites_coincide) {
    subtract_slopes(state_->memory.level[0], raw.phase, run.columns, run.rows, run.workers);
  }
  fill_saturated_chroma(state_->memory, run.levels, run.workers);
  build_pyramid(frame);
  const int rows_apart = options.level >= Level::high ? 2 : 4;
  run_pass(frame, 0, rows_apart);
  int last = 0;
  if (options.level != Level::draft) {
    run_pass(frame, 1, rows_apart);
    last = 1;
  }
  if (options.level == Level::best) {
    nl_bayes(frame);
    last = 0;
  }
  add_residuals(frame);
  run.unpack(state_->memory.level[0].value[last], signal_e, maps);
  if (options.keep_means) run.restore_means(signal_e, maps);
}

std::string_view name_of(Level level) {
  constexpr std::array<std::string_view, all_levels.size()> names{"draft", "standard", "high", "best"};
  return names[static_cast<std::size_t>(level)];
}

const char* denoiser_target() { return rows::target_name(); }

}  // namespace lowlux::denoise
