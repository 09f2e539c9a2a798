#include "isp/raw/raw_to_rgb.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <cstdlib>
#include <limits>

#include "isp/raw/raw_to_rgb_rows.h"

namespace lowlux::isp {
namespace {

using rows::Colour;
using rows::LookRow;
using rows::MosaicRows;
using rows::PlaneRows;
using rows::RowLevels;
using rows::SplitRow;

constexpr int ring_rows = 8;  // 5 are live; a power of two makes the slot of a row its low bits
constexpr int runs_per_thread = 2 * ring_rows;
constexpr std::size_t line_floats = 16;  // one cache line
constexpr float largest = 1e9f;          // keeps every product of the pass finite

float usable(float x) { return std::fabs(x) <= largest ? x : 0.0f; }

/// Index into 0..n-1 of x in -2..n+2, mirrored without repeating the edge; its parity is that of x for n >= 2.
int mirror(int x, int n) {
  if (n == 1) return 0;
  const int period = 2 * (n - 1);
  const int folded = ((x % period) + period) % period;
  return folded < n ? folded : period - folded;
}

float at(const SplitRow& row, int x) { return (x & 1) != 0 ? row.odd[x >> 1] : row.even[x >> 1]; }

/// Columns -2, -1 and width .. width + 2 of a split row.
void mirror_ends(const SplitRow& row, int width) {
  row.even[-1] = at(row, mirror(-2, width));
  row.odd[-1] = at(row, mirror(-1, width));
  for (int x = width; x <= width + 2; ++x) {
    float* const run = (x & 1) != 0 ? row.odd : row.even;
    run[x >> 1] = at(row, mirror(x, width));
  }
}

RowLevels levels_of_row(const DnMosaic& in, int y) {
  const int left = site_of(0, y);
  return {{usable(in.levels.black[left]), usable(in.levels.black[left + 1])},
          {usable(in.levels.gain[left]), usable(in.levels.gain[left + 1])}};
}

RowLevels levels_of_row(const SignedMosaic& in, int y) {
  const int left = site_of(0, y);
  return {{0, 0}, {usable(in.gain[left]), usable(in.gain[left + 1])}};
}

void split_row(const DnMosaic& in, int y, const SplitRow& out) {
  rows::split_dn(in.dn.row(y), in.dn.width, levels_of_row(in, y), out);
}

void split_row(const SignedMosaic& in, int y, const SplitRow& out) {
  rows::split_float(in.value.row(y), in.value.width, levels_of_row(in, y), out);
}

int width_of(const DnMosaic& in) { return in.dn.width; }
int width_of(const SignedMosaic& in) { return in.value.width; }
int width_of(const CameraPlanes& in) { return in.rgb[0].width; }
int height_of(const DnMosaic& in) { return in.dn.height; }
int height_of(const SignedMosaic& in) { return in.value.height; }
int height_of(const CameraPlanes& in) { return in.rgb[0].height; }

Colour colour_in_order(const RgbTransform& transform, const std::array<int, 3>& channel) {
  Colour colour{};
  for (int c = 0; c < 3; ++c) {
    for (int j = 0; j < 3; ++j) colour.column[c][j] = usable(transform.matrix[3 * j + channel[c]]);
    colour.luminance[c] = usable(transform.luminance[c]);
  }
  colour.clip = std::isnan(transform.clip) ? 0.0f : transform.clip;
  colour.move_into_gamut = transform.move_into_gamut;
  colour.look = nullptr;
  return colour;
}

/// The split rows of one thread: slot k of a ring, or plane k.
struct Ring {
  float* base;
  std::size_t run_stride;
  SplitRow row(int k) const {
    float* even = base + static_cast<std::size_t>(2 * (k & (ring_rows - 1))) * run_stride;
    return {even, even + run_stride};
  }
};

/// A look on one row after another.
class LookRows {
 public:
  LookRows(const LookGrid* look, float* memory, std::size_t stride) : look_(look) {
    if (look == nullptr) return;
    for (int k = 0; k < LookGrid::parts; ++k) row_.part[k] = memory + stride * k + 1;
    for (int c = 0; c < 3; ++c) {
      row_.luminance[c] = look->luminance[c];
      row_.rods[c] = look->rods[c];
      row_.tint[c] = look->tint[c];
    }
    row_.dark = look->dark;
  }

