#include "denoise/spatial/passes.h"

#include <algorithm>
#include <cstdint>
#include <cstring>
#include <span>

#include "denoise/spatial/residual_shares.h"
#include "denoise/spatial/rows.h"

namespace lowlux::denoise {
namespace {

/// Returns 4, or 1 on a level without C1, C2, C3.
int planes_of(const PassFrame& frame, int level) { return frame.starts.nowhere(level) ? 1 : 4; }

/// Filter of one strip of rows of one level by blocks.
struct Shrink {
  const PassFrame& frame;
  int l;
  int pass;
  int rows_apart;  // cells from one row of blocks to the next

  const PyramidLevel& level() const { return frame.memory.level[l]; }

  /// Computes for each strip of a row of blocks whether chroma is wanted in it.
  void wanted(int y0, std::uint8_t* strip) const {
    const ChromaStarts& s = frame.starts;
    const unsigned char* const has = s.has_chroma.data() + l * s.columns * s.rows;
    const int blocks = (level().width - block) / 2 + 1;
    const int top = tile_of(y0 << l, s.rows), bottom = tile_of((y0 + block - 1) << l, s.rows);
    for (int first = 0; first < blocks; first += rows::strip_blocks) {
      const int last = std::min(blocks, first + rows::strip_blocks) - 1;
      const int left = tile_of((first * 2) << l, s.columns);
      const int right = tile_of((last * 2 + block - 1) << l, s.columns);
      bool any = false;
      for (int y = top; y <= bottom; ++y) {
        for (int x = left; x <= right; ++x) any = any || has[y * s.columns + x] != 0;
      }
      *strip++ = any ? 1 : 0;
    }
  }

  rows::BlockRow block_row(int y0, const std::uint8_t* chroma) const {
    const PyramidLevel& at = level();
    rows::BlockRow in{};
    for (int p = 0; p < 4; ++p) {
      in.noisy[p] = at.noisy.row(p, y0);
      if (pass == 1) in.pilot[p] = at.value[0].row(p, y0);
      in.variance[p] = at.variance.row(p, y0 / 2);
    }
    in.stride = at.noisy.stride;
    in.variance_stride = at.variance.stride;
    in.blocks = (at.width - block) / 2 + 1;
    in.rows_apart = rows_apart;
    for (const PlaneKind kind : {PlaneKind::luma, PlaneKind::chroma}) {
      const ResidualShares shares = residual_fractions(kind, pass, rows_apart, l, frame.levels);
      in.left[kind == PlaneKind::luma ? 0 : 1] = {shares.kept, shares.other, shares.mean};
    }
    in.chroma = planes_of(frame, l) == 4 ? chroma : nullptr;
    in.luma_shaped = luma_shaped_power(l, frame.levels);
    in.pilot_power[0] = pilot_power_of_luma;
    in.pilot_power[1] = pilot_power_of_chroma(l);
    in.coarsest = l + 1 == frame.levels;
    return in;
  }

  static rows::BlockSums sums(const BlockMemory& m, int y0) {
    rows::BlockSums out{};
    for (int p = 0; p < 4; ++p) {
      for (int y = 0; y < block; ++y) out.value[p][y] = m.value[p][(y0 + y) % block];
      for (int y = 0; y < block / 2; ++y) {
        out.weight[p][y] = m.weight[p][(y0 / 2 + y) % 4];
        out.residual[p][y] = m.residual[p][(y0 / 2 + y) % 4];
      }
    }
    return out;
  }

  static void clear(float* row, int cells) { std::memset(row, 0, (cells + rows::padding) * sizeof(float)); }

  /// Finishes two rows whose sums are complete, and clears their memory for the next.
  void finish(const BlockMemory& m, int y, bool inside) const {
    const PyramidLevel& at = level();
    for (int p = 0; p < planes_of(frame, l); ++p) {
      float *const upper = m.value[p][y % block], *const lower = m.value[p][(y + 1) % block];
      float *const weight = m.weight[p][y / 2 % 4], *const residual = m.residual[p][y / 2 % 4];
      if (inside) {
        rows::finish_rows({{upper, lower}, weight, residual, at.width}, m.weights,
                          {{at.value[pass].row(p, y), at.value[pass].row(p, y + 1)}, at.residual.row(p, y / 2)});
      }
      clear(upper, at.width);
      clear(lower, at.width);
      clear(weight, at.width / 2);
      clear(residual, at.width / 2);
    }
  }

  /// Filters rows first .. last - 1, multiples of 4. Blocks that reach in from outside these rows are computed again.
  void band(int first, int last, const BlockMemory& m) const {
    const ScratchUse use(m.scratch);
    const int height = level().height;
    std::uint8_t chroma[1 + largest_side / 2 / 2 / rows::strip_blocks];  // blocks 2 cells apart, cells of 2 sites
    for (int y0 = std::max(0, first - block + rows_apart); y0 <= std::min(height - block, last - rows_apart);
         y0 += rows_apart) {
      wanted(y0, chroma);
      rows::shrink_block_row(block_row(y0, chroma), m.blocks, sums(m, y0));
      const int complete = y0 == height - block ? block : rows_apart;
      for (int y = y0; y < y0 + complete; y += 2) finish(m, y, y >= first && y < last);
    }
  }

