#include "isp/reproduce/thesis_sensor.h"

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>
#include <limits>
#include <numbers>
#include <span>
#include <utility>
#include <vector>

#include "capture/synthetic/readout.h"
#include "isp/model/colour/camera_matrix.h"
#include "isp/model/sensor/photon.h"
#include "isp/model/sensor/sensor_db.h"
#include "isp/model/spectrum/cie_data.h"
#include "isp/model/spectrum/spectral_data.h"
#include "isp/model/spectrum/spectral_response.h"
#include "isp/reproduce/sampled_light.h"

namespace lowlux::isp {
namespace {

// Returns codes per radiance and nanometre, called C in Eq. 4.14.
std::array<Spectrum, 3> energy_response(const ThesisCamera& camera) {
  std::array<Spectrum, 3> out = camera.response.quantum_efficiency;
  const double dn_per_photon = camera.exposure_s * camera.response.etendue_m2_sr * camera.sensor.system_gain_dn_per_e;
  for (Spectrum& channel : out) {
    channel =
        channel.mapped([&](double nm, double efficiency) { return efficiency * dn_per_photon / photon_energy_j(nm); });
  }
  return out;
}

double squared_distance(const Xy& a, const Xy& b) { return (a.x - b.x) * (a.x - b.x) + (a.y - b.y) * (a.y - b.y); }

std::vector<Patch> all_patches(const ThesisCamera& camera) {
  std::vector<Patch> out;
  for (const NamedSpectrum& lamp : spectra_of(SpectrumSet::laboratory_lamps)) {
    for (const NamedSpectrum& chip : spectra_of(SpectrumSet::macbeth)) {
      const auto radiance = at_full_level(reflected(lamp.spectrum, chip.spectrum));
      const auto xy = radiance ? xy_of(xyz_of(*radiance)) : std::nullopt;
      if (!xy) continue;
      const std::string name = std::string(chip.name) + " under " + std::string(lamp.name);
      out.push_back({name, *radiance, *xy, signal_charge_e(camera, *radiance)});
    }
  }
  return out;
}

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

std::optional<Spectrum> at_full_level(const Spectrum& light) {
  return radiance_of(light, thesis_white_luminance_cd_m2);
}

Vector3 signal_charge_e(const ThesisCamera& camera, const Spectrum& radiance) {
  Vector3 out = electron_rate(camera.response, radiance);
  for (double& charge : out) charge *= camera.exposure_s;
  return out;
}

Result<ThesisCamera> thesis_camera() {
  SensorFigures figures;
  figures.peak_quantum_efficiency = 1;
  const auto sensor = sensor_named(thesis_sensor, {}, figures);
  if (!sensor) return tl::make_unexpected(sensor.error());
  auto response = spectral_response(*sensor, {});
  if (!response) return tl::make_unexpected(response.error());
  ThesisCamera out{sensor->model, *std::move(response), 1, {}, 0};
  const auto matrix = spectral_matrix(energy_response(out));
  if (!matrix) return tl::make_unexpected(matrix.error());
  out.dn_to_xyz = luminous_efficacy_lm_w * matrix->camera_to_xyz;
  out.condition_number = matrix->condition_number;
  return out;
}

Result<std::vector<Patch>> thesis_patches(const ThesisCamera& camera, int count) {
  std::vector<Patch> left = all_patches(camera);
  if (count < 1 || static_cast<std::size_t>(count) > left.size()) {
    return fail(ErrorCode::invalid_argument, "there are " + std::to_string(left.size()) + " patches to choose from, " +
                                                 std::to_string(count) + " were asked for");
  }
  std::vector<double> distance;
  distance.reserve(left.size());
  for (const Patch& patch : left) distance.push_back(squared_distance(patch.xy, white_e));
  std::vector<Patch> chosen;
  while (std::ssize(chosen) < count) {
    const auto farthest = std::ranges::max_element(distance) - distance.begin();
    chosen.push_back(left[farthest]);
    for (std::size_t i = 0; i < left.size(); ++i) {
      const double to_new = squared_distance(left[i].xy, chosen.back().xy);
      distance[i] = chosen.size() == 1 ? to_new : std::min(distance[i], to_new);
    }
  }
  return chosen;
}

Vector3 dark_charge_e(const ThesisCamera& camera) {
  Vector3 out = camera.sensor.dark_current_e_per_s;
  for (double& charge : out) charge *= camera.exposure_s;
  return out;
}

Xyz xyz_of_charge(const ThesisCamera& camera, const Vector3& charge) {
  return xyz_of(camera.sensor.system_gain_dn_per_e * camera.dn_to_xyz * charge);
}

std::optional<ChromaticityCloud> sensor_cloud(const ThesisCamera& camera, const Vector3& mean_e,
                                              const Vector3& variance_e2) {
  const Matrix3 m = camera.sensor.system_gain_dn_per_e * camera.dn_to_xyz;
  return propagated_cloud(xyz_of(m * mean_e), m * diagonal3(variance_e2) * transposed(m));
}

std::vector<Xy> chromaticities(const ThesisCamera& camera, const std::vector<Vector3>& dn) {
  std::vector<Xy> out;
  for (const Vector3& code : dn) {
    if (const auto xy = xy_of(xyz_of(camera.dn_to_xyz * code))) out.push_back(*xy);
  }
  return out;
}

std::optional<Vector3> mean_code(const std::vector<Vector3>& dn) {
  if (dn.empty()) return std::nullopt;
  Vector3 sum{};
  for (const Vector3& code : dn) {
    for (int k = 0; k < 3; ++k) sum[k] += code[k] / static_cast<double>(dn.size());
  }
  return sum;
}

double noticeable_differences(const Xy& from, const Xy& to) {
  constexpr double deviations = 3;
  constexpr double unit = 1e-3;  // unit of the table's axes
  const CieTable table = macadam1942_table();
  double nearest = std::numeric_limits<double>::infinity(), out = 0;
  for (std::size_t i = 0; i < table.cells.size(); i += table.columns.size()) {
    const auto row = table.cells.subspan(i, table.columns.size());
    const double distance = squared_distance({row[0], row[1]}, from);
    if (distance >= nearest) continue;
    nearest = distance;
    const double angle = row[4] * std::numbers::pi / 180;
    const double dx = to.x - from.x, dy = to.y - from.y;
    const double along = (dx * std::cos(angle) + dy * std::sin(angle)) / (unit * row[2]);
    const double across = (dy * std::cos(angle) - dx * std::sin(angle)) / (unit * row[3]);
    out = std::hypot(along, across) / deviations;
  }
  return out;
}

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
