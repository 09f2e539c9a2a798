#include <bit>
#include <cstddef>
#include <cstdint>
#include <cstring>

#include "isp/raw/kernel/raw_to_rgb_rows.h"

#if defined(__aarch64__)  // NEON only: the vectors of SVE have no size, so no structs can be made of them
#define HWY_DISABLED_TARGETS (HWY_SVE | HWY_SVE2 | HWY_SVE_256 | HWY_SVE2_128)
#endif
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "isp/raw/kernel/raw_to_rgb_split.cpp"
#include <hwy/foreach_target.h>  // compiles this file once more for each instruction set
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace lowlux::isp::rows::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

using Floats = hn::ScalableTag<float>;
using VF = hn::Vec<Floats>;
static_assert(std::endian::native == std::endian::little);

/// Calls put(source, i) for each vector of pairs of a row, the last partial one read from a zero-filled copy.
template <class T, class Put>
HWY_INLINE void for_each_vector_of_pairs(const T* in, int width, const Put& put) {
  const auto lanes = static_cast<int>(hn::Lanes(Floats()));
  int i = 0;
  for (; 2 * (i + lanes) <= width; i += lanes) put(in + 2 * i, i);
  if (2 * i >= width) return;
  HWY_ALIGN T rest[2 * hn::MaxLanes(Floats())] = {};
  std::memcpy(rest, in + 2 * i, static_cast<std::size_t>(width - 2 * i) * sizeof(T));
  put(rest, i);
}

struct PutDn {
  SplitRow out;
  VF black[2];
  VF gain[2];

  HWY_INLINE void operator()(const std::uint16_t* in, int i) const {
    const Floats f;
    const hn::RebindToSigned<Floats> s32;
    const hn::RebindToUnsigned<Floats> u32;
    const hn::Repartition<std::uint16_t, Floats> u16;
    const auto pair = hn::BitCast(u32, hn::LoadU(u16, in));  // low half: even column, high half: odd column
    const auto even = hn::ConvertTo(f, hn::BitCast(s32, hn::And(pair, hn::Set(u32, 0xFFFF))));
    const auto odd = hn::ConvertTo(f, hn::BitCast(s32, hn::ShiftRight<16>(pair)));
    hn::StoreU(hn::Mul(hn::Sub(even, black[0]), gain[0]), f, out.even + i);
    hn::StoreU(hn::Mul(hn::Sub(odd, black[1]), gain[1]), f, out.odd + i);
  }
};

struct PutFloat {
  SplitRow out;
  VF gain[2];

  static HWY_INLINE VF defined(VF x) {
    const Floats f;
    const VF number = hn::IfThenElseZero(hn::Eq(x, x), x);
    return hn::Min(hn::Max(number, hn::Set(f, -1e9f)), hn::Set(f, 1e9f));
  }
  HWY_INLINE void operator()(const float* in, int i) const {
    const Floats f;
    VF even, odd;
    hn::LoadInterleaved2(f, in, even, odd);
    hn::StoreU(hn::Mul(defined(even), gain[0]), f, out.even + i);
    hn::StoreU(hn::Mul(defined(odd), gain[1]), f, out.odd + i);
  }
};

void SplitDn(const std::uint16_t* in, int width, const RowLevels& levels, const SplitRow& out) {
  const Floats f;
  const PutDn put{out,
                  {hn::Set(f, levels.black[0]), hn::Set(f, levels.black[1])},
                  {hn::Set(f, levels.gain[0]), hn::Set(f, levels.gain[1])}};
  for_each_vector_of_pairs(in, width, put);
}

void SplitFloat(const float* in, int width, const RowLevels& levels, const SplitRow& out) {
  const Floats f;
  for_each_vector_of_pairs(in, width, PutFloat{out, {hn::Set(f, levels.gain[0]), hn::Set(f, levels.gain[1])}});
}