  void run() const {
    in_bands(frame.workers, level().height / 4, [this](int first, int last, int thread) {
      band(4 * first, 4 * last, frame.memory.thread[thread].blocks);
    });
  }
};

rows::UpRow up_row(const PlaneSet& coarse, int p, int y, int width, int height) {
  const int near = y / 2, far = std::clamp(y % 2 == 0 ? near - 1 : near + 1, 0, height - 1);
  rows::UpRow in{};
  for (int i = 0; i < 3; ++i) {
    in.near[i] = coarse.row(p, std::clamp(near + i - 1, 0, height - 1));
    in.far[i] = coarse.row(p, std::clamp(far + i - 1, 0, height - 1));
  }
  in.coarse_cells = width;
  return in;
}

/// Recomposition, out_l = D_l + up2(G3(out_{l+1} - down2(D_l))), blended with up2(out_{l+1}) where chroma starts on a
/// coarser level.
struct Recompose {
  const PassFrame& frame;
  int l;
  int pass;

  void differences() const {
    const PyramidLevel &fine = frame.memory.level[l], &coarse = frame.memory.level[l + 1];
    in_bands(frame.workers, coarse.height, [&](int first, int last, int) {
      for (int p = 0; p < planes_of(frame, l); ++p) {
        for (int y = first; y < last; ++y) {
          const float* const both[2] = {fine.value[pass].row(p, 2 * y), fine.value[pass].row(p, 2 * y + 1)};
          rows::difference_row(both, coarse.value[pass].row(p, y), coarse.width, frame.memory.difference.row(p, y));
        }
      }
    });
  }

  void row(int p, int y, const UpMemory& m) const {
    const PyramidLevel &fine = frame.memory.level[l], &coarse = frame.memory.level[l + 1];
    float* const out = fine.value[pass].row(p, y);
    const rows::UpRow smooth = up_row(coarse.value[pass], p, y, coarse.width, coarse.height);
    if (p != 0 && frame.starts.nowhere(l)) return rows::smooth_row(smooth, m.up, out);
    rows::add_correction_row(up_row(frame.memory.difference, p, y, coarse.width, coarse.height), m.up, out);
    if (p == 0 || frame.starts.everywhere(l)) return;
    rows::smooth_row(smooth, m.up, m.coarse);
    rows::blend_row(m.coarse, m.share, fine.width, out);
  }

  void run() const {
    differences();
    const PyramidLevel& fine = frame.memory.level[l];
    in_bands(frame.workers, fine.height, [&](int first, int last, int thread) {
      const UpMemory& m = frame.memory.thread[thread].up;
      const ScratchUse use(m.scratch);
      for (int y = first; y < last; ++y) {
        if (!frame.starts.everywhere(l) && !frame.starts.nowhere(l)) {
          fraction_row(frame.starts, l, l, y, {m.share, static_cast<std::size_t>(fine.width)});
        }
        for (int p = 0; p < 4; ++p) row(p, y, m);
      }
    });
  }
};

/// Computes fraction_row() for residual variances. @param finer as long as `share`
void residual_fraction_row(const ChromaStarts& starts, int level, int y, std::span<float> share, float* finer) {
  fraction_row(starts, level, level + 1, y, share);
  if (level == 0) return;
  fraction_row(starts, level - 1, level + 1, y, {finer, share.size()});
  constexpr auto more = static_cast<float>(as_finest - 1);
  for (std::size_t x = 0; x < share.size(); ++x) share[x] = 1 - (1 - share[x]) * (1 + more * finer[x]);
}

}  // namespace

void recompose(const PassFrame& frame, int level, int pass) { Recompose{frame, level, pass}.run(); }

void build_pyramid(const PassFrame& frame) {
  for (int l = 0; l + 1 < frame.levels; ++l) {
    const PyramidLevel &fine = frame.memory.level[l], &coarse = frame.memory.level[l + 1];
    const auto scale = static_cast<float>(0.25 * frame.variance_scale[l + 1] / frame.variance_scale[l]);
    in_bands(frame.workers, coarse.height / 2, [&](int first, int last, int) {
      for (int p = 0; p < 4; ++p) {
        for (int y = 2 * first; y < 2 * last; ++y) {
          const float* const both[2] = {fine.noisy.row(p, 2 * y), fine.noisy.row(p, 2 * y + 1)};
          rows::down2_row(both, coarse.width, 1, coarse.noisy.row(p, y));
        }
        for (int y = first; y < last; ++y) {
          const float* const both[2] = {fine.variance.row(p, 2 * y), fine.variance.row(p, 2 * y + 1)};
          rows::down2_row(both, coarse.width / 2, scale, coarse.variance.row(p, y));
        }
      }
    });
  }
}

void run_pass(const PassFrame& frame, int pass, int rows_apart) {
  for (int l = frame.levels - 1; l >= 0; --l) {
    Shrink{frame, l, pass, rows_apart}.run();
    if (l + 1 < frame.levels) recompose(frame, l, pass);
  }
}

void add_residuals(const PassFrame& frame) {
  for (int l = frame.levels - 2; l >= 0; --l) {
    const PyramidLevel &fine = frame.memory.level[l], &coarse = frame.memory.level[l + 1];
    const int width = fine.width / 2, height = fine.height / 2;
    in_bands(frame.workers, height, [&](int first, int last, int thread) {
      const UpMemory& m = frame.memory.thread[thread].up;
      const ScratchUse use(m.scratch);
      for (int y = first; y < last; ++y) {
        for (int p = 0; p < 4; ++p) {
          float* const own = fine.residual.row(p, y);
          rows::smooth_row(up_row(coarse.residual, p, y, width / 2, height / 2), m.up, m.coarse);
          std::fill(m.share, m.share + width, p == 0 ? 0.0f : 1.0f);
          if (p != 0 && !frame.starts.nowhere(l)) {
            residual_fraction_row(frame.starts, l, y, {m.share, static_cast<std::size_t>(width)}, m.finer);
          }
          if (p == 0 || !frame.starts.nowhere(l)) rows::add_residual_row(own, m.share, width, m.coarse);
          std::memcpy(own, m.coarse, width * sizeof(float));
        }
      }
    });
  }
}

}  // namespace lowlux::denoise
