#include "isp/raw/measure/meter_rows.h"

#include <algorithm>
#include <cstddef>
#include <cstdlib>

#if defined(__aarch64__)  // NEON only, as everywhere
#define HWY_DISABLED_TARGETS (HWY_SVE | HWY_SVE2 | HWY_SVE_256 | HWY_SVE2_128)
#endif
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "isp/raw/measure/meter_rows.cpp"
#include <hwy/foreach_target.h>  // compiles this file once more for each instruction set
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace lowlux::isp::meter::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

using Sums = hn::ScalableTag<std::uint32_t>;
using Codes = hn::Rebind<std::uint16_t, Sums>;  // as many lanes, of half the width
using Words = hn::ScalableTag<std::uint16_t>;

constexpr int max_difference = 5792;

/// Sums the columns of x on.
template <bool kSquares>
HWY_INLINE void sum_from(const CodeRows& in, int x, std::uint32_t* column, std::uint32_t* square) {
  const Sums s;
  const Codes c;
  const auto most = hn::Set(c, max_difference);
  const std::uint16_t* dn = in.dn + x;
  auto sum = hn::Zero(s), squares = hn::Zero(s);
  for (int row = 0; row < in.rows; ++row, dn += in.stride) {
    const auto a = hn::LoadU(c, dn);
    sum = hn::Add(sum, hn::PromoteTo(s, a));
    if constexpr (kSquares) {
      const auto b = hn::LoadU(c, dn + 2);
      const auto d = hn::PromoteTo(s, hn::Min(hn::Or(hn::SaturatedSub(a, b), hn::SaturatedSub(b, a)), most));
      squares = hn::Add(squares, hn::Mul(d, d));
    }
  }
  hn::StoreU(sum, s, column + x);
  if constexpr (kSquares) hn::StoreU(squares, s, square + x);
}

template <bool kSquares>
HWY_INLINE void sum_all(const CodeRows& in, std::uint32_t* column, std::uint32_t* square) {
  const int n = static_cast<int>(hn::Lanes(Sums())), needed = kSquares ? n + 2 : n;
  int x = 0;
  for (; x + needed <= in.width; x += n) sum_from<kSquares>(in, x, column, square);
  for (; x < in.width; ++x) {
    std::uint32_t sum = 0, squares = 0;
    for (int row = 0; row < in.rows; ++row) {
      const std::uint16_t* const dn = in.dn + in.stride * row + x;
      sum += dn[0];
      if (!kSquares || x + 2 >= in.width) continue;
      const int d = std::min(std::abs(dn[0] - dn[2]), max_difference);
      squares += static_cast<std::uint32_t>(d * d);
    }
    column[x] = sum;
    if (kSquares && x + 2 < in.width) square[x] = squares;
  }
}

void SumColumns(const CodeRows& in, std::uint32_t* column) { sum_all<false>(in, column, nullptr); }
void SumColumnsAndSquares(const CodeRows& in, std::uint32_t* column, std::uint32_t* square) {
  sum_all<true>(in, column, square);
}

Extremes CountExtremes(const std::uint16_t* dn, int width, std::uint16_t white) {
  const Words w;
  const int n = static_cast<int>(hn::Lanes(w));
  const auto limit = hn::Set(w, white), none = hn::Zero(w);
  Extremes out;
  int x = 0;
  for (; x + n <= width; x += n) {
    const auto codes = hn::LoadU(w, dn + x);
    out.clipped += static_cast<std::uint32_t>(hn::CountTrue(w, hn::Eq(hn::Max(codes, limit), codes)));
    out.zero += static_cast<std::uint32_t>(hn::CountTrue(w, hn::Eq(codes, none)));
  }
  for (; x < width; ++x) {
    out.clipped += dn[x] >= white ? 1 : 0;
    out.zero += dn[x] == 0 ? 1 : 0;
  }
  return out;
}

/// Processes pairs of sites, each as one 32-bit lane: the even column in the low half, the odd one in the high half.
void LumaOfCells(const std::uint16_t* upper, const std::uint16_t* lower, int width, const LumaBins& how,
                 std::uint16_t* bin) {
  const Sums s;
  const Codes c;
  const int n = static_cast<int>(hn::Lanes(s)), cells = width / 2;
  const Words w;
  const auto low = hn::Set(s, 0xFFFF), last = hn::Set(s, how.last);
  const auto weigh = [&](const std::uint16_t* row, int left) HWY_ATTR {
    const auto pairs = hn::BitCast(s, hn::LoadU(w, row));
    return hn::Add(hn::Mul(hn::And(pairs, low), hn::Set(s, how.weight[left])),
                   hn::Mul(hn::ShiftRight<16>(pairs), hn::Set(s, how.weight[left + 1])));
  };
  int i = 0;
  for (; i + n <= cells; i += n) {
    const std::ptrdiff_t x = 2 * static_cast<std::ptrdiff_t>(i);
    const auto code = hn::ShiftRight<8>(hn::Add(weigh(upper + x, 0), weigh(lower + x, 2)));
    const auto place = how.shift >= 0 ? hn::ShiftRightSame(code, how.shift) : hn::ShiftLeftSame(code, -how.shift);
    hn::StoreU(hn::DemoteTo(c, hn::BitCast(hn::RebindToSigned<Sums>(), hn::Min(place, last))), c, bin + i);
  }
  for (; i < cells; ++i) {
    const std::uint32_t luma =
        std::uint32_t{how.weight[0]} * upper[2 * i] + std::uint32_t{how.weight[1]} * upper[2 * i + 1] +
        std::uint32_t{how.weight[2]} * lower[2 * i] + std::uint32_t{how.weight[3]} * lower[2 * i + 1];
    const std::uint32_t code = luma >> 8, place = how.shift >= 0 ? code >> how.shift : code << -how.shift;
    bin[i] = static_cast<std::uint16_t>(std::min<std::uint32_t>(place, how.last));
  }
}

}  // namespace lowlux::isp::meter::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace lowlux::isp::meter {
HWY_EXPORT(SumColumns);
HWY_EXPORT(SumColumnsAndSquares);
HWY_EXPORT(CountExtremes);
HWY_EXPORT(LumaOfCells);

void sum_columns(const CodeRows& in, std::uint32_t* column) { HWY_DYNAMIC_DISPATCH(SumColumns)(in, column); }
void sum_columns(const CodeRows& in, std::uint32_t* column, std::uint32_t* square) {
  HWY_DYNAMIC_DISPATCH(SumColumnsAndSquares)(in, column, square);
}
Extremes count_extremes(const std::uint16_t* dn, int width, std::uint16_t white) {
  return HWY_DYNAMIC_DISPATCH(CountExtremes)(dn, width, white);
}
void luma_bins(const std::uint16_t* upper, const std::uint16_t* lower, int width, const LumaBins& how,
               std::uint16_t* bin) {
  HWY_DYNAMIC_DISPATCH(LumaOfCells)(upper, lower, width, how, bin);
}

}  // namespace lowlux::isp::meter
#endif
