#pragma once

#include <cmath>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "isp/reproduce/thesis_sensor.h"

namespace lowlux::isp {

/// These are the levels F of the thesis' scenarios II and III; F = 1 is 100 cd/m2.
inline constexpr double sensor_levels[] = {1, 0.5, 0.1, 0.05, 0.01, 0.005, 0.001};
/// These are the levels F of the thesis' scenario I.
inline constexpr double photon_levels[] = {1, 1e-7, 1e-8, 1e-9, 1e-10, 1e-11, 1e-12, 1e-13, 1e-14};
inline constexpr double cd_m2_per_level = 100;

/// Expected and sampled chromaticities of one patch at one level.
struct PatchResult {
  Xy truth;                                  // chromaticity of the signal alone, by the camera's matrix
  ChromaticityCloud expected;                // cloud of signal and dark together, first order; noises independent
  std::vector<Xy> xy;                        // chromaticities of the unsaturated samples that have one
  std::optional<ChromaticityCloud> sampled;  // cloud of xy
  std::optional<Xy> mean_code_xy;            // chromaticity of the mean of unsaturated codes
  std::optional<Xy> undone_xy;               // mean_code_xy with the mean dark subtracted first
  double delta_e_ab = 0;                     // mean_delta_e_ab() of the unsaturated samples from the signal alone
  int codes = 0;                             // number of different codes among the unsaturated samples
  int unsaturated = 0;
  int saturated = 0;
};

/// Holds the results of all patches at one level of light.
struct LevelResult {
  double level = 0;
  std::vector<PatchResult> patches;
};

/// Describes a scenario: the noise sources that are on.
struct Scenario {
  Noises noises;
  std::uint32_t frame = 0;  // first frame of its random numbers; each level takes one
  int samples = 0;
  std::span<const double> levels = sensor_levels;
  double light_factor = 1;  // factor of the light that a pixel collects, against the camera's own etendue
};

/// Scenarios of the thesis' chapter 4.
struct SensorScenarios {
  std::vector<LevelResult> published;  // I as published: photon noise alone, scenario I's levels, 1 m2 sr
  std::vector<LevelResult> photons;    // I with the pixel's own etendue, at sensor_levels
  std::vector<LevelResult> dark;       // II: with dark current
  std::vector<LevelResult> all;        // III: all noises, codes rounded down (Eq. 4.10)
  std::vector<LevelResult> nearest;    // III with codes rounded to the nearest
};

/// Returns the mean of Delta E ab between samples and the truth (thesis section 4.5.2). Sample and truth are scaled to
/// the luminance of the reference white, D65, so that colour alone counts; samples without luminance have none and are
/// left out. It is not a number if all are.
/// @param truth  Y > 0
/// @param dn     codes without pedestal
double mean_delta_e_ab(const ThesisCamera& camera, const Xyz& truth, const std::vector<Vector3>& dn);

/// Runs all levels of a scenario. Errors: an expectation has no chromaticity.
Result<std::vector<LevelResult>> run_scenario(const ThesisCamera& camera, const std::vector<Patch>& patches,
                                              const Scenario& scenario, std::uint64_t seed);

/// Returns the largest distance of a mean code's chromaticity from its expectation in standard errors, over all levels
/// and patches without saturation.
double worst_mean_error(const std::vector<LevelResult>& levels);

/// Returns the mean of a quantity over the patches.
template <class Quantity>
double mean_over(const LevelResult& level, const Quantity& quantity) {
  double sum = 0;
  for (const PatchResult& patch : level.patches) sum += quantity(patch);
  return sum / static_cast<double>(level.patches.size());
}

inline double distance(const Xy& a, const Xy& b) { return std::hypot(a.x - b.x, a.y - b.y); }

}  // namespace lowlux::isp
