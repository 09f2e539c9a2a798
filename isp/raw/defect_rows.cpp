#include "isp/raw/defect_rows.h"

#include <algorithm>

#if defined(__aarch64__)  // NEON only, as everywhere
#define HWY_DISABLED_TARGETS (HWY_SVE | HWY_SVE2 | HWY_SVE_256 | HWY_SVE2_128)
#endif
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "isp/raw/defect_rows.cpp"
#include <hwy/foreach_target.h>  // compiles this file once more for each instruction set
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace lowlux::isp::defect_rows::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

using Floats = hn::ScalableTag<float>;
using Words = hn::RebindToSigned<Floats>;
using Codes = hn::Rebind<std::uint16_t, Floats>;  // as many lanes, of half the width
using Bytes = hn::Rebind<std::uint8_t, Floats>;

using VF = hn::Vec<Floats>;
using VC = hn::Vec<Codes>;

HWY_INLINE VF floats(VC codes) { return hn::ConvertTo(Floats(), hn::PromoteTo(Words(), codes)); }
HWY_INLINE VF floats(VF samples) { return samples; }

/// Returns how far a is above b; 0 where it is not.
HWY_INLINE VC above(VC a, VC b) { return hn::SaturatedSub(a, b); }
HWY_INLINE VF above(VF a, VF b) { return hn::Max(hn::Sub(a, b), hn::Zero(Floats())); }

/// @param d  the vectors that samples are loaded to, with as many lanes as Floats
template <class D, class Sample>
HWY_INLINE void MarkRow(D d, const Rows<Sample>& rows, int count, const Bounds& bounds, std::uint8_t* marked) {
  const Floats f;
  using V = hn::Vec<D>;
  const VF black = hn::OddEven(hn::Set(f, bounds.black_dn[1]), hn::Set(f, bounds.black_dn[0]));
  const VF factor = hn::Set(f, bounds.range_factor), floor = hn::Set(f, bounds.floor_dn);
  const VF variance = hn::Set(f, bounds.variance_dn2), shot = hn::Set(f, bounds.shot_dn);
  const int n = static_cast<int>(hn::Lanes(f));
  int i = 0;
  for (; i + n <= count; i += n) {
    V low = hn::LoadU(d, rows.above + i), high = low;
    for (const Sample* at : {rows.above + i - 2, rows.above + i + 2, rows.here + i - 2, rows.here + i + 2,
                             rows.below + i - 2, rows.below + i, rows.below + i + 2}) {
      const V sample = hn::LoadU(d, at);
      low = hn::Min(low, sample);
      high = hn::Max(high, sample);
    }
    const V sample = hn::LoadU(d, rows.here + i);
    const VF distance = floats(hn::Max(above(sample, high), above(low, sample)));
    const VF nearer = floats(hn::IfThenElse(hn::Gt(sample, high), high, low));
    const VF level = hn::Max(hn::Sub(nearer, black), hn::Zero(f));
    const VF plain = hn::MulAdd(factor, floats(hn::Sub(high, low)), floor);
    const VF bound = hn::MulAdd(plain, plain, hn::MulAdd(shot, level, variance));
    const auto far = hn::And(hn::Gt(distance, hn::Zero(f)), hn::Ge(hn::Mul(distance, distance), bound));
    const auto one = hn::IfThenElseZero(hn::RebindMask(Words(), far), hn::Set(Words(), 1));
    hn::StoreU(hn::DemoteTo(Bytes(), one), Bytes(), marked + i);
  }
  std::fill(marked + i, marked + count, std::uint8_t{1});
}

void MarkCodes(const Rows<std::uint16_t>& rows, int count, const Bounds& bounds, std::uint8_t* marked) {
  MarkRow(Codes(), rows, count, bounds, marked);
}

void MarkFloats(const Rows<float>& rows, int count, const Bounds& bounds, std::uint8_t* marked) {
  MarkRow(Floats(), rows, count, bounds, marked);
}

}  // namespace lowlux::isp::defect_rows::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace lowlux::isp::defect_rows {
HWY_EXPORT(MarkCodes);
HWY_EXPORT(MarkFloats);

void mark_outliers(const Rows<std::uint16_t>& rows, int count, const Bounds& bounds, std::uint8_t* marked) {
  HWY_DYNAMIC_DISPATCH(MarkCodes)(rows, count, bounds, marked);
}

void mark_outliers(const Rows<float>& rows, int count, const Bounds& bounds, std::uint8_t* marked) {
  HWY_DYNAMIC_DISPATCH(MarkFloats)(rows, count, bounds, marked);
}

}  // namespace lowlux::isp::defect_rows
#endif
