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

void AddRow(const std::uint16_t* dn, int width, std::uint32_t* column) {
  const Sums s;
  const Codes c;
  const int n = static_cast<int>(hn::Lanes(s));
  int x = 0;
  for (; x + n <= width; x += n) {
    hn::StoreU(hn::Add(hn::LoadU(s, column + x), hn::PromoteTo(s, hn::LoadU(c, dn + x))), s, column + x);
  }
  for (; x < width; ++x) column[x] += dn[x];
}

void AddSquares(const std::uint16_t* dn, int width, std::uint32_t* column) {
  const Sums s;
  const Codes c;
  const int n = static_cast<int>(hn::Lanes(s));
  const auto most = hn::Set(c, max_difference);
  int x = 0;
  for (; x + n + 2 <= width; x += n) {
    const auto a = hn::LoadU(c, dn + x), b = hn::LoadU(c, dn + x + 2);
    const auto d = hn::PromoteTo(s, hn::Min(hn::Or(hn::SaturatedSub(a, b), hn::SaturatedSub(b, a)), most));
    hn::StoreU(hn::Add(hn::LoadU(s, column + x), hn::Mul(d, d)), s, column + x);
  }
  for (; x + 2 < width; ++x) {
    const int d = std::min(std::abs(dn[x] - dn[x + 2]), max_difference);
    column[x] += static_cast<std::uint32_t>(d * d);
  }
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
HWY_EXPORT(AddRow);
HWY_EXPORT(AddSquares);
HWY_EXPORT(CountExtremes);
HWY_EXPORT(LumaOfCells);

void add_row(const std::uint16_t* dn, int width, std::uint32_t* column) {
  HWY_DYNAMIC_DISPATCH(AddRow)(dn, width, column);
}
void add_squares(const std::uint16_t* dn, int width, std::uint32_t* column) {
  HWY_DYNAMIC_DISPATCH(AddSquares)(dn, width, column);
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
