#include "denoise/spatial/nl_bayes.h"

#include <algorithm>
#include <cstdint>
#include <cstring>

#include "denoise/spatial/nl_bayes_rows.h"
#include "denoise/spatial/residual_shares.h"
#include "denoise/spatial/rows.h"

namespace lowlux::denoise {
namespace {

constexpr int below = rows::search_reach + rows::patch - 1;  // rows that patches found from one row extend down

rows::ResidualOfPatches left_by(PlaneKind kind, FoundBy found_by) {
  const PatchShares shares = patch_fractions(kind, found_by);
  return {shares.trace, shares.squares, shares.other};
}

/// Filter of one strip of rows of one level.
struct NlBayes {
  const PassFrame& frame;
  int l;

  const PyramidLevel& level() const { return frame.memory.level[l]; }
  int planes() const { return frame.starts.nowhere(l) ? 1 : 4; }

  /// Computes for each patch of a row whether chroma is wanted in it.
  void wanted(int y, std::uint8_t* out) const {
    const ChromaStarts& s = frame.starts;
    const unsigned char* const has = s.has_chroma.data() + l * s.columns * s.rows;
    const unsigned char* const upper = has + tile_of(y << l, s.rows) * s.columns;
    const unsigned char* const lower = has + tile_of((y + rows::patch - 1) << l, s.rows) * s.columns;
    for (int x = 0; x < level().width; x += rows::patch) {
      const int left = tile_of(x << l, s.columns), right = tile_of((x + rows::patch - 1) << l, s.columns);
      const bool any = upper[left] != 0 || upper[right] != 0 || lower[left] != 0 || lower[right] != 0;
      *out++ = any ? 1 : 0;
    }
  }

  rows::PatchRow patch_row(int y, const std::uint8_t* chroma) const {
    const PyramidLevel& at = level();
    rows::PatchRow in{};
    for (int p = 0; p < 4; ++p) {
      in.noisy[p] = at.noisy.row(p, 0);
      in.pilot[p] = at.value[1].row(p, 0);
      in.variance[p] = at.variance.row(p, 0);
    }
    in.stride = at.noisy.stride;
    in.variance_stride = at.variance.stride;
    in.width = at.width;
    in.height = at.height;
    in.y = y;
    in.chroma = planes() == 4 ? chroma : nullptr;
    in.left[0] = left_by(PlaneKind::luma, FoundBy::all_planes);
    in.left[1] = left_by(PlaneKind::chroma, FoundBy::all_planes);
    in.left[2] = left_by(PlaneKind::luma, FoundBy::luma);
    return in;
  }

  static rows::PatchSums sums(const PatchMemory& m) {
    rows::PatchSums out{};
    for (int p = 0; p < 4; ++p) {
      std::copy(m.change[p].begin(), m.change[p].end(), out.change[p]);
      std::copy(m.weight[p].begin(), m.weight[p].end(), out.weight[p]);
      for (int i = 0; i < 2; ++i) {
        out.residual[p][i] = m.residual[p][i];
        out.residual_weight[p][i] = m.residual_weight[p][i];
      }
    }
    return out;
  }

  static void clear(float* row, int cells) { std::memset(row, 0, static_cast<std::size_t>(cells) * sizeof(float)); }

  /// Finishes a row whose sums are complete, and clears its memory for another row.
  void finish(const PatchMemory& m, int y, bool inside) const {
    const PyramidLevel& at = level();
    for (int p = 0; p < planes(); ++p) {
      float *const change = m.change[p][y % rows::ring], *const weight = m.weight[p][y % rows::ring];
      if (inside) rows::add_mean_row(change, weight, at.width, at.value[1].row(p, y), at.value[0].row(p, y));
      clear(change, at.width);
      clear(weight, at.width);
    }
  }

  /// Finishes the two rows of residual variances that patches cover, and clears their memory.
  void finish_residual(const PatchMemory& m, int y, bool inside) const {
    const PyramidLevel& at = level();
    for (int p = 0; p < planes(); ++p) {
      for (int i = 0; i < 2; ++i) {
        float *const residual = m.residual[p][i], *const weight = m.residual_weight[p][i];
        if (inside) rows::add_mean_row(residual, weight, at.width / 2, nullptr, at.residual.row(p, y + i));
        clear(residual, at.width / 2);
        clear(weight, at.width / 2);
      }
    }
  }

  /// Filters rows first .. last - 1, multiples of 4. Patches that reach in from outside the strip are found again.
  void band(int first, int last, const PatchMemory& m) const {
    const ScratchUse use(m.scratch);
    const int height = level().height;
    const int start = std::max(0, (first - below + rows::patch - 1) / rows::patch * rows::patch);
    const int end = std::min(height, last + rows::search_reach);
    int done = std::max(0, start - rows::search_reach);
    const auto finish_up_to = [&](int y) {
      for (; done < y; ++done) finish(m, done, done >= first && done < last);
    };
    for (int y = start; y < end; y += rows::patch) {
      wanted(y, m.chroma);
      rows::nl_bayes_row(patch_row(y, m.chroma), m.patches, sums(m));
      finish_residual(m, y / 2, y >= first && y < last);
      finish_up_to(y + rows::patch == height ? height : y + rows::patch - rows::search_reach);
    }
    finish_up_to(std::min(height, last));
  }

  void run() const {
    in_bands(frame.workers, level().height / rows::patch, [this](int first, int last, int thread) {
      band(rows::patch * first, rows::patch * last, frame.memory.patches[thread]);
    });
  }
};

void copy_pilot(const PassFrame& frame, int l) {
  const PyramidLevel& at = frame.memory.level[l];
  for (int p = 0; p < 4; ++p) {
    for (int y = 0; y < at.height; ++y) {
      std::memcpy(at.value[0].row(p, y), at.value[1].row(p, y), static_cast<std::size_t>(at.width) * sizeof(float));
    }
  }
}

}  // namespace

void nl_bayes(const PassFrame& frame) {
  const int levels = std::min(nl_bayes_levels, frame.levels - 1);
  copy_pilot(frame, levels);
  for (int l = levels - 1; l >= 0; --l) {
    NlBayes{frame, l}.run();
    recompose(frame, l, 0);
  }
}

}  // namespace lowlux::denoise
