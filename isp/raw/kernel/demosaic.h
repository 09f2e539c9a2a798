#pragma once

#include <array>
#include <cstdint>
#include <string_view>

namespace lowlux::isp {

/// Lists the ways to interpolate the missing colours of a Bayer mosaic, by rising cost: see docs/kernels.md.
enum class DemosaicMethod : std::uint8_t {
  malvar,           // linear filters (Malvar, He, Cutler, ICASSP 2004) on linear values, which leaves no bias in noise
  encoded_malvar,   // the same filters on the cube root of the values: fewer coloured dots along edges
  residual,         // colour differences weighted by gradients, red and blue by residual interpolation, on cube roots
  residual_median,  // also 3x3 medians of the colour differences: best in little light
};

inline constexpr std::array all_demosaic_methods{DemosaicMethod::malvar, DemosaicMethod::encoded_malvar,
                                                 DemosaicMethod::residual, DemosaicMethod::residual_median};

constexpr std::string_view name_of(DemosaicMethod method) {
  constexpr std::array<std::string_view, all_demosaic_methods.size()> names{"malvar", "encoded-malvar", "residual",
                                                                            "residual-median"};
  return names[static_cast<std::size_t>(method)];
}

/// Returns the number of rows and columns on which an interpolated pixel depends, to each side; even.
constexpr int reach_px(DemosaicMethod method) { return method < DemosaicMethod::residual ? 2 : 12; }

/// Describes how a mosaic of values x, white-balanced, 1 at the saturation of its first channel to saturate, is
/// interpolated. All methods but `malvar` work on u = cbrt(x + offset), for x < 0 continued by its tangent, of values
/// limited to the clip of the RgbTransform. Measured samples keep their linear value in every method.
struct Demosaic {
  DemosaicMethod method = DemosaicMethod::malvar;
  /// States the offset of the encoding: 4 e- in units of x is a good value. It is limited to 1e-6..1.
  float offset = 1e-3f;
  /// States the value that is rendered as white, on which the thresholds of `residual` depend: they are the same for
  /// two pictures that differ by a factor and by their exposure. It is limited to 1e-3..1.
  float white = 1;
  /// States the standard deviation of the noise of u, below which gradients are not trusted. It is limited to 0..1.
  float noise_std = 0;
};

}  // namespace lowlux::isp
