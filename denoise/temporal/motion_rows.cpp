#include "denoise/temporal/motion_rows.h"

#include <cstring>

#if defined(__aarch64__)  // NEON only, as in isp/raw: arrays of vectors need vectors of known size
#define HWY_DISABLED_TARGETS (HWY_SVE | HWY_SVE2 | HWY_SVE_256 | HWY_SVE2_128)
#endif
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "denoise/temporal/motion_rows.cpp"
#include <hwy/foreach_target.h>  // compiles this file once more for each instruction set
#include <hwy/highway.h>

// Cells must be identical on every processor: no fused products, no estimates.
HWY_BEFORE_NAMESPACE();
namespace lowlux::denoise::rows::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

using Floats = hn::ScalableTag<float>;
using VF = hn::Vec<Floats>;
using Shorts = hn::ScalableTag<std::int16_t>;
using Sums = hn::CappedTag<std::int32_t, tile_cells>;
using HalfShorts = hn::Rebind<std::int16_t, Sums>;

constexpr float max_units = 8191;           // the sum of 16 cells, over 4, is a 16-bit number
constexpr int max_slope = 2047;             // 500 standard deviations: lamps do not determine a tile alone
constexpr long long max_pending = 1 << 16;  // vectors of two products each, whose sums are 32-bit numbers

HWY_INLINE VF constant(float x) { return hn::Set(Floats(), x); }

/// Returns 0 for NaN, and otherwise x limited to +-1e9.
HWY_INLINE VF usable(VF x) {
  const VF number = hn::IfThenElseZero(hn::Eq(x, x), x);
  return hn::Min(hn::Max(number, constant(-1e9f)), constant(1e9f));
}

HWY_INLINE void stabilise_cells(const StabiliseRow& in, const float* upper, const float* lower, std::int16_t* out) {
  const hn::Rebind<std::int16_t, Floats> shorts;
  VF a, b, c, d;
  hn::LoadInterleaved2(Floats(), upper, a, b);
  hn::LoadInterleaved2(Floats(), lower, c, d);
  const VF above = hn::Add(hn::Sub(usable(a), constant(in.dark_e[0])), hn::Sub(usable(b), constant(in.dark_e[1])));
  const VF below = hn::Add(hn::Sub(usable(c), constant(in.dark_e[2])), hn::Sub(usable(d), constant(in.dark_e[3])));
  const VF variance = hn::Add(hn::Add(above, below), constant(in.offset_e2));
  const VF root = hn::Sqrt(hn::Max(variance, hn::Zero(Floats())));
  const VF units = hn::Min(hn::Mul(constant(2 * units_per_sigma), root), constant(max_units));
  hn::StoreU(hn::DemoteTo(shorts, hn::NearestInt(units)), shorts, out);
}

void StabiliseRowOf(const StabiliseRow& in, std::int16_t* out) {
  const int lanes = static_cast<int>(hn::Lanes(Floats()));
  int i = 0;
  for (; i + lanes <= in.cells; i += lanes) stabilise_cells(in, in.upper + 2 * i, in.lower + 2 * i, out + i);
  if (i == in.cells) return;
  constexpr std::size_t most = hn::MaxLanes(Floats());
  float upper[2 * most] = {}, lower[2 * most] = {};
  std::int16_t cells[most];
  const auto left = static_cast<std::size_t>(in.cells - i);
  std::memcpy(upper, in.upper + 2 * i, 2 * left * sizeof(float));
  std::memcpy(lower, in.lower + 2 * i, 2 * left * sizeof(float));
  stabilise_cells(in, upper, lower, cells);
  std::memcpy(out + i, cells, left * sizeof(std::int16_t));
}

HWY_INLINE int limited(int x, int most) { return x < -most ? -most : x > most ? most : x; }

