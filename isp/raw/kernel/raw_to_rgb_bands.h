#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>

#include "isp/base/memory.h"
#include "isp/raw/kernel/raw_to_rgb_rows.h"
#include "isp/raw/kernel/rgb_input.h"

/// These internal parts are common to the files of RawToRgb: split rows with mirrored ends, bands of rows.
namespace lowlux::isp {

using rows::RowLevels;
using rows::SplitRow;

inline constexpr int ring_rows = 8;  // 5 are live; a power of two makes the slot of a row its low bits
inline constexpr int runs_per_thread = 2 * ring_rows;
inline constexpr std::size_t line_floats = 16;  // one cache line
inline constexpr float largest = 1e9f;          // keeps every product of the pass finite

inline float usable(float x) { return std::fabs(x) <= largest ? x : 0.0f; }

inline rows::Encoding encoding_with(float requested) {
  const float offset = std::isnan(requested) ? 1.0f : std::clamp(requested, 1e-6f, 1.0f);
  const float root = std::cbrt(offset);
  return {offset, 1 / (3 * root * root)};
}

/// Returns the index in 0..n-1 of x in -2..n+2, mirrored without repeating the edge; x keeps its parity for n >= 2.
inline int mirror(int x, int n) {
  if (n == 1) return 0;
  const int period = 2 * (n - 1);
  const int folded = ((x % period) + period) % period;
  return folded < n ? folded : period - folded;
}

inline float at(const SplitRow& row, int x) { return (x & 1) != 0 ? row.odd[x >> 1] : row.even[x >> 1]; }

/// Fills columns -2, -1 and width .. width + 2 of a split row with mirrored samples.
inline void mirror_ends(const SplitRow& row, int width) {
  row.even[-1] = at(row, mirror(-2, width));
  row.odd[-1] = at(row, mirror(-1, width));
  for (int x = width; x <= width + 2; ++x) {
    float* const run = (x & 1) != 0 ? row.odd : row.even;
    run[x >> 1] = at(row, mirror(x, width));
  }
}

inline RowLevels levels_of_row(const DnMosaic& in, int y) {
  const int left = site_of(0, y);
  return {{usable(in.levels.black[left]), usable(in.levels.black[left + 1])},
          {usable(in.levels.gain[left]), usable(in.levels.gain[left + 1])}};
}

inline RowLevels levels_of_row(const SignedMosaic& in, int y) {
  const int left = site_of(0, y);
  return {{0, 0}, {usable(in.gain[left]), usable(in.gain[left + 1])}};
}

inline void split_row(const DnMosaic& in, int y, const SplitRow& out) {
  rows::split_dn(in.dn.row(y), in.dn.width, levels_of_row(in, y), out);
}

inline void split_row(const SignedMosaic& in, int y, const SplitRow& out) {
  rows::split_float(in.value.row(y), in.value.width, levels_of_row(in, y), out);
}

/// Returns the columns x to x + width - 1 of a mosaic. Precondition: x is even.
inline DnMosaic columns_of(DnMosaic in, int x, int width) {
  in.dn = in.dn.crop(x, 0, width, in.dn.height);
  return in;
}
inline SignedMosaic columns_of(SignedMosaic in, int x, int width) {
  in.value = in.value.crop(x, 0, width, in.value.height);
  return in;
}

inline int width_of(const DnMosaic& in) { return in.dn.width; }
inline int width_of(const SignedMosaic& in) { return in.value.width; }
inline int width_of(const CameraPlanes& in) { return in.rgb[0].width; }
inline int height_of(const DnMosaic& in) { return in.dn.height; }
inline int height_of(const SignedMosaic& in) { return in.value.height; }
inline int height_of(const CameraPlanes& in) { return in.rgb[0].height; }

/// Holds the split rows of one thread: slot k of a ring, or plane k.
struct Ring {
  float* base;
  std::size_t run_stride;
  SplitRow row(int k) const {
    float* even = base + static_cast<std::size_t>(2 * (k & (ring_rows - 1))) * run_stride;
    return {even, even + run_stride};
  }
};

/// Calls work(band, thread) for at most `threads` bands of `height` rows.
template <class Work>
inline void run_bands(Executor& executor, int threads, int height, const Work& work) {
  const int count = std::min(threads, executor.width());
  for_each_index(executor, count, [&](int index) { work(row_band(height, count, index), index); });
}

/// Returns the number of floats that a run of scratch samples takes for images `width` pixels wide.
inline std::size_t run_of(int width) {
  return rows::padding_before + (static_cast<std::size_t>(width) + 1) / 2 + rows::padding_after;
}

/// Holds the scratch memory of one thread while it is in use.
struct BandScratch {
  int thread;
  Ring ring;
  float* look;
  std::uint16_t* codes;  // 3 for each pixel of a row
  Scratch demosaic;      // scratch memory of a ResidualBand, or of a second ring; closed
  std::array<ScratchUse, 3> use;
};

}  // namespace lowlux::isp
