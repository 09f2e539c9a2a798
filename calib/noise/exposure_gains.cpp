#include "calib/noise/exposure_gains.h"

#include <cmath>
#include <limits>

#include "calib/noise/sensor_class.h"
#include "calib/profile/gain_interpolation.h"
#include "isp/base/frame.h"

namespace lowlux::calib {
namespace {

constexpr double iso_of_unit_gain = 100;

isp::GainStep step_of_class(double factor, double white_dn) {
  RawDn raw;
  raw.white_dn.fill(white_dn);
  raw.info.iso = iso_of_unit_gain * factor;
  const NoiseFigures figures = class_noise(raw, white_dn).figures;
  isp::GainStep out{.factor = factor, .sensor = {}};
  out.sensor.system_gain_dn_per_e = figures.gain_dn_per_e;
  out.sensor.read_noise_e = figures.read_noise_e;
  return out;
}

/// Returns a setting of a profile, in codes of the stream.
isp::GainStep step_of_profile(double factor, const GainProfile& gain, int bits) {
  isp::GainStep out{.factor = factor, .sensor = {}};
  out.sensor.system_gain_dn_per_e = gain.sensor->system_gain_dn_per_e * std::exp2(bits - gain.sensor->bits);
  out.sensor.read_noise_e = gain.sensor->read_noise_e;
  out.sensor.dark_current_e_per_s = gain.sensor->dark_current_e_per_s;
  out.sensor.dark_temperature_c = gain.sensor->dark_temperature_c;
  // Darks that state no temperature hold at every temperature.
  const bool temperature_unknown = gain.dark_exposure_s && !gain.dark_temperature_c;
  out.sensor.dark_doubling_c =
      temperature_unknown ? std::numeric_limits<double>::infinity() : gain.sensor->dark_doubling_c;
  return out;
}

}  // namespace

Result<std::vector<isp::GainStep>> exposure_gains(std::span<const double> factors, const RawFormat& format,
                                                  double white_dn, const CameraProfile* profile) {
  std::vector<isp::GainStep> out;
  out.reserve(factors.size());
  const bool has_gains = profile != nullptr && !profile->gains.empty();
  for (const double factor : factors) {
    if (!has_gains) {
      out.push_back(step_of_class(factor, white_dn));
      continue;
    }
    const auto found = gain_at_iso(*profile, iso_of_unit_gain * factor);
    if (!found) return tl::make_unexpected(found.error());
    out.push_back(found->gain.sensor ? step_of_profile(factor, found->gain, format.bits)
                                     : step_of_class(factor, white_dn));
  }
  for (isp::GainStep& step : out) {
    step.sensor.bits = format.bits;
    step.sensor.white_level_dn = white_dn;
    step.sensor.full_well_e = white_dn / out.front().sensor.system_gain_dn_per_e;
  }
  return out;
}

}  // namespace lowlux::calib