void BinRow(const CellRow& in, int cells, const Planes& out) {
  const Floats f;
  const auto lanes = static_cast<int>(hn::Lanes(f));
  const VF half = hn::Set(f, 0.5f);
  HWY_ALIGN float last[3][hn::MaxLanes(Floats())];
  for (int i = 0; i < cells; i += lanes) {
    const bool whole = i + lanes <= cells;
    const VF green = hn::Mul(half, hn::Add(hn::LoadU(f, in.site[1] + i), hn::LoadU(f, in.site[2] + i)));
    hn::StoreU(hn::LoadU(f, in.site[0] + i), f, whole ? out.out[0] + i : last[0]);
    hn::StoreU(green, f, whole ? out.out[1] + i : last[1]);
    hn::StoreU(hn::LoadU(f, in.site[3] + i), f, whole ? out.out[2] + i : last[2]);
    if (whole) continue;
    for (int c = 0; c < 3; ++c) {
      std::memcpy(out.out[c] + i, last[c], static_cast<std::size_t>(cells - i) * sizeof(float));
    }
  }
}

void QuarterRow(const QuarterRuns& in, int cells, float* out) {
  const Floats f;
  const auto lanes = static_cast<int>(hn::Lanes(f));
  const VF factor = hn::Set(f, in.factor);
  HWY_ALIGN float last[hn::MaxLanes(Floats())];
  for (int j = 0; j < cells; j += lanes) {
    VF low = hn::Zero(f), high = hn::Zero(f);
    for (int k = 0; k < in.runs; ++k) {
      low = hn::Add(low, hn::LoadU(f, in.run[k] + 2 * j));
      high = hn::Add(high, hn::LoadU(f, in.run[k] + 2 * j + lanes));
    }
    const VF mean = hn::Mul(factor, hn::Add(hn::ConcatEven(f, high, low), hn::ConcatOdd(f, high, low)));
    const bool whole = j + lanes <= cells;
    hn::StoreU(mean, f, whole ? out + j : last);
    if (!whole) std::memcpy(out + j, last, static_cast<std::size_t>(cells - j) * sizeof(float));
  }
}

void BlendRow(const float* a, const float* b, float t, int n, float* out) {
  const Floats f;
  const auto lanes = static_cast<int>(hn::Lanes(f));
  const VF way = hn::Set(f, t);
  int i = 0;
  for (; i + lanes <= n; i += lanes) {
    const VF from = hn::LoadU(f, a + i);
    hn::StoreU(hn::MulAdd(way, hn::Sub(hn::LoadU(f, b + i), from), from), f, out + i);
  }
  for (; i < n; ++i) out[i] = a[i] + t * (b[i] - a[i]);
}

}  // namespace lowlux::isp::rows::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace lowlux::isp::rows {

HWY_EXPORT(SplitDn);
HWY_EXPORT(SplitFloat);
HWY_EXPORT(BinRow);
HWY_EXPORT(QuarterRow);
HWY_EXPORT(BlendRow);

void split_dn(const std::uint16_t* in, int width, const RowLevels& levels, const SplitRow& out) {
  HWY_DYNAMIC_DISPATCH(SplitDn)(in, width, levels, out);
}
void split_float(const float* in, int width, const RowLevels& levels, const SplitRow& out) {
  HWY_DYNAMIC_DISPATCH(SplitFloat)(in, width, levels, out);
}
void bin_row(const CellRow& in, int cells, const Planes& out) { HWY_DYNAMIC_DISPATCH(BinRow)(in, cells, out); }
void quarter_row(const QuarterRuns& in, int cells, float* out) { HWY_DYNAMIC_DISPATCH(QuarterRow)(in, cells, out); }
void blend_row(const float* a, const float* b, float t, int n, float* out) {
  HWY_DYNAMIC_DISPATCH(BlendRow)(a, b, t, n, out);
}

}  // namespace lowlux::isp::rows
#endif
