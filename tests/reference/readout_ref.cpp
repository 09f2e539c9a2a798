#include "tests/reference/readout_ref.h"

#include <algorithm>
#include <cmath>

#include "tests/reference/poisson_ref.h"

namespace lowlux::reference {

PixelReadout read_out(const PhiloxWords& words, const PixelCharge& charge, const capture::ReadoutParameters& p) {
  const double drawn = p.photon_noise ? poisson_count(words[0], std::max(0.0f, charge.mean_e)) : charge.mean_e;
  const double n = std::min(drawn + charge.steady_e, static_cast<double>(p.full_well_e));
  const double read_e = p.read_noise_e * normal_deviate(words[1]);
  PixelReadout out{};
  out.dn = p.black_dn + p.gain_dn_per_e * (n + read_e + charge.offset_e);
  // Each of the five operations rounds what it gives by 2^-24; none gives more than the sum of all magnitudes. The
  // deviate is good to 1e-6.
  const double magnitude =
      std::abs(p.black_dn) + std::abs(p.gain_dn_per_e) * (std::abs(drawn) + std::abs(charge.steady_e) +
                                                          std::abs(read_e) + std::abs(charge.offset_e));
  out.float_dn = 6 * 0x1p-24 * magnitude + 1e-6 * std::abs(p.gain_dn_per_e * read_e);
  out.result_dn = out.dn;
  if (p.quantise) {
    out.result_dn = p.quantisation == Quantisation::floor ? std::floor(out.dn) : std::nearbyint(out.dn);
  }
  if (p.clip) out.result_dn = std::clamp(out.result_dn, 0.0, static_cast<double>(p.max_dn));
  return out;
}

}  // namespace lowlux::reference
