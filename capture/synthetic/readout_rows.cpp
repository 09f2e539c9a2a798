#include "capture/synthetic/readout_rows.h"

#include "capture/synthetic/readout.h"

#if defined(__aarch64__)  // NEON only: the vectors of SVE have no fixed size and cannot be members of structs
#define HWY_DISABLED_TARGETS (HWY_SVE | HWY_SVE2 | HWY_SVE_256 | HWY_SVE2_128)
#endif
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "capture/synthetic/readout_rows.cpp"
#include <hwy/foreach_target.h>  // compiles this file once more for each instruction set
#include <hwy/highway.h>

#include "isp/base/random/random-inl.h"

HWY_BEFORE_NAMESPACE();
namespace lowlux::capture::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;
using namespace draws::HWY_NAMESPACE;

/// Returns the electrons of the vector of pixels at index i, read noise and offset included.
HWY_INLINE VF electrons(VU r, VF z, const ChargePointers& at, const ReadoutParameters& p, std::size_t i,
                        std::size_t left) {
  const Floats f;
  VF n = load(f, at.mean_e + i, left);
  if (p.photon_noise) n = poisson_of(r, n);
  if (at.steady_e != nullptr) n = hn::Add(n, load(f, at.steady_e + i, left));
  const VF full = constant(p.full_well_e);
  VF e = hn::IfThenElse(hn::Gt(n, full), full, n);  // not Min, which differs between processors at NaN
  if (p.read_noise_e != 0) e = hn::Add(e, hn::Mul(constant(p.read_noise_e), z));
  if (at.offset_e != nullptr) e = hn::Add(e, load(f, at.offset_e + i, left));
  return e;
}

HWY_INLINE VF dn_of(VF e, const ReadoutParameters& p) {
  VF v = hn::Add(constant(p.black_dn), hn::Mul(constant(p.gain_dn_per_e), e));
  if (p.quantise) v = p.quantisation == Quantisation::floor ? hn::Floor(v) : hn::Round(v);
  if (p.clip) return hn::Min(hn::IfThenElseZero(hn::Gt(v, constant(0)), v), constant(p.max_dn));
  return hn::Add(v, constant(0));  // makes the zero unsigned: its sign after rounding depends on the processor
}

HWY_INLINE void put(VF v, float* to, std::size_t left) { store(Floats(), v, to, left); }

HWY_INLINE void put(VF v, std::uint16_t* to, std::size_t left) {
  const hn::Rebind<std::uint16_t, Floats> u16;
  store(u16, hn::DemoteTo(u16, hn::ConvertTo(Ints(), v)), to, left);
}

template <class T>
HWY_INLINE void read_out(const draws::Row& from, const ChargePointers& from_charge, const ReadoutParameters& parameters,
                         std::size_t count, T* dn) {
  const draws::Row row = from;  // copied, so that no store can change it
  const ReadoutParameters p = parameters;
  const ChargePointers charge = from_charge;
  const std::size_t lanes = hn::Lanes(Words());
  const bool any_draw = p.photon_noise || p.read_noise_e != 0;
  HWY_ALIGN std::uint32_t words[2][block_pixels] = {};
  HWY_ALIGN float normals[block_pixels] = {};
  for (std::size_t first = 0; first < count; first += block_pixels) {
    const std::size_t size = HWY_MIN(count - first, block_pixels);
    if (any_draw) put_block<0, 2>(row, first, size, words);
    if (p.read_noise_e != 0) {
      for (std::size_t i = 0; i < size; i += lanes) {
        hn::Store(normal_of(hn::Load(Words(), words[1] + i)), Floats(), normals + i);
      }
    }
    for (std::size_t i = 0; i < size; i += lanes) {
      const std::size_t at = first + i, left = count - at;
      const VF e = electrons(hn::Load(Words(), words[0] + i), hn::Load(Floats(), normals + i), charge, p, at, left);
      put(dn_of(e, p), dn + at, left);
    }
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
