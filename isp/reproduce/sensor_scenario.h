#pragma once

#include <cmath>
#include <cstdint>
#include <optional>
#include <vector>

#include "isp/reproduce/thesis_sensor.h"

namespace lowlux::isp {

/// These are the levels F of the thesis' chapter 4; F = 1 is 100 cd/m2.
inline constexpr double sensor_levels[] = {1, 0.5, 0.1, 0.05, 0.01, 0.005, 0.001};

/// Expected and sampled chromaticities of one patch at one level.
struct PatchResult {
  Xy truth;                                  // chromaticity of the signal alone, by the camera's matrix
  ChromaticityCloud expected;                // cloud of signal and dark together, first order; noises independent
  std::vector<Xy> xy;                        // chromaticities of the unsaturated samples that have one
  std::optional<ChromaticityCloud> sampled;  // cloud of xy
  std::optional<Xy> mean_code_xy;            // chromaticity of the mean of unsaturated codes
  std::optional<Xy> undone_xy;               // mean_code_xy with the mean dark subtracted first
  int unsaturated = 0;
  int saturated = 0;
};

struct LevelResult {
  double level = 0;
  std::vector<PatchResult> patches;
};

struct Scenario {
  Noises noises;
  std::uint32_t frame = 0;  // first frame of its random numbers; each level takes one
  int samples = 0;
};

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
