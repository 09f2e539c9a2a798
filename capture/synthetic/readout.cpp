#include "capture/synthetic/readout.h"

#include <cassert>
#include <cmath>

#include "capture/synthetic/readout_rows.h"

namespace lowlux::capture {
namespace {

[[maybe_unused]] bool fit(const RowCharge& charge, const ReadoutParameters& p, std::size_t count) {
  const auto absent_or_whole = [count](std::span<const float> s) { return s.empty() || s.size() == count; };
  return charge.mean_e.size() == count && absent_or_whole(charge.steady_e) && absent_or_whole(charge.offset_e) &&
         p.full_well_e >= 0 && p.read_noise_e >= 0 && p.read_noise_e <= 1e6f && std::isfinite(p.gain_dn_per_e) &&
         std::isfinite(p.black_dn) && p.max_dn >= 0 && p.max_dn == std::floor(p.max_dn);
}

ChargePointers pointers(const RowCharge& charge) {
  const auto or_null = [](std::span<const float> s) { return s.empty() ? nullptr : s.data(); };
  return {charge.mean_e.data(), or_null(charge.steady_e), or_null(charge.offset_e)};
}

}  // namespace

void read_out_row(const DrawStream& stream, std::uint32_t x0, std::uint32_t y, const RowCharge& charge,
                  const ReadoutParameters& parameters, std::span<float> dn) {
  assert(fit(charge, parameters, dn.size()));
  read_out_floats(draws::row_of(stream, x0, y), pointers(charge), parameters, dn.size(), dn.data());
}

void read_out_row(const DrawStream& stream, std::uint32_t x0, std::uint32_t y, const RowCharge& charge,
                  const ReadoutParameters& parameters, std::span<std::uint16_t> dn) {
  assert(fit(charge, parameters, dn.size()) && parameters.quantise && parameters.clip && parameters.max_dn <= 65535);
  read_out_codes(draws::row_of(stream, x0, y), pointers(charge), parameters, dn.size(), dn.data());
}

}  // namespace lowlux::capture
