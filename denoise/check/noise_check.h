#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "denoise/denoise_options.h"
#include "isp/base/executor.h"

/// Whether a raw has the noise that is said of it. Denoising by a wrong model leaves noise or takes detail, so this is
/// asked before.
namespace lowlux::denoise {

/// Of non-overlapping windows of 9 x 9 cells (2x2 sites) and of all sites.
struct NoiseCheck {
  /// On each pyramid level (2x2 means of each colour, finest first): variance of the diagonal Haar detail over that of
  /// the model, max(mean of a block of 8 x 8, 0.3 dark + 0.02) + variance. Mean over the tenth of the blocks, and 8 at
  /// least, whose horizontal and vertical details are smallest against the model. In white noise these do not depend on
  /// the diagonal ones, so that the choice does not bias the mean: 1 if the model holds; texture raises it. The three
  /// details of one place share what few electrons do to the fourth moment: 2 % too low at 0.5 e-^2. Absent where there
  /// are fewer than 8 blocks without saturated sites.
  std::array<std::optional<double>, most_levels> measured_over_model;
  /// The same of horizontal and vertical details, on the tenth of the blocks with the smallest diagonal ones. Nearer to
  /// the mean of a level where noise is not white: what was averaged before has least noise in its diagonals.
  std::array<std::optional<double>, most_levels> across_over_model;
  /// Share of windows whose mean signal (dark subtracted) is below 0 by more than 4 standard deviations; R, G, B. The
  /// standard deviation is the larger of the model's and the window's own.
  std::array<double, 3> share_negative{};
  double share_without_signal = 0;  // of windows in which no colour is above 0 by more than 4 standard deviations
  double share_saturated = 0;       // of sites
  long windows = 0;                 // without saturated sites; 0: the three shares of windows are 0
};

/// Measures a frame of at least 2 x 2 sites. Sites that are not a number take their blocks and windows out, values
/// beyond +-1e9 count as +-1e9. Takes up to 1/4 byte for each site.
NoiseCheck check_noise(const RawElectronsView& raw, const RawNoise& noise, Executor& executor);

/// Below, the noise of a level is taken as measured and not as the model has it.
inline constexpr double least_ratio = 0.7;
/// Above on all levels, the gain is suspected.
inline constexpr double largest_ratio = 1.5;

/// For DenoiseOptions. A level's noise is as measured, the larger of the two ratios, at its upper end; at its lower end
/// it is that of the next level, 1 at most. The mean of both where it is below least_ratio, 0.01 at least; else 1, also
/// where nothing was measured.
std::array<double, most_levels> variance_scale_of(const NoiseCheck& check);

enum class NoiseFinding : std::uint8_t {
  black_suspicious,   // more than 1 % of the windows of a colour are below 0
  noise_below_model,  // on some level, below least_ratio: denoised or compressed before, or the gain is too low
  noise_above_model,  // on all levels, above largest_ratio: the gain is wrong
  all_dark,           // more than 99.9 % of windows have no signal
  all_saturated,      // more than 99 % of sites are saturated
};

struct NoiseRemark {
  NoiseFinding finding;
  std::string text;  // cause and cure, to follow "the raw: " or the like
};

/// What is wrong, in the order of NoiseFinding; usually nothing.
std::vector<NoiseRemark> remarks_on(const NoiseCheck& check);

}  // namespace lowlux::denoise
