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

template <class Mosaic, class SinkOfRow>
void convert_band(const Mosaic& in, const RgbTransform& transform, RowBand band, const Ring& ring,
                  const SinkOfRow& sink_of_row) {
  const int width = width_of(in), height = height_of(in);
  const Colour red_row_colour = colour_in_order(transform, {0, 1, 2});
  const Colour blue_row_colour = colour_in_order(transform, {2, 1, 0});
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
    rows::convert_row(around, has_red ? red_row_colour : blue_row_colour, width, sink_of_row(y));
  }
}

template <class SinkOfRow>
void convert_band(const CameraPlanes& in, const RgbTransform& transform, RowBand band, const Ring& ring,
                  const SinkOfRow& sink_of_row) {
  const Colour colour = colour_in_order(transform, {0, 1, 2});
  PlaneRows planes{};
  for (int y = band.first; y < band.last; ++y) {
    for (int c = 0; c < 3; ++c) {
      const float gain = usable(in.gain[c]);
      rows::split_float(in.rgb[c].row(y), width_of(in), {{0, 0}, {gain, gain}}, ring.row(c));
      planes.even[c] = ring.row(c).even;
      planes.odd[c] = ring.row(c).odd;
    }
    rows::convert_row(planes, colour, width_of(in), sink_of_row(y));
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

}  // namespace

RawToRgb::RawToRgb(int max_width, int threads) : threads_(threads) {
  assert(max_width >= 1 && threads >= 1);
  const std::size_t samples = run_of(max_width);
  // Runs start on a cache line, and an odd number of lines apart: an even number could put the live rows of a column
  // into the same few sets of the first-level cache.
  const std::size_t lines = ((samples + line_floats - 1) / line_floats) | 1U;
  run_stride_ = lines * line_floats;
  memory_ = std::make_unique<float[]>(run_stride_ * runs_per_thread * threads + line_floats);
}

float* RawToRgb::scratch(int thread) const {
  const auto address = reinterpret_cast<std::uintptr_t>(memory_.get());
  const std::size_t misaligned = address / sizeof(float) % line_floats;
  return memory_.get() + (line_floats - misaligned) % line_floats + rows::padding_before +
         run_stride_ * runs_per_thread * thread;
}

template <class SinkOfRow>
void RawToRgb::convert(const RgbInput& in, const RgbTransform& transform, const SinkOfRow& sink_of_row,
                       Executor& executor) {
  std::visit(
      [&](const auto& input) {
        assert(run_of(width_of(input)) <= run_stride_);
        if (width_of(input) == 0) return;
        run_bands(executor, threads_, height_of(input), [&](RowBand band, int thread) {
          convert_band(input, transform, band, Ring{scratch(thread), run_stride_}, sink_of_row);
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
    const Ring ring{scratch(thread), run_stride_};
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

const char* raw_to_rgb_target() { return rows::target_name(); }

bool cpu_runs_raw_to_rgb() {
#if defined(__x86_64__)
  return __builtin_cpu_supports("ssse3") != 0;
#else
  return true;
#endif
}

}  // namespace lowlux::isp
