#pragma once

#include <vector>

#include "isp/base/executor.h"
#include "isp/base/plane.h"

namespace lowlux::capture {

inline constexpr double max_lens_blur_px = 10;

/// Blurs light by the point spread function of a lens: a Gaussian of standard deviation s in pixels, in the form that
/// is exact on a grid of samples, the discrete Gaussian of Lindeberg (IEEE PAMI 12 (1990) 234-254). On each
/// axis,
///     out(x) = sum over n of T(n) in(x - n),  T(n) = exp(-s^2) I_n(s^2),  I_n the modified Bessel functions.
/// T is never negative, sums to 1 and has the variance s^2 for every s. Its modulation transfer at f cycles per pixel
/// is exp(s^2 (cos(2 pi f) - 1)), and two blurs of s and t are one of sqrt(s^2 + t^2). A sampled Gaussian has none of
/// this below 0.5 px. Beyond the borders the light is the mirror image of the frame: what would leave it stays, so that
/// the sum over the frame is kept, and even light stays as it is.
class LensBlur {
 public:
  /// @param sigma_px 0..max_lens_blur_px; 0 changes nothing
  explicit LensBlur(double sigma_px);

  /// Blurs a plane of any size from 1 x 1. The same bits for every number of threads.
  void apply(Plane<float>& plane, Executor& executor) const;

  /// Returns T(0), T(1)... to the last one that is used. Those beyond it sum up to less than 1e-7.
  const std::vector<double>& kernel() const { return kernel_; }

 private:
  void blur_rows(PlaneView<float> plane, RowBand band) const;
  void blur_columns(PlaneView<const float> in, PlaneView<float> out, RowBand band) const;

  std::vector<double> kernel_;
  std::vector<float> weights_;  // weights of the kernel, from T(1) on
};

}  // namespace lowlux::capture
