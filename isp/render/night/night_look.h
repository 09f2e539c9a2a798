#pragma once

#include <array>
#include <memory>
#include <optional>

#include "isp/base/executor.h"
#include "isp/base/image.h"
#include "isp/base/look_grid.h"
#include "isp/render/night/look_parameters.h"

namespace lowlux::isp {

/// Bounds the amplification of noise: where the standard deviation of the remaining noise would exceed `lightness` (CIE
/// L*) in the image, gain is reduced until it does not. The bound holds for every tone curve y(x) with y >= 0.7 x and
/// y' <= 1.3 below mid-grey, as those of tone.h are.
struct NoiseLimit {
  double lightness = 2;
  double display_per_unit = 1;      // light on the display, white 1, of Y = 1 of the pixels, before the tone curve
  PlaneView<const float> variance;  // variance of Y of the pixels, one for each cell of the grid
};

/// Returns the largest gain in 0..1 for pixels of luminance y with noise of standard deviation noise_std, both
/// display-linear and before the tone curve, with the slope of L*, min(903.3, 116/3 y^(-2/3)):
///     slope(0.7 g y) 1.3 g noise_std <= lightness.
float gain_within_noise_limit(double y, double noise_std, double lightness);

/// The field that determines an eye's state of adaptation: standard deviation of its Gaussian [deg], and fraction of
/// the entire scene's mean in it, due to scatter in the eye. Both values are chosen, not measured.
inline constexpr double adaptation_field_std_deg = 1.0;
inline constexpr double adaptation_fraction_of_mean = 0.1;

/// Makes LookGrids. It owns its memory and allocates only in the constructor.
class NightLookGrid {
 public:
  /// Prepares for images of up to max_width x max_height pixels.
  NightLookGrid(int max_width, int max_height);
  ~NightLookGrid();
  NightLookGrid(const NightLookGrid&) = delete;
  NightLookGrid& operator=(const NightLookGrid&) = delete;

  /// Applies a look to one frame. The grid is valid until the next call. The field of adaptation combines the luminance
  /// around each position (adaptation_field_std_deg) and the mean of the entire image.
  /// @param camera  means of 4 x 4 pixels of camera RGB (RawToRgb::quarter); values that are not finite count as 0
  /// @param matrix  camera RGB to the pixels' primaries, rows; clip as in RgbTransform
  LookGrid make(const RgbView<const float>& camera, const std::array<float, 9>& matrix, float clip,
                const NightLook& look, const std::optional<NoiseLimit>& limit, Executor& executor);

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace lowlux::isp
