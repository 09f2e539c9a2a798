#include "isp/render/night/eye_rows.h"

#include <cstdint>
#include <cstring>

#if defined(__aarch64__)  // NEON only: the vectors of SVE have no size, so no structs can be made of them
#define HWY_DISABLED_TARGETS (HWY_SVE | HWY_SVE2 | HWY_SVE_256 | HWY_SVE2_128)
#endif
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "isp/render/night/eye_rows.cpp"
#include <hwy/foreach_target.h>  // compiles this file once more for each instruction set
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace lowlux::isp::rows::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

using Floats = hn::ScalableTag<float>;
using Ints = hn::RebindToSigned<Floats>;
using VF = hn::Vec<Floats>;
using VI = hn::Vec<Ints>;

HWY_INLINE VF constant(float x) { return hn::Set(Floats(), x); }

constexpr float v0 = 683.0f / 1699.0f;  // scotopic_at_555_nm
constexpr float darkest = 1e-7f;        // [cd/m2], below the tables' first node

/// Returns log2 of positive normal numbers within 2e-6: exponent and an odd polynomial in (f - 1) / (f + 1), f in
/// [sqrt(1/2), sqrt(2)).
HWY_INLINE VF log2_of(VF x) {
  const Floats f;
  const Ints i;
  const VI bits = hn::Sub(hn::BitCast(i, x), hn::Set(i, 0x3F3504F3));
  const VI exponent = hn::ShiftRight<23>(bits);
  const VF fraction = hn::BitCast(f, hn::Sub(hn::BitCast(i, x), hn::ShiftLeft<23>(exponent)));
  const VF g = hn::Sub(fraction, constant(1));
  const VF s = hn::Div(g, hn::Add(constant(2), g));
  const VF s2 = hn::Mul(s, s);
  // 2 / ln 2 (1 + s^2 / 3 + s^4 / 5 + s^6 / 7)
  VF sum = hn::MulAdd(s2, constant(0.41219858f), constant(0.57707802f));
  sum = hn::MulAdd(s2, sum, constant(0.96179669f));
  sum = hn::MulAdd(s2, sum, constant(2.88539008f));
  return hn::MulAdd(s, sum, hn::ConvertTo(f, exponent));
}

/// Locates a value between two nodes of an axis.
struct Place {
  VI node;
  VF way;
};

HWY_INLINE Place place_on(VF value, float first, float last, int nodes) {
  const Floats f;
  const Ints i;
  const float per_unit = static_cast<float>(nodes - 1) / (last - first);
  const VF at = hn::Mul(hn::Sub(value, constant(first)), constant(per_unit));
  const VF inside = hn::Min(hn::Max(at, constant(0)), constant(static_cast<float>(nodes - 1)));
  const VI node = hn::Min(hn::ConvertTo(i, inside), hn::Set(i, nodes - 2));
  return {node, hn::Sub(inside, hn::ConvertTo(f, node))};
}

HWY_INLINE VF between(const float* table, VI node, VF way) {
  const Floats f;
  const VF low = hn::GatherIndex(f, table, node);
  return hn::MulAdd(way, hn::Sub(hn::GatherIndex(f, table + 1, node), low), low);
}

/// Calls step(i) for each vector of n samples; the last vector overlaps the previous one where the samples do not fill
/// it. Returns false for fewer samples than a vector.
template <class Step>
HWY_INLINE bool for_each_vector(int n, const Step& step) {
  const auto lanes = static_cast<int>(hn::Lanes(Floats()));
  if (n < lanes) return false;
  for (int i = 0; i + lanes <= n; i += lanes) step(i);
  if (n % lanes != 0) step(n - lanes);
  return true;
}

/// Replaces values that are not numbers with 0 and limits the rest to +-1e9.
HWY_INLINE VF defined(VF x) {
  const VF number = hn::IfThenElseZero(hn::Eq(x, x), x);
  return hn::Min(hn::Max(number, constant(-1e9f)), constant(1e9f));
}

void LightRowOf(const LightRow& in, const LightWeights& weights, int n, float* photopic, float* scotopic) {
  const Floats f;
  const VF clip = constant(weights.clip);
  const bool done = for_each_vector(n, [&](int i) HWY_ATTR {
    VF light = hn::Zero(f), rods = hn::Zero(f);
    for (int c = 0; c < 3; ++c) {
      const VF v = hn::Min(defined(hn::LoadU(f, in.camera[c] + i)), clip);
      light = hn::MulAdd(constant(weights.photopic[c]), v, light);
      rods = hn::MulAdd(constant(weights.scotopic[c]), v, rods);
    }
    hn::StoreU(light, f, photopic + i);
    hn::StoreU(rods, f, scotopic + i);
  });
  if (done) return;
  HWY_ALIGN float short_row[5][hn::MaxLanes(Floats())] = {};
  for (int c = 0; c < 3; ++c) std::memcpy(short_row[c], in.camera[c], static_cast<std::size_t>(n) * sizeof(float));
  LightRowOf({{short_row[0], short_row[1], short_row[2]}}, weights, static_cast<int>(hn::Lanes(f)), short_row[3],
             short_row[4]);
  std::memcpy(photopic, short_row[3], static_cast<std::size_t>(n) * sizeof(float));
  std::memcpy(scotopic, short_row[4], static_cast<std::size_t>(n) * sizeof(float));
}

