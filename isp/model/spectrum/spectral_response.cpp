#include "isp/model/spectrum/spectral_response.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <utility>
#include <vector>

#include "isp/base/text.h"
#include "isp/model/sensor/noise_budget.h"
#include "isp/model/sensor/photon.h"
#include "isp/model/spectrum/cie_data.h"
#include "isp/model/spectrum/spectral_data.h"

namespace lowlux::isp {
namespace {

/// Returns the quantum efficiency of R, G, B up to a factor: response per joule divided by photons per joule, largest
/// value 1.
Result<std::array<Spectrum, 3>> relative_quantum_efficiency(const std::string& camera) {
  auto sensitivity = camera_sensitivity(camera);
  if (!sensitivity) {
    const auto names = camera_names();
    std::string near;
    for (const std::string_view name : near_matches(camera, names))
      near += (near.empty() ? "" : ", ") + std::string(name);
    return fail(ErrorCode::invalid_argument, "there are no spectral sensitivities of a '" + camera + "'" +
                                                 (near.empty() ? "; --list names them" : "; near it: " + near));
  }
  double peak = 0;
  for (Spectrum& channel : *sensitivity) {
    channel = channel.mapped([](double nm, double value) { return value / nm; });
    peak = std::max(peak, std::ranges::max(channel.values()));
  }
  for (Spectrum& channel : *sensitivity) {
    channel = channel.mapped([&](double, double value) { return value / peak; });
  }
  return *std::move(sensitivity);
}

/// Returns the etendue at which a white of this luminance under D65 gives `charge_e` to the most sensitive channel in 1
/// s.
double etendue_for(const SpectralResponse& response, double luminance_cd_m2, double charge_e) {
  SpectralResponse unit = response;
  unit.etendue_m2_sr = 1;
  const Vector3 rate = electron_rate(unit, *radiance_of(*light_named("D65"), luminance_cd_m2));
  return charge_e / *std::max_element(rate.begin(), rate.end());
}

/// Checks the figures whether used or not: an invalid value is an error even where it has no effect.
Result<void> check_figures(const NamedSensor& sensor, const Optics& optics) {
  const auto wrong = [](const char* what) { return fail(ErrorCode::invalid_argument, what); };
  if (!(optics.f_number >= 0.5) || !(optics.f_number <= 1000)) {
    return wrong("the f-number must lie between 0.5 and 1000");
  }
  if (const auto peak = sensor.peak_quantum_efficiency; peak && (!(*peak > 0) || !(*peak <= 1))) {
    return wrong("a peak quantum efficiency lies above 0 and at most at 1");
  }
  if (const auto pitch = sensor.pixel_pitch_um; pitch && (!(*pitch > 0) || !(*pitch <= 1000))) {
    return wrong("a pixel pitch lies above 0 and at most at 1000 um");
  }
  if (const auto iso = sensor.iso; iso && (!(*iso >= 1e-3) || !(*iso <= 1e9))) {
    return wrong("an ISO speed lies between 0.001 and 1e9");
  }
  if (const auto white = optics.white_luminance_cd_m2; white && (!(*white > 0) || !(*white <= 1e12))) {
    return wrong("the luminance that reaches full well must lie above 0 and below 1e12 cd/m2");
  }
  return {};
}

tl::unexpected<Error> no_scale(const NamedSensor& sensor) {
  std::string missing = sensor.pixel_pitch_um ? "" : "--pixel-pitch";
  if (!sensor.peak_quantum_efficiency) missing += missing.empty() ? "--peak-qe" : " and --peak-qe";
  return fail(ErrorCode::insufficient,
              "no source states how much light the sensor " + sensor.model.name + " needs; give " + missing +
                  ", or --iso, or --white-luminance (the luminance that reaches full well in 1 s)");
}

}  // namespace

Result<SpectralResponse> spectral_response(const NamedSensor& sensor, const Optics& optics) {
  if (const auto good = check_figures(sensor, optics); !good) return tl::make_unexpected(good.error());
  auto efficiency = relative_quantum_efficiency(sensor.camera);
  if (!efficiency) return tl::make_unexpected(efficiency.error());
  const double peak = sensor.peak_quantum_efficiency.value_or(assumed_peak_quantum_efficiency);
  for (Spectrum& channel : *efficiency) channel = channel.mapped([&](double, double value) { return peak * value; });
  SpectralResponse out{sensor.model.name + " through the filters of " + sensor.camera, *std::move(efficiency), 0};

  const SensorModel& published = sensor.published ? *sensor.published : sensor.model;
  const bool lens = sensor.pixel_pitch_um && sensor.peak_quantum_efficiency;
  const double n2 = optics.f_number * optics.f_number;
  if (optics.white_luminance_cd_m2) {
    out.etendue_m2_sr = etendue_for(out, *optics.white_luminance_cd_m2, sensor.model.full_well_e);
  } else if (sensor.iso && (sensor.iso_given || !lens)) {
    const double charge_e = saturation_charge_e(sensor.iso_given ? sensor.model : published);
    out.etendue_m2_sr = etendue_for(out, 78 * n2 / (0.65 * *sensor.iso), charge_e);
  } else if (lens) {
    const double pitch_m = *sensor.pixel_pitch_um * 1e-6;
    out.etendue_m2_sr = pitch_m * pitch_m * std::numbers::pi / (4 * n2);
  } else if (sensor.model.name == thesis_sensor) {
    out.etendue_m2_sr = etendue_for(out, thesis_white_luminance_cd_m2, published.full_well_e);
  } else {
    return no_scale(sensor);
  }
  return out;
}

Vector3 electron_rate(const SpectralResponse& response, const Spectrum& radiance) {
  Vector3 rate{};
  for (int k = 0; k < 3; ++k) {
    rate[k] = response.etendue_m2_sr * integrate(radiance, [&](double nm) {
                return response.quantum_efficiency[k].at(nm) / photon_energy_j(nm);
              });
  }
  return rate;
}

std::optional<Spectrum> radiance_of(const Spectrum& light, double luminance_cd_m2) {
  const double y = luminous_efficacy_lm_w * xyz_of(light).y;
  if (!(y > 0) || !std::isfinite(y)) return std::nullopt;
  // The value is divided first: the scale of a light is arbitrary.
  const auto scaled = [&](double value) { return value / y * luminance_cd_m2; };
  if (!std::ranges::all_of(light.values(), [&](double value) { return std::isfinite(scaled(value)); })) {
    return std::nullopt;
  }
  return light.mapped([&](double, double value) { return scaled(value); });
}

double saturation_luminance_cd_m2(const SensorModel& sensor, const SpectralResponse& response, double time_s) {
  const Vector3 rate = electron_rate(response, *radiance_of(*light_named("D65"), 1));
  return saturation_charge_e(sensor) / (time_s * *std::max_element(rate.begin(), rate.end()));
}

}  // namespace lowlux::isp
