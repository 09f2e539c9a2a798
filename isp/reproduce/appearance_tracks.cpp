#include "isp/reproduce/appearance_tracks.h"

#include <cassert>
#include <cmath>
#include <cstddef>
#include <optional>
#include <utility>

#include <fmt/format.h>

#include "isp/model/appearance/appearance_model.h"
#include "isp/model/colour/colour_difference.h"
#include "isp/model/spectrum/cie_data.h"
#include "isp/model/vision/mesopic.h"

namespace lowlux::isp {
namespace {

constexpr int levels = 14;
constexpr double lowest_cd_m2 = 0.002, highest_cd_m2 = 1000;
constexpr Xyz equal_energy{1, 1, 1};

NodePower reflected_power(const Spectrum& reflectance) {
  NodePower out{};
  for (int i = 0; i < entropy_nodes; ++i) out[static_cast<std::size_t>(i)] = reflectance.at(entropy_wavelength_nm(i));
  return out;
}

NodePower even_power() {
  NodePower out{};
  out.fill(1);
  return out;
}

/// Returns the luminances of a power at the model's nodes, in units of the power.
LuminancePair luminance_of_nodes(const NodePower& power) {
  LuminancePair out;
  for (int i = 0; i < entropy_nodes; ++i) {
    const double nm = entropy_wavelength_nm(i), p = power[static_cast<std::size_t>(i)];
    out.photopic += luminous_efficacy_lm_w * p * cie_1931_observer()[1].at(nm);
    out.scotopic += scotopic_efficacy_lm_w * p * scotopic_observer().at(nm);
  }
  return out;
}

std::optional<Xyz> spectrum_seen(const EntropyModel& model, const NodePower& power) {
  const auto fit = entropy_fit(model, entropy_moments(model, power));
  if (!fit) return std::nullopt;
  return xyz_of(model, *fit);
}

/// Holds the model at one level, and the transform from its white to the equal-energy one.
struct SpectralEye {
  EntropyModel model;
  double m = 0;
  Matrix3 to_equal_energy = identity3();
  double white_luminance = 1;  // L_mes
};

/// Makes the model for a level. @param adaptation_cd_m2  of equal-energy light
Result<SpectralEye> spectral_eye(double adaptation_cd_m2, const EntropyOptions& options) {
  const double m = mesopic_state({adaptation_cd_m2, scotopic_ratio_of_equal_energy * adaptation_cd_m2}).m;
  auto model = entropy_model(m, even_power(), options);
  if (!model) return tl::make_unexpected(model.error());
  SpectralEye eye{.model = *std::move(model), .m = m};
  const auto white = spectrum_seen(eye.model, even_power());
  const auto xy = white ? xy_of(*white) : std::nullopt;
  const auto adaptation = xy ? bradford_adaptation(*xy, white_e) : std::nullopt;
  if (!adaptation) {
    return fail(ErrorCode::insufficient,
                fmt::format("the spectral model finds no white at {} cd/m2", adaptation_cd_m2));
  }
  eye.to_equal_energy = *adaptation;
  eye.white_luminance = mesopic_luminance_cd_m2(m, luminance_of_nodes(even_power()));
  return eye;
}

std::optional<Xyz> chip_seen(const SpectralEye& eye, const NodePower& power) {
  const auto seen = spectrum_seen(eye.model, power);
  if (!seen) return std::nullopt;
  const Vector3 adapted = eye.to_equal_energy * vector_of(*seen);
  if (!(adapted[1] > 0)) return std::nullopt;
  const double luminance = mesopic_luminance_cd_m2(eye.m, luminance_of_nodes(power)) / eye.white_luminance;
  const double scale = luminance / adapted[1];
  return Xyz{scale * adapted[0], scale * adapted[1], scale * adapted[2]};
}

}  // namespace

std::vector<double> track_levels_cd_m2() {
  std::vector<double> out(levels);
  for (std::size_t i = 0; i < out.size(); ++i) {
    out[i] = lowest_cd_m2 * std::pow(highest_cd_m2 / lowest_cd_m2, static_cast<double>(i) / (levels - 1));
  }
  return out;
}

std::vector<NamedSpectrum> track_chips() { return spectra_of(SpectrumSet::munsell_ten); }

Result<AppearanceTracks> tracks_by_colour(std::string_view model, const TrackReading& reading,
                                          const std::vector<NamedSpectrum>& chips,
                                          const std::vector<double>& levels_cd_m2) {
  const auto found = appearance_model_named(model);
  if (!found) return tl::make_unexpected(found.error());
  const Spectrum light = *light_named("E");
  AppearanceTracks out{std::string(model), std::vector<std::vector<Xyz>>(chips.size())};
  for (const double level : levels_cd_m2) {
    ViewingConditions conditions;
    conditions.white_cd_m2 = level;
    conditions.adaptation_cd_m2 = reading.adaptation_fraction * level;
    conditions.white = equal_energy;
    conditions.shin_units = reading.shin_units;
    const auto map = found->at(conditions);
    if (!map) return tl::make_unexpected(map.error());
    const double white = (*map)(equal_energy).y;
    if (!(white > 0)) return fail(ErrorCode::insufficient, fmt::format("{} finds no white at {} cd/m2", model, level));
    for (std::size_t chip = 0; chip < chips.size(); ++chip) {
      const auto colour = xyz_of_reflectance(chips[chip].spectrum, light);
      assert(colour);  // the equal-energy light has luminance
      const Xyz seen = (*map)(*colour);
      out.seen[chip].push_back({seen.x / white, seen.y / white, seen.z / white});
    }
  }
  return out;
}

Result<AppearanceTracks> tracks_by_spectrum(std::string name, const TrackReading& reading,
                                            std::optional<double> gamma_fixed, const std::vector<NamedSpectrum>& chips,
                                            const std::vector<double>& levels_cd_m2) {
  AppearanceTracks out{std::move(name), std::vector<std::vector<Xyz>>(chips.size())};
  EntropyOptions options;
  options.variant = reading.variant;
  options.gamma_fixed = gamma_fixed;
  for (const double level : levels_cd_m2) {
    const auto eye = spectral_eye(reading.adaptation_fraction * level, options);
    if (!eye) return tl::make_unexpected(eye.error());
    for (std::size_t chip = 0; chip < chips.size(); ++chip) {
      const auto seen = chip_seen(*eye, reflected_power(chips[chip].spectrum));
      if (!seen) {
        return fail(ErrorCode::insufficient,
                    fmt::format("the spectral model finds no spectrum for {} at {} cd/m2", chips[chip].name, level));
      }
      out.seen[chip].push_back(*seen);
    }
  }
  return out;
}

Lab lab_of_track(const Xyz& seen) { return lab_of(seen, equal_energy); }

namespace {

template <class Difference>
double mean_over_levels(const AppearanceTracks& first, const AppearanceTracks& second, std::size_t chip,
                        const Difference& difference) {
  const auto &a = first.seen[chip], &b = second.seen[chip];
  assert(a.size() == b.size() && !a.empty());
  double sum = 0;
  for (std::size_t i = 0; i < a.size(); ++i) sum += difference(lab_of_track(a[i]), lab_of_track(b[i]));
  return sum / static_cast<double>(a.size());
}

}  // namespace

double mean_mutual_delta_e(const AppearanceTracks& first, const AppearanceTracks& second, std::size_t chip) {
  return mean_over_levels(first, second, chip, delta_e_ab);
}

double mean_chromatic_difference(const AppearanceTracks& first, const AppearanceTracks& second, std::size_t chip) {
  return mean_over_levels(first, second, chip,
                          [](const Lab& a, const Lab& b) { return std::hypot(a.a - b.a, a.b - b.b); });
}

}  // namespace lowlux::isp
