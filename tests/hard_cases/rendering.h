#pragma once

#include <array>

#include "isp/raw/kernel/raw_to_rgb.h"
#include "tests/hard_cases/hard_case.h"

/// Mosaics through the kernel that makes pictures.
namespace lowlux::hard_cases {

/// A mosaic of waves and noise from -0.3 to 1.5, times `scale`.
struct RenderedCase {
  isp::RgbTransform transform{.move_into_gamut = false};
  PerSite<float> gain{1, 1, 1, 1};
  float scale = 1;
  int width = 61;
  int height = 31;
};

/// Largest difference of RawToRgb::linear from plain double, over the largest value there is: of gains, scale and the
/// sums of a row's magnitudes.
double linear_error(const RenderedCase& c, Denormals mode);

/// 100 megapixels in one call, of which every row is the same piece of memory: codes that are not those of the same
/// rows in a picture of six, beyond the two rows at each border.
double codes_of_100_megapixels(Denormals mode);

/// Pixels of a developed flat neutral frame, its camera's neutral being this, that are no neutral of its light, to
/// 1e-5.
double neutral_through_file(const std::array<double, 3>& neutral, Denormals mode);
/// The same of a stream, in codes.
double neutral_through_live(const std::array<double, 3>& neutral, Denormals mode);

/// Sizes of which neither a picture is made nor an error told.
double sizes_through_file(Denormals mode);

}  // namespace lowlux::hard_cases