  /// That of row y; null without a look.
  const LookRow* at(int y) {
    if (look_ == nullptr) return nullptr;
    const float place = (static_cast<float>(y) + 0.5f) / LookGrid::cell - 0.5f;
    const float below = std::floor(place);
    for (int k = 0; k < LookGrid::parts; ++k) {
      const PlaneView<const float>& part = look_->part[k];
      const auto clamped = [&](float row) { return std::clamp(static_cast<int>(row), 0, part.height - 1); };
      auto* const out = const_cast<float*>(row_.part[k]);
      rows::blend_row(part.row(clamped(below)), part.row(clamped(below + 1)), place - below, part.width, out);
      out[-1] = out[0];
      std::fill_n(out + part.width, rows::look_padding, out[part.width - 1]);
    }
    return &row_;
  }

 private:
  const LookGrid* look_;
  LookRow row_{};
};

template <class Mosaic, class SinkOfRow>
void convert_band(const Mosaic& in, const RgbTransform& transform, RowBand band, const Ring& ring, LookRows look,
                  const SinkOfRow& sink_of_row) {
  const int width = width_of(in), height = height_of(in);
  Colour red_row_colour = colour_in_order(transform, {0, 1, 2});
  Colour blue_row_colour = colour_in_order(transform, {2, 1, 0});
  int next = std::max(0, band.first - 2);  // the first row not yet split
  for (int y = band.first; y < band.last; ++y) {
    for (; next < std::min(height, y + 3); ++next) {
      split_row(in, next, ring.row(next));
      mirror_ends(ring.row(next), width);
    }
    MosaicRows around{};
    for (int k = 0; k < 5; ++k) {
      const SplitRow row = ring.row(mirror(y + k - 2, height));
      around.even[k] = row.even;
      around.odd[k] = row.odd;
    }
    const bool has_red = (y & 1) == red_row(in.phase);
    around.own_is_odd = (red_column(in.phase) != 0) == has_red;
    Colour& colour = has_red ? red_row_colour : blue_row_colour;
    colour.look = look.at(y);
    rows::convert_row(around, colour, width, sink_of_row(y));
  }
}

template <class SinkOfRow>
void convert_band(const CameraPlanes& in, const RgbTransform& transform, RowBand band, const Ring& ring, LookRows look,
                  const SinkOfRow& sink_of_row) {
  Colour colour = colour_in_order(transform, {0, 1, 2});
  PlaneRows planes{};
  for (int y = band.first; y < band.last; ++y) {
    for (int c = 0; c < 3; ++c) {
      const float gain = usable(in.gain[c]);
      rows::split_float(in.rgb[c].row(y), width_of(in), {{0, 0}, {gain, gain}}, ring.row(c));
      planes.even[c] = ring.row(c).even;
      planes.odd[c] = ring.row(c).odd;
    }
    colour.look = look.at(y);
    rows::convert_row(planes, colour, width_of(in), sink_of_row(y));
  }
}

[[maybe_unused]] bool fits(const LookGrid& look, int width, int height) {
  return std::ranges::all_of(look.part, [&](const PlaneView<const float>& part) {
    return part.width == cells_along(width) && part.height == cells_along(height);
  });
}

/// Row y of cells, four rows of pixels.
template <class Mosaic>
void quarter_row(const Mosaic& in, int y, const Ring& ring, const RgbView<float>& out) {
  const float* site[4][2];  // the two runs of each site of a 2x2 cell
  for (int k = 0; k < 4; ++k) {
    split_row(in, mirror(4 * y + k, height_of(in)), ring.row(k));
    mirror_ends(ring.row(k), width_of(in));
    site[2 * (k & 1)][k >> 1] = ring.row(k).even;
    site[2 * (k & 1) + 1][k >> 1] = ring.row(k).odd;
  }
  const int red = 2 * red_row(in.phase) + red_column(in.phase);
  const int cells = out[0].width;
  rows::quarter_row({{site[red][0], site[red][1]}, 2, 0.25f}, cells, out[0].row(y));
  rows::quarter_row({{site[red ^ 1][0], site[red ^ 1][1], site[red ^ 2][0], site[red ^ 2][1]}, 4, 0.125f}, cells,
                    out[1].row(y));
  rows::quarter_row({{site[red ^ 3][0], site[red ^ 3][1]}, 2, 0.25f}, cells, out[2].row(y));
}

void quarter_row(const CameraPlanes& in, int y, const Ring& ring, const RgbView<float>& out) {
  for (int c = 0; c < 3; ++c) {
    rows::QuarterRuns runs{{}, 8, 0.0625f};
    const float gain = usable(in.gain[c]);
    for (int k = 0; k < 4; ++k) {
      const float* const row = in.rgb[c].row(mirror(4 * y + k, height_of(in)));
      rows::split_float(row, width_of(in), {{0, 0}, {gain, gain}}, ring.row(k));
      mirror_ends(ring.row(k), width_of(in));
      runs.run[2 * k] = ring.row(k).even;
      runs.run[2 * k + 1] = ring.row(k).odd;
    }
    rows::quarter_row(runs, out[c].width, out[c].row(y));
  }
}

/// Calls work(band, thread) for at most `threads` bands of `height` rows.
template <class Work>
void run_bands(Executor& executor, int threads, int height, const Work& work) {
  struct Call {
    const Work& work;
    int height;
    int count;
  } call{work, height, std::min(threads, executor.width())};
  executor.run(
      call.count,
      [](void* context, int index) {
        const Call& c = *static_cast<Call*>(context);
        c.work(row_band(c.height, c.count, index), index);
      },
      &call);
}

[[maybe_unused]] bool reaches_one(const ToneTable& tone) {
  return tone.bins >= 1 && tone.bins <= ToneTable::capacity && tone.bin_of(1.0f) == tone.bins - 1;
}

/// Floats that a run of scratch samples takes for pictures `width` pixels wide.
std::size_t run_of(int width) {
  return rows::padding_before + (static_cast<std::size_t>(width) + 1) / 2 + rows::padding_after;
}

/// Floats that one part of a look's row takes.
std::size_t look_run_of(int width) { return 1 + static_cast<std::size_t>(cells_along(width)) + rows::look_padding; }

}  // namespace

struct RawToRgb::Bench {
  Ring ring;
  float* look;
};

RawToRgb::RawToRgb(int max_width, int threads) : threads_(threads) {
  assert(max_width >= 1 && threads >= 1);
  const std::size_t samples = run_of(max_width);
  // Runs start on a cache line, and an odd number of lines apart: an even number could put the live rows of a column
  // into the same few sets of the first-level cache.
  const std::size_t lines = ((samples + line_floats - 1) / line_floats) | 1U;
  run_stride_ = lines * line_floats;
  look_stride_ = look_run_of(max_width);
  memory_ = std::make_unique<float[]>((run_stride_ * runs_per_thread + look_stride_ * LookGrid::parts) *
                                          static_cast<std::size_t>(threads) +
                                      line_floats);
}

RawToRgb::Bench RawToRgb::bench(int thread) const {
  const auto address = reinterpret_cast<std::uintptr_t>(memory_.get());
  const std::size_t misaligned = address / sizeof(float) % line_floats;
  float* const start = memory_.get() + (line_floats - misaligned) % line_floats;
  const std::size_t runs = run_stride_ * runs_per_thread;
  return {{start + rows::padding_before + runs * static_cast<std::size_t>(thread), run_stride_},
          start + runs * static_cast<std::size_t>(threads_) +
              look_stride_ * LookGrid::parts * static_cast<std::size_t>(thread)};
}

template <class SinkOfRow>
void RawToRgb::convert(const RgbInput& in, const RgbTransform& transform, const SinkOfRow& sink_of_row,
                       Executor& executor) {
  std::visit(
      [&](const auto& input) {
        assert(run_of(width_of(input)) <= run_stride_);
        assert(transform.look == nullptr || fits(*transform.look, width_of(input), height_of(input)));
        if (width_of(input) == 0) return;
        run_bands(executor, threads_, height_of(input), [&](RowBand band, int thread) {
          const Bench own = bench(thread);
          convert_band(input, transform, band, own.ring, LookRows(transform.look, own.look, look_stride_), sink_of_row);
        });
      },
      in);
}

void RawToRgb::rgb8(const RgbInput& in, const RgbTransform& transform, const ToneTable& tone,
                    PlaneView<std::uint8_t> out, Executor& executor) {
  assert(reaches_one(tone));
  convert(
      in, transform,
      [&](int y) {
        return rows::Codes8{&tone, out.row(y)};
      },
      executor);
}

void RawToRgb::rgb16(const RgbInput& in, const RgbTransform& transform, const ToneTable& tone,
                     PlaneView<std::uint16_t> out, Executor& executor) {
  assert(reaches_one(tone));
  convert(
      in, transform,
      [&](int y) {
        return rows::Codes16{&tone, out.row(y)};
      },
      executor);
}

void RawToRgb::linear(const RgbInput& in, const RgbTransform& transform, RgbView<float> out, Executor& executor) {
  convert(
      in, transform,
      [&](int y) {
        return rows::Planes{{out[0].row(y), out[1].row(y), out[2].row(y)}};
      },
      executor);
}

template <class Mosaic>
void RawToRgb::bin(const Mosaic& in, RgbView<float> out, Executor& executor) {
  assert(run_of(width_of(in)) <= run_stride_);
  const int width = width_of(in) / 2, height = height_of(in) / 2;
  assert(out[0].width == width && out[0].height == height);
  if (width == 0) return;
  const int red = 2 * red_row(in.phase) + red_column(in.phase);
  run_bands(executor, threads_, height, [&](RowBand band, int thread) {
    const Ring ring = bench(thread).ring;
    const float* site[4] = {ring.row(0).even, ring.row(0).odd, ring.row(1).even, ring.row(1).odd};
    const rows::CellRow cells{{site[red], site[red ^ 1], site[red ^ 2], site[red ^ 3]}};
    for (int y = band.first; y < band.last; ++y) {
      split_row(in, 2 * y, ring.row(0));
      split_row(in, 2 * y + 1, ring.row(1));
      rows::bin_row(cells, width, {{out[0].row(y), out[1].row(y), out[2].row(y)}});
    }
  });
}

void RawToRgb::bin2x2(const DnMosaic& in, RgbView<float> out, Executor& executor) { bin(in, out, executor); }
void RawToRgb::bin2x2(const SignedMosaic& in, RgbView<float> out, Executor& executor) { bin(in, out, executor); }

void RawToRgb::quarter(const RgbInput& in, RgbView<float> out, Executor& executor) {
  std::visit(
      [&](const auto& input) {
        assert(run_of(width_of(input)) <= run_stride_);
        assert(out[0].width == cells_along(width_of(input)) && out[0].height == cells_along(height_of(input)));
        run_bands(executor, threads_, out[0].height, [&](RowBand band, int thread) {
          for (int y = band.first; y < band.last; ++y) quarter_row(input, y, bench(thread).ring, out);
        });
      },
      in);
}

const char* raw_to_rgb_target() { return rows::target_name(); }

bool cpu_runs_raw_to_rgb() {
#if defined(__x86_64__)
  return __builtin_cpu_supports("ssse3") != 0;
#else
  return true;
#endif
}

}  // namespace lowlux::isp
