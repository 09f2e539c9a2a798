#pragma once

#include <array>
#include <optional>

#include "isp/base/image.h"
#include "isp/base/matrix3.h"

namespace lowlux::isp {

/// Holds what estimate_dark_charge needs of a frame: means over blocks, dark charge included, and their noise.
struct DarkEvidence {
  const CameraRgb& mean;                       // means of blocks, in fractions of white, signed, not white balanced
  std::array<double, 3> electrons_at_white{};  // electrons of R, G, B at white
  std::array<double, 3> variance_e2{};         // variance of one pixel without charge
  double pixels = 1;                           // in a block
  std::optional<Vector3> neutral;              // camera RGB of a neutral, if the source states it
  const Plane<float>* clipped = nullptr;       // fraction of each block's samples at white; null: not known
};

/// States the dark charge that the darkest blocks of a frame show.
struct DarkEstimate {
  std::array<double, 3> charge_e{};  // charges of R, G, B; their mean over pixels is `mean_e`
  double mean_e = 0;
  double standard_error_e = 0;  // standard error of mean_e, the spread of colours of dark surfaces included
  double light_e = 0;           // charge that light made in the green pixels of the darkest blocks
  double misfit = 0;            // square of the deviation that no dark charge explains, in standard deviations

  /// Returns whether the estimate is to be used: dark charge exceeds four standard errors, and the fit is credible.
  bool is_significant() const { return mean_e > 4 * standard_error_e && misfit < 12; }
};

/// Estimates the dark charge from the colour of the darkest blocks. Dark charge is the same in red, green and blue
/// pixels, light is not: behind the filters of a camera, the charge m of a dark grey surface is
///     m = d (1, 1, 1) + L n,
/// with n the camera RGB of a neutral, relative to green. The darkest fiftieth of the blocks is solved for d and L by
/// generalised least squares. The covariance holds photon and read noise, a deviation of 5 % of d between channels, and
/// the deviation of dark surfaces from neutral, relative to L: 0.17 between green and the other two and 0.4 between red
/// and blue (natural logarithms; `bench --stage dark-estimate` prints those of its images). Of frames without dark
/// charge whose darkest surfaces deviate so, up to one in twenty seems to have some, at most the charge of these
/// surfaces. n is the geometric mean of the stated neutral and of the direction from the darkest blocks to the brighter
/// half of those that are not saturated, which dark charge does not change; without a stated neutral it is the latter
/// alone. Saturated pixels are as bright in each colour: a block counts as saturated if a colour's mean exceeds 0.9 of
/// white, or if it holds so many more of them than the darkest blocks do that they make more than 5 % of its difference
/// from these. Hot pixels, which are in all blocks, cancel in this comparison. That differences of brightness show the
/// colour of light without an additive offset is the idea of the regression intersection method of remote sensing
/// (crippen-1987, docs/references.md).
/// @return nullopt where there are fewer than 64 blocks, where no light shows, or where light is as equal in the
///         channels as dark charge, so that the two cannot be separated
std::optional<DarkEstimate> estimate_dark_charge(const DarkEvidence& evidence);

}  // namespace lowlux::isp