std::int64_t SquaredDifference(const CellPair& at, int width, int height) {
  const Shorts s;
  const hn::RepartitionToWide<Shorts> wide;
  const int lanes = static_cast<int>(hn::Lanes(s));
  const auto least = hn::Set(s, -max_difference), most = hn::Set(s, max_difference);
  const std::int16_t *frame = at.frame, *mean = at.mean;
  auto even = hn::Zero(wide), odd = hn::Zero(wide);
  std::int64_t sum = 0;
  long long pending = 0;
  for (int y = 0; y < height; ++y, frame += at.frame_stride, mean += at.mean_stride) {
    int x = 0;
    for (; x + lanes <= width; x += lanes) {
      const auto d = hn::Min(hn::Max(hn::SaturatedSub(hn::LoadU(s, frame + x), hn::LoadU(s, mean + x)), least), most);
      even = hn::ReorderWidenMulAccumulate(wide, d, d, even, odd);
    }
    for (; x < width; ++x) {
      const int d = limited(frame[x] - mean[x], max_difference);
      sum += static_cast<std::int64_t>(d) * d;
    }
    pending += width / lanes;
    if (pending < max_pending && y + 1 < height) continue;
    // The sum of all lanes may exceed 32 bits: those of few vectors are added at a time.
    HWY_ALIGN std::int32_t lane[2 * hn::MaxLanes(wide)];
    hn::Store(even, wide, lane);
    hn::Store(odd, wide, lane + hn::Lanes(wide));
    for (std::size_t i = 0; i < 2 * hn::Lanes(wide); ++i) sum += lane[i];
    even = odd = hn::Zero(wide);
    pending = 0;
  }
  return sum;
}

HWY_INLINE hn::Vec<Sums> difference(const std::int16_t* a, const std::int16_t* b) {
  const Sums s;
  const auto d = hn::Sub(hn::PromoteTo(s, hn::LoadU(HalfShorts(), a)), hn::PromoteTo(s, hn::LoadU(HalfShorts(), b)));
  return hn::Min(hn::Max(d, hn::Set(s, -max_slope)), hn::Set(s, max_slope));
}

void SlopesOfBlocks(const CellPair& at, int blocks, BlockSlopes* out) {
  const Sums s;
  const int lanes = static_cast<int>(hn::Lanes(s));
  constexpr int figures = sizeof(BlockSlopes) / sizeof(std::int32_t);
  HWY_ALIGN std::int32_t columns[figures][tile_cells];
  for (int i = 0; i < block_cells * blocks; i += lanes) {
    auto xx = hn::Zero(s), xy = hn::Zero(s), yy = hn::Zero(s), xd = hn::Zero(s), yd = hn::Zero(s);
    for (int y = 0; y < block_cells; ++y) {
      const std::int16_t *frame = at.frame + y * at.frame_stride + i, *mean = at.mean + y * at.mean_stride + i;
      const auto gx = difference(mean + 1, mean - 1), d = difference(frame, mean);
      const auto gy = difference(mean + at.mean_stride, mean - at.mean_stride);
      xx = hn::Add(xx, hn::Mul(gx, gx));
      xy = hn::Add(xy, hn::Mul(gx, gy));
      yy = hn::Add(yy, hn::Mul(gy, gy));
      xd = hn::Add(xd, hn::Mul(gx, d));
      yd = hn::Add(yd, hn::Mul(gy, d));
    }
    hn::Store(xx, s, columns[0] + i);
    hn::Store(xy, s, columns[1] + i);
    hn::Store(yy, s, columns[2] + i);
    hn::Store(xd, s, columns[3] + i);
    hn::Store(yd, s, columns[4] + i);
  }
  for (int block = 0; block < blocks; ++block) {
    std::int32_t sum[figures] = {};
    for (int k = 0; k < figures; ++k) {
      for (int i = block_cells * block; i < block_cells * (block + 1); ++i) sum[k] += columns[k][i];
    }
    out[block] = {sum[0], sum[1], sum[2], sum[3], sum[4]};
  }
}

}  // namespace lowlux::denoise::rows::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace lowlux::denoise::rows {

HWY_EXPORT(SlopesOfBlocks);
HWY_EXPORT(SquaredDifference);
HWY_EXPORT(StabiliseRowOf);

void stabilise_row(const StabiliseRow& in, std::int16_t* out) { HWY_DYNAMIC_DISPATCH(StabiliseRowOf)(in, out); }
std::int64_t squared_difference(const CellPair& at, int width, int height) {
  return HWY_DYNAMIC_DISPATCH(SquaredDifference)(at, width, height);
}
void block_slopes(const CellPair& at, int blocks, BlockSlopes* out) {
  HWY_DYNAMIC_DISPATCH(SlopesOfBlocks)(at, blocks, out);
}

}  // namespace lowlux::denoise::rows
#endif
