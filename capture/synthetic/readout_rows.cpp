#include "capture/synthetic/readout_rows.h"

#include "capture/synthetic/readout.h"

#if defined(__aarch64__)  // NEON only: the vectors of SVE have no size, so no structs can be made of them
#define HWY_DISABLED_TARGETS (HWY_SVE | HWY_SVE2 | HWY_SVE_256 | HWY_SVE2_128)
#endif
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "capture/synthetic/readout_rows.cpp"
#include <hwy/foreach_target.h>  // compiles this file once more for each instruction set
#include <hwy/highway.h>

#include "isp/base/random-inl.h"

HWY_BEFORE_NAMESPACE();
namespace lowlux::capture::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;
using namespace draws::HWY_NAMESPACE;

/// Electrons of one vector of pixels, read noise and offset included.
HWY_INLINE VF electrons(const draws::Row& row, VU x, const ChargePointers& at, const ReadoutParameters& p,
                        std::size_t left) {
  const Floats f;
  const bool any_draw = p.photon_noise || p.read_noise_e != 0;
  const FourWords r = any_draw ? words_of(row, x) : FourWords{{x, x, x, x}};
  VF n = load(f, at.mean_e, left);
  if (p.photon_noise) n = poisson_of(r.word[0], n);
  if (at.steady_e != nullptr) n = hn::Add(n, load(f, at.steady_e, left));
  const VF full = constant(p.full_well_e);
  VF e = hn::IfThenElse(hn::Gt(n, full), full, n);  // not Min, which differs between processors at NaN
  if (p.read_noise_e != 0) e = hn::Add(e, hn::Mul(constant(p.read_noise_e), normal_of(r.word[1])));
  if (at.offset_e != nullptr) e = hn::Add(e, load(f, at.offset_e, left));
  return e;
}

HWY_INLINE VF dn_of(VF e, const ReadoutParameters& p) {
  VF v = hn::Add(constant(p.black_dn), hn::Mul(constant(p.gain_dn_per_e), e));
  if (p.quantise) v = p.quantisation == Quantisation::floor ? hn::Floor(v) : hn::Round(v);
  if (p.clip) return hn::Min(hn::IfThenElseZero(hn::Gt(v, constant(0)), v), constant(p.max_dn));
  return hn::Add(v, constant(0));  // a zero without sign: rounding gives either, as the processor likes
}

HWY_INLINE void put(VF v, float* to, std::size_t left) { store(Floats(), v, to, left); }

HWY_INLINE void put(VF v, std::uint16_t* to, std::size_t left) {
  const hn::Rebind<std::uint16_t, Floats> u16;
  store(u16, hn::DemoteTo(u16, hn::ConvertTo(Ints(), v)), to, left);
}

template <class T>
HWY_INLINE void read_out(const draws::Row& from, const ChargePointers& charge, const ReadoutParameters& parameters,
                         std::size_t count, T* dn) {
  const draws::Row row = from;  // copies, so that no store can change them
  const ReadoutParameters p = parameters;
  ChargePointers at = charge;
  const std::size_t lanes = hn::Lanes(Floats());
  VU x = first_columns(row);
  for (std::size_t i = 0; i < count; i += lanes) {
    put(dn_of(electrons(row, x, at, p, count - i), p), dn + i, count - i);
    x = hn::Add(x, hn::Set(Words(), static_cast<std::uint32_t>(lanes)));
    at.mean_e += lanes;
    if (at.steady_e != nullptr) at.steady_e += lanes;
    if (at.offset_e != nullptr) at.offset_e += lanes;
  }
}

void ReadOutFloats(const draws::Row& row, const ChargePointers& charge, const ReadoutParameters& p, std::size_t count,
                   float* dn) {
  read_out(row, charge, p, count, dn);
}

void ReadOutCodes(const draws::Row& row, const ChargePointers& charge, const ReadoutParameters& p, std::size_t count,
                  std::uint16_t* dn) {
  read_out(row, charge, p, count, dn);
}

}  // namespace lowlux::capture::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace lowlux::capture {

HWY_EXPORT(ReadOutFloats);
HWY_EXPORT(ReadOutCodes);

void read_out_floats(const draws::Row& row, const ChargePointers& charge, const ReadoutParameters& parameters,
                     std::size_t count, float* dn) {
  HWY_DYNAMIC_DISPATCH(ReadOutFloats)(row, charge, parameters, count, dn);
}
void read_out_codes(const draws::Row& row, const ChargePointers& charge, const ReadoutParameters& parameters,
                    std::size_t count, std::uint16_t* dn) {
  HWY_DYNAMIC_DISPATCH(ReadOutCodes)(row, charge, parameters, count, dn);
}

}  // namespace lowlux::capture
#endif
