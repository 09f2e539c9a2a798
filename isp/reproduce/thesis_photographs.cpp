#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>
#include <span>
#include <vector>

#include "capture/synthetic/readout.h"
#include "isp/reproduce/sampled_light.h"
#include "isp/reproduce/thesis_sensor.h"

namespace lowlux::isp {
namespace {

using Row = std::vector<float>;

capture::ReadoutParameters readout_of(const SensorModel& sensor, const Noises& noises) {
  capture::ReadoutParameters out;
  if (noises.converter) out.full_well_e = static_cast<float>(sensor.full_well_e);
  if (noises.read) out.read_noise_e = static_cast<float>(sensor.read_noise_e);
  out.gain_dn_per_e = static_cast<float>(sensor.system_gain_dn_per_e);
  out.black_dn = static_cast<float>(sensor.black_level_dn);
  out.max_dn = static_cast<float>(sensor.white_level_dn);
  out.quantisation = noises.quantisation;
  out.quantise = noises.converter;
  out.clip = noises.converter;
  return out;
}

// Samples as published: photons on the pixel are drawn for each wavelength; each counts Qe electrons in each channel.
std::array<Row, 3> weighted_photons(const ThesisCamera& camera, const Patch& patch, double level,
                                    const PatchPlace& place, int samples) {
  const auto photons = photon_radiance(patch.radiance);
  assert(photons && "patches are lights");
  const std::vector<double> widths = bin_widths_nm(patch.radiance);
  PhotonMeans means{{patch.radiance.wavelengths_nm().begin(), patch.radiance.wavelengths_nm().end()}, widths, {}};
  for (std::size_t i = 0; i < widths.size(); ++i) {
    means.photons.push_back(level * camera.exposure_s * camera.response.etendue_m2_sr * photons->values()[i] *
                            widths[i]);
  }
  std::array<Row, 3> out;
  for (std::uint32_t sample = 0; sample < static_cast<std::uint32_t>(samples); ++sample) {
    const auto counts = draw_photons(means, {place.seed, place.frame, place.patch, sample});
    for (int k = 0; k < 3; ++k) {
      double electrons = 0;
      for (std::size_t i = 0; i < counts.size(); ++i) {
        electrons += counts[i] * camera.response.quantum_efficiency[k].at(means.wavelengths_nm[i]);
      }
      out[k].push_back(static_cast<float>(electrons));
    }
  }
  return out;
}

/// Returns the smallest code of a full pixel: five deviations of read noise below the full well. The code alone cannot
/// distinguish a full pixel from one that is nearly full, so the latter are discarded too.
double saturation_dn(const SensorModel& sensor) {
  const double full_e = sensor.full_well_e - 5 * sensor.read_noise_e;
  return std::min(std::floor(sensor.black_level_dn + sensor.system_gain_dn_per_e * full_e), sensor.white_level_dn);
}

}  // namespace

PatchSamples photograph(const ThesisCamera& camera, const Patch& patch, double level, const Noises& noises,
                        const PatchPlace& place, int samples) {
  const bool published = noises.sampling == capture::PhotonSampling::published;
  const Vector3 dark_e = noises.dark ? dark_charge_e(camera) : Vector3{};
  const capture::ReadoutParameters readout = readout_of(camera.sensor, noises);
  std::array<Row, 3> steady;
  std::array<std::vector<double>, 3> dn;
  if (published) steady = weighted_photons(camera, patch, level, place, samples);
  for (std::uint32_t k = 0; k < 3; ++k) {
    const double mean_e = dark_e[k] + (published ? 0 : level * patch.signal_e[k]);
    const DrawStream stream{place.seed, place.frame, draw_purpose::electrons};
    const std::uint32_t row = 3 * place.patch + k;
    if (mean_e > poisson_max_mean) {
      assert(!noises.read && !noises.converter && "a charge beyond any full well");
      for (std::uint32_t i = 0; i < static_cast<std::uint32_t>(samples); ++i) {
        dn[k].push_back(camera.sensor.system_gain_dn_per_e * poisson_count(stream, i, row, mean_e));
      }
      continue;
    }
    const Row means(static_cast<std::size_t>(samples), static_cast<float>(mean_e));
    Row codes(means.size());
    capture::read_out_row(stream, 0, row, {means, steady[k], {}}, readout, std::span<float>(codes));
    dn[k].assign(codes.begin(), codes.end());
  }
  PatchSamples out;
  for (int i = 0; i < samples; ++i) {
    const Vector3 code{dn[0][i], dn[1][i], dn[2][i]};
    if (noises.converter && std::ranges::max(code) >= saturation_dn(camera.sensor)) {
      ++out.saturated;
    } else {
      out.dn.push_back(code);
    }
  }
  for (Vector3& code : out.dn) {
    for (double& channel : code) channel -= camera.sensor.black_level_dn;
  }
  return out;
}

}  // namespace lowlux::isp