HWY_INLINE VF adaptation_coefficient(const EyeTables& t, VF log2_light, VF log2_ratio) {
  const Place light = place_on(log2_light, EyeTables::first_log2_light, EyeTables::last_log2_light, EyeTables::lights);
  const Place ratio = place_on(log2_ratio, EyeTables::first_log2_ratio, EyeTables::last_log2_ratio, EyeTables::ratios);
  const VI node = hn::Add(hn::ShiftLeft<8>(ratio.node), light.node);
  static_assert(EyeTables::lights == 1 << 8);
  const VF low = between(t.m.data(), node, light.way);
  const VF high = between(t.m.data() + EyeTables::lights, node, light.way);
  const VF m = hn::MulAdd(ratio.way, hn::Sub(high, low), low);
  return hn::Min(hn::Max(m, constant(0)), constant(1));
}

HWY_INLINE void eye(const EyeTables& t, VF white_ratio, VF photopic, VF scotopic, int i, const EyeRow& out) {
  const Floats f;
  const VF p = hn::Max(photopic, constant(darkest)), s = hn::Max(scotopic, constant(darkest));
  const VF log2_p = log2_of(p);
  const VF m = adaptation_coefficient(t, log2_p, hn::Sub(log2_of(s), log2_p));
  const VF rods = hn::Mul(hn::Sub(constant(1), m), constant(v0));
  const VF of_white = hn::Mul(rods, white_ratio);
  hn::StoreU(hn::Div(of_white, hn::Add(m, of_white)), f, out.rod_fraction + i);

  const VF seen = hn::MulAdd(hn::Div(rods, hn::Add(m, rods)), hn::Sub(s, p), p);
  const VF chroma = hn::Div(hn::Mul(seen, constant(t.chroma_scale)), hn::Add(seen, constant(t.half_saturation_cd_m2)));
  hn::StoreU(hn::Min(chroma, constant(1)), f, out.chroma + i);

  const Place light =
      place_on(log2_of(seen), EyeTables::first_log2_light, EyeTables::last_log2_light, EyeTables::lights);
  const VF blue = between(t.blue.data(), light.node, light.way);
  hn::StoreU(hn::Mul(hn::Sub(constant(1), m), blue), f, out.blue + i);
  hn::StoreU(between(t.variance_deg2.data(), light.node, light.way), f, out.variance_deg2 + i);
}

void EyeRowOf(const EyeTables& tables, float white, const float* photopic, const float* scotopic, int n,
              const EyeRow& out) {
  const Floats f;
  const VF ratio = constant(white);
  const bool done = for_each_vector(
      n, [&](int i) HWY_ATTR { eye(tables, ratio, hn::LoadU(f, photopic + i), hn::LoadU(f, scotopic + i), i, out); });
  if (done) return;
  HWY_ALIGN float row[6][hn::MaxLanes(Floats())] = {};
  const std::size_t bytes = static_cast<std::size_t>(n) * sizeof(float);
  std::memcpy(row[0], photopic, bytes);
  std::memcpy(row[1], scotopic, bytes);
  eye(tables, ratio, hn::Load(f, row[0]), hn::Load(f, row[1]), 0, {row[2], row[3], row[4], row[5]});
  std::memcpy(out.rod_fraction, row[2], bytes);
  std::memcpy(out.chroma, row[3], bytes);
  std::memcpy(out.blue, row[4], bytes);
  std::memcpy(out.variance_deg2, row[5], bytes);
}

}  // namespace lowlux::isp::rows::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace lowlux::isp::rows {

HWY_EXPORT(LightRowOf);
HWY_EXPORT(EyeRowOf);

void light_row(const LightRow& in, const LightWeights& weights, int n, float* photopic, float* scotopic) {
  HWY_DYNAMIC_DISPATCH(LightRowOf)(in, weights, n, photopic, scotopic);
}
void eye_row(const EyeTables& tables, float scotopic_ratio_of_white, const float* photopic, const float* scotopic,
             int n, const EyeRow& out) {
  HWY_DYNAMIC_DISPATCH(EyeRowOf)(tables, scotopic_ratio_of_white, photopic, scotopic, n, out);
}

}  // namespace lowlux::isp::rows
#endif
