// Search and filter of one group of patches, for nl_bayes_rows.cpp. Included once for each instruction set: hence a
// guard that toggles instead of #pragma once.
#if defined(LOWLUX_DENOISE_PATCH_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef LOWLUX_DENOISE_PATCH_INL_H
#undef LOWLUX_DENOISE_PATCH_INL_H
#else
#define LOWLUX_DENOISE_PATCH_INL_H
#endif

#include <hwy/highway.h>

#include <algorithm>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <limits>

#include "denoise/spatial/dct-inl.h"
#include "denoise/spatial/nl_bayes_rows.h"

HWY_BEFORE_NAMESPACE();
namespace lowlux::denoise::rows::HWY_NAMESPACE {

// Lanes are adjacent candidate positions, or the 16 cells of a patch, row by row.

constexpr int cells = patch * patch;
constexpr int wide = 2 * search_reach;      // columns of positions
constexpr int tall = 2 * search_reach + 1;  // rows of positions
constexpr int parts = cells / static_cast<int>(hn::MaxLanes(Floats()));
static_assert(wide == cells);

/// Squared distance of each position, infinite where there is no patch or it is the reference's own.
struct Keys {
  HWY_ALIGN float key[tall * wide];
  int above;  // row of the reference's own position
  int rows;
};

struct Members {
  int x[group];
  int y[group];
  int count;
};

/// Patches of one plane of a group, padded to a multiple of four.
struct Patches {
  HWY_ALIGN float noisy[group][cells];  // the input, and then the result
  HWY_ALIGN float pilot[group][cells];
  HWY_ALIGN float matrix[cells][cells];
};

struct Filtered {
  float weight;
  float residual;
};

/// Returns the mean variance of the cells around the middle of a patch.
HWY_INLINE float variance_of(const PatchRow& in, int p, int x, int y) {
  const float* const upper = in.variance[p] + (y + 1) / 2 * in.variance_stride;
  const float* const lower = in.variance[p] + (y + 2) / 2 * in.variance_stride;
  const int left = (x + 1) / 2, right = (x + 2) / 2;
  return std::max(upper[left] + upper[right] + lower[left] + lower[right], 1e-30f);
}

/// Computes squared distances, divided by the variances, of a row of positions from the reference's patch.
HWY_INLINE void row_of_distances(const PatchRow& in, int x0, int y, const float (&per_variance)[4], VF (&sum)[parts]) {
  const int n = lanes();
  for (VF& s : sum) s = hn::Zero(Floats());
  for (int p = 0; p < 4; ++p) {
    const float* const own = in.pilot[p] + in.y * in.stride + x0;
    const float* const at = in.pilot[p] + y * in.stride + x0 - search_reach;
    VF of_plane[parts];
    for (VF& s : of_plane) s = hn::Zero(Floats());
    for (int j = 0; j < patch; ++j) {
      for (int i = 0; i < patch; ++i) {
        const VF reference = constant(own[j * in.stride + i]);
        for (int part = 0; part < parts; ++part) {
          const VF difference = hn::Sub(load(at + j * in.stride + i + part * n), reference);
          of_plane[part] = hn::MulAdd(difference, difference, of_plane[part]);
        }
      }
    }
    for (int part = 0; part < parts; ++part) {
      sum[part] = hn::MulAdd(of_plane[part], constant(per_variance[p]), sum[part]);
    }
  }
}

HWY_INLINE void search(const PatchRow& in, int x0, Keys& out) {
  const Floats f;
  const int n = lanes();
  const int first = std::max(0, in.y - search_reach), last = std::min(in.height - patch, in.y + search_reach);
  out.above = in.y - first;
  out.rows = last - first + 1;
  float per_variance[4];
  for (int p = 0; p < 4; ++p) per_variance[p] = 1 / variance_of(in, p, x0, in.y);
  for (int y = first; y <= last; ++y) {
    VF sum[parts];
    row_of_distances(in, x0, y, per_variance, sum);
    for (int part = 0; part < parts; ++part) {
      const VF x = hn::Iota(f, static_cast<float>(x0 - search_reach + part * n));
      const auto inside = hn::And(hn::Ge(x, hn::Zero(f)), hn::Le(x, constant(static_cast<float>(in.width - patch))));
      store(hn::IfThenElse(inside, sum[part], constant(std::numeric_limits<float>::infinity())),
            out.key + (y - first) * wide + part * n);
    }
  }
  out.key[out.above * wide + search_reach] = std::numeric_limits<float>::infinity();
}

HWY_INLINE int count_up_to(const Keys& keys, float most) {
  const Floats f;
  VF sum = hn::Zero(f);
  for (int i = 0; i < keys.rows * wide; i += lanes()) {
    sum = hn::Add(sum, hn::IfThenElseZero(hn::Le(load(keys.key + i), constant(most)), constant(1)));
  }
  return static_cast<int>(hn::GetLane(hn::SumOfLanes(f, sum)));
}

/// Selects the reference's own patch and the nearest others; of equally near ones, the first.
HWY_INLINE void choose(const PatchRow& in, int x0, const Keys& keys, Members& out) {
  // Positive floats are ordered as their bits are: find the smallest limit that enough positions reach, bit by bit.
  constexpr int wanted = group - 1;
  constexpr std::int32_t largest = 0x7f7fffff;  // finite
  std::int32_t limit = 0x7fffffff;
  int reached = count_up_to(keys, std::bit_cast<float>(largest));
  for (std::int32_t bit = 1 << 30; bit != 0 && reached > wanted; bit >>= 1) {
    // All bits below `bit` are set, so that the upper half of the range is excluded.
    const std::int32_t lower = limit & ~bit;
    const int count = count_up_to(keys, std::bit_cast<float>(std::min(lower, largest)));
    if (count < wanted) continue;
    limit = lower;
    reached = count;
  }
  const auto most = std::bit_cast<float>(std::min(limit, largest));
  out.x[0] = x0;
  out.y[0] = in.y;
  out.count = 1;
  const auto take = [&](const auto& is_near) HWY_ATTR {
    for (int i = 0; i < keys.rows * wide && out.count <= wanted; ++i) {
      out.x[out.count] = x0 - search_reach + i % wide;
      out.y[out.count] = in.y - keys.above + i / wide;
      out.count += is_near(keys.key[i]) ? 1 : 0;
    }
  };
  if (reached <= wanted) return take([most](float key) { return key <= most; });
  take([most](float key) { return key < most; });
  take([most](float key) { return key == most; });
}

HWY_INLINE float group_variance(const PatchRow& in, int p, const Members& members) {
  float sum = 0;
  for (int i = 0; i < members.count; ++i) sum += variance_of(in, p, members.x[i], members.y[i]);
  return sum / static_cast<float>(members.count);
}

HWY_INLINE void gather(const PatchRow& in, int p, const Members& members, Patches& out) {
  const hn::FixedTag<float, 4> four;
  for (int i = 0; i < members.count; ++i) {
    const std::ptrdiff_t corner = members.y[i] * in.stride + members.x[i];
    for (int j = 0; j < patch; ++j) {
      const std::ptrdiff_t at = corner + j * in.stride;
      hn::Store(hn::LoadU(four, in.noisy[p] + at), four, out.noisy[i] + patch * j);
      hn::Store(hn::LoadU(four, in.pilot[p] + at), four, out.pilot[i] + patch * j);
    }
  }
}

/// Subtracts the mean patch; the padding patches up to a multiple of four become 0.
HWY_INLINE void centre(float (*patches)[cells], int count, float* mean) {
  const int n = lanes();
  for (int part = 0; part < cells; part += n) {
    VF sum = hn::Zero(Floats());
    for (int i = 0; i < count; ++i) sum = hn::Add(sum, load(patches[i] + part));
    sum = hn::Mul(sum, constant(1 / static_cast<float>(count)));
    store(sum, mean + part);
    for (int i = 0; i < count; ++i) store(hn::Sub(load(patches[i] + part), sum), patches[i] + part);
    for (int i = count; i % 4 != 0; ++i) store(hn::Zero(Floats()), patches[i] + part);
  }
}

/// Computes the mean of the patches' outer products.
HWY_INLINE void covariance(const float (*patches)[cells], int count, float (*out)[cells]) {
  const int n = lanes();
  const VF per_count = constant(1 / static_cast<float>(count));
  for (int row = 0; row < cells; row += 4) {
    VF sum[4][parts];
    for (auto& s : sum) {
      for (VF& v : s) v = hn::Zero(Floats());
    }
    for (int i = 0; i < count; ++i) {
      for (int r = 0; r < 4; ++r) {
        const VF one = constant(patches[i][row + r]);
        for (int part = 0; part < parts; ++part) {
          sum[r][part] = hn::MulAdd(one, load(patches[i] + part * n), sum[r][part]);
        }
      }
    }
    for (int r = 0; r < 4; ++r) {
      for (int part = 0; part < parts; ++part) store(hn::Mul(sum[r][part], per_count), out[row + r] + part * n);
    }
  }
}

/// Smallest variance relative to the trace of C: keeps the inverse within float precision.
constexpr float min_variance = 1e-6f;

/// Inverts by Gauss-Jordan in place a symmetric matrix whose eigenvalues are at least `least`: then so are its pivots,
/// except for rounding.
HWY_INLINE void invert(float (*m)[cells], float least) {
  const int n = lanes();
  for (int k = 0; k < cells; ++k) {
    const float per_pivot = 1 / std::max(m[k][k], least);
    m[k][k] = 1;
    VF pivot[parts];
    for (int part = 0; part < parts; ++part) {
      pivot[part] = hn::Mul(constant(per_pivot), load(m[k] + part * n));
      store(pivot[part], m[k] + part * n);
    }
    for (int i = 0; i < cells; ++i) {
      if (i == k) continue;
      const VF factor = constant(m[i][k]);
      m[i][k] = 0;
      for (int part = 0; part < parts; ++part) {
        store(hn::NegMulAdd(factor, pivot[part], load(m[i] + part * n)), m[i] + part * n);
      }
    }
  }
}

/// Computes patches <- mean + matrix patches, four at a time.
HWY_INLINE void apply(const float (*matrix)[cells], const float* mean, int count, float (*patches)[cells]) {
  const int n = lanes();
  for (int i = 0; i < count; i += 4) {
    VF sum[4][parts];
    for (auto& s : sum) {
      for (int part = 0; part < parts; ++part) s[part] = load(mean + part * n);
    }
    for (int k = 0; k < cells; ++k) {
      for (int part = 0; part < parts; ++part) {
        const VF row = load(matrix[k] + part * n);
        for (int q = 0; q < 4; ++q) sum[q][part] = hn::MulAdd(row, constant(patches[i + q][k]), sum[q][part]);
      }
    }
    for (int q = 0; q < 4; ++q) {
      for (int part = 0; part < parts; ++part) store(sum[q][part], patches[i + q] + part * n);
    }
  }
}

/// Trace and sum of squares of a filter, matrix (matrix + variance)^-1 = 1 - variance (matrix + variance)^-1.
struct Gains {
  float trace;
  float squares;
};
HWY_INLINE Gains to_filter(float variance, float (*m)[cells]) {
  for (int k = 0; k < cells; ++k) m[k][k] += variance;
  invert(m, 0.5f * variance);
  Gains out{0, 0};
  for (int k = 0; k < cells; ++k) {
    for (int i = 0; i < cells; ++i) {
      m[k][i] = (i == k ? 1.0f : 0.0f) - variance * m[k][i];
      out.squares += m[k][i] * m[k][i];
    }
    out.trace += m[k][k];
  }
  out.trace = std::max(out.trace, 0.0f);
  return out;
}

/// Computes noisy <- m + C (C + V)^-1 (noisy - mean of noisy), C the covariance of the pilot's patches. m is the
/// pilot's mean where little is kept, and the noisy one where much is kept: there the pilot may have lost as much as
/// the noise adds.
HWY_INLINE Filtered filter(int count, float variance, const ResidualOfPatches& left, Patches& at) {
  HWY_ALIGN float mean[cells], pilot_mean[cells];
  centre(at.noisy, count, mean);
  centre(at.pilot, count, pilot_mean);
  covariance(at.pilot, count, at.matrix);
  float power = 0;
  for (int k = 0; k < cells; ++k) power += at.matrix[k][k];
  const float v = std::max(variance, min_variance * power);
  const Gains gains = to_filter(v, at.matrix);
  const auto n = static_cast<float>(count);
  const float trust = std::min(1.0f, n * gains.trace / cells);
  for (int k = 0; k < cells; ++k) mean[k] = pilot_mean[k] + trust * (mean[k] - pilot_mean[k]);
  apply(at.matrix, mean, count, at.noisy);
  const float residual = v * ((left.trace * gains.trace + left.squares * gains.squares) / cells + left.other);
  return {1 / (v * (gains.squares + 1)), residual};
}

}  // namespace lowlux::denoise::rows::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
