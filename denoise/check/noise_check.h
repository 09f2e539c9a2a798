#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "denoise/denoise_options.h"
#include "isp/base/executor.h"

/// Checks whether a raw has the noise that its model states. Denoising with a wrong model leaves noise or removes
/// detail, so this check comes first.
namespace lowlux::denoise {

/// Results over non-overlapping windows of 9 x 9 cells (2x2 sites) and over all sites.
struct NoiseCheck {
  /// Ratio, on each pyramid level (2x2 means of each colour, finest first), of the variance of the diagonal Haar detail
  /// to that of the model, r (max(mean of a block of 8 x 8, 0.3 dark + 0.02) + variance). It is the mean over the tenth
  /// of the blocks, at least 8, whose horizontal and vertical details are smallest against the model. In white noise
  /// these are independent of the diagonal ones, so that the selection does not bias the mean: it is 1 if the model
  /// holds; texture raises it. The excess fourth moment of few electrons correlates the three details of one place: 2 %
  /// too low at 0.5 e-^2. Absent where there are fewer than 8 blocks without saturated sites.
  std::array<std::optional<double>, max_levels> measured_over_model;
  /// Ratio as in measured_over_model, but of horizontal and vertical details, on the tenth of the blocks with the
  /// smallest diagonal ones. It is nearer to the mean of a level where noise is not white: averaged data has least
  /// noise in its diagonals.
  std::array<std::optional<double>, max_levels> across_over_model;
  /// Fraction of windows whose mean signal (dark subtracted) is below 0 by more than 4 standard deviations; R, G, B.
  /// The standard deviation is the larger of the model's and the window's own.
  std::array<double, 3> fraction_negative{};
  double fraction_without_signal = 0;  // fraction of windows with no colour above 0 by more than 4 standard deviations
  double fraction_saturated = 0;       // fraction of sites
  long windows = 0;                    // without saturated sites; 0: the three fractions of windows are 0
};

/// Measures a frame of at least 2 x 2 sites. NaN sites exclude their blocks and windows; values beyond +-1e9 count as
/// +-1e9. Takes up to 1/4 byte for each site.
NoiseCheck check_noise(const RawElectronsView& raw, const RawNoise& noise, Executor& executor);

/// Below this ratio, the measured noise of a level replaces that of the model.
inline constexpr double min_ratio = 0.7;
/// If the ratio is above this on all levels, the gain is suspected to be wrong.
inline constexpr double largest_ratio = 1.5;

/// Returns DenoiseOptions::variance_scale. The noise of a level is as measured, the larger of the two ratios, at its
/// upper end of frequency; at its lower end it is that of the next level, at most 1, or its own if that is larger. The
/// scale is the mean of both, at least 0.01, where that is below min_ratio; else 1, also where nothing was measured.
std::array<double, max_levels> variance_scale_of(const NoiseCheck& check);

/// Lists the contradictions between a frame and its noise model.
enum class NoiseFinding : std::uint8_t {
  black_suspicious,   // more than 1 % of the windows of a colour are below 0
  noise_below_model,  // on some level, below min_ratio: denoised or compressed before, or the gain is too low
  noise_above_model,  // on all levels, above largest_ratio: the gain is wrong
  all_dark,           // more than 99.9 % of windows have no signal
  all_saturated,      // more than 99 % of sites are saturated
};

/// Holds a contradiction between a frame and its noise model, with a text for the user.
struct NoiseRemark {
  NoiseFinding finding;
  std::string text;  // cause and suggestion, to follow "the raw: " or a similar prefix
};

/// Returns the problems found, in the order of NoiseFinding; usually none.
std::vector<NoiseRemark> remarks_on(const NoiseCheck& check);

}  // namespace lowlux::denoise
