#include "isp/pipeline/finished/resaturate_picture.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>
#include <vector>

#include "denoise/picture/resaturate.h"
#include "isp/pipeline/finished/encode_picture.h"
#include "isp/render/output_space.h"

namespace lowlux::isp {
namespace {

constexpr double saturated_from = 0.995;  // of white: the highest code of 8 bits, allowing for rounding

double intensity_at(const RgbView<const float>& xyz, int x, int y) {
  return static_cast<double>(xyz[0].at(x, y)) + xyz[1].at(x, y) + xyz[2].at(x, y);
}

/// Returns a mask that is 1 where a channel of the space is at white.
Plane<std::uint8_t> saturated_pixels(const RgbView<const float>& xyz, const Matrix3& to_rgb) {
  Plane<std::uint8_t> out(xyz[0].width, xyz[0].height);
  for (int y = 0; y < out.height(); ++y) {
    for (int x = 0; x < out.width(); ++x) {
      const Vector3 rgb = to_rgb * Vector3{xyz[0].at(x, y), xyz[1].at(x, y), xyz[2].at(x, y)};
      out.at(x, y) = std::ranges::max(rgb) >= saturated_from ? 1 : 0;
    }
  }
  return out;
}

/// Returns the fraction of pixels that are not saturated and whose surroundings are at most `dark`.
double fraction_of_dark(const RgbView<const float>& xyz, const Plane<std::uint8_t>& saturated, double dark,
                        int radius) {
  Plane<double> sum(xyz[0].width, xyz[0].height);
  for (int y = 0; y < sum.height(); ++y) {
    for (int x = 0; x < sum.width(); ++x) {
      sum.at(x, y) = saturated.at(x, y) != 0 ? std::numeric_limits<double>::quiet_NaN() : intensity_at(xyz, x, y);
    }
  }
  const Plane<double> mean = denoise::box_mean(sum, radius);
  std::size_t below = 0;
  for (std::size_t i = 0; i < mean.size(); ++i) below += saturated.data()[i] == 0 && mean.data()[i] <= dark ? 1 : 0;
  return static_cast<double>(below) / static_cast<double>(mean.size());
}

/// Returns X - x0 S (k = 0) or Y - y0 S (k = 1), mean over the square of `side` pixels at (x, y).
double chroma_at(const RgbView<const float>& xyz, int k, int x, int y, int side) {
  const Vector3 white = vector_of(*xyz_of(white_d65));
  const double share = white[k] / (white[0] + white[1] + white[2]);
  double sum = 0;
  for (int j = y; j < y + side; ++j) {
    for (int i = x; i < x + side; ++i) sum += xyz[k].at(i, j) - share * intensity_at(xyz, i, j);
  }
  return sum / (side * side);
}

/// Returns 1.4826 times the median of the absolute diagonal Haar details of means over squares; the mean of both
/// chromas.
double median_detail(const RgbView<const float>& xyz, int side) {
  double mean = 0;
  for (int k = 0; k < 2; ++k) {
    std::vector<double> details;
    for (int y = 0; y + 2 * side <= xyz[0].height; y += 2 * side) {
      for (int x = 0; x + 2 * side <= xyz[0].width; x += 2 * side) {
        const double detail = chroma_at(xyz, k, x, y, side) - chroma_at(xyz, k, x + side, y, side) -
                              chroma_at(xyz, k, x, y + side, side) + chroma_at(xyz, k, x + side, y + side, side);
        if (std::isfinite(detail)) details.push_back(std::abs(detail / 2));
      }
    }
    if (details.empty()) return 0;
    const auto middle = details.begin() + static_cast<std::ptrdiff_t>(details.size() / 2);
    std::nth_element(details.begin(), middle, details.end());
    mean += 1.4826 * *middle / 2;
  }
  return mean;
}

}  // namespace

double chroma_noise_of(const RgbView<const float>& xyz) {
  double largest = 0;
  for (const int side : {1, 2, 4}) largest = std::max(largest, side * median_detail(xyz, side));
  return largest;
}

Resaturated resaturate_picture(SceneLinear xyz, const ResaturateOptions& options, Executor& executor) {
  const Matrix3 to_rgb = *xyz_to_output(options.space == OutputSpace::xyz ? OutputSpace::linear_srgb : options.space);
  const Plane<std::uint8_t> saturated = saturated_pixels(std::as_const(xyz).view(), to_rgb);
  denoise::Resaturation how;
  how.dark = options.black;
  how.chroma_noise = options.chroma_noise ? *options.chroma_noise : chroma_noise_of(std::as_const(xyz).view());
  how.prior_std = options.prior_std;
  how.radius = options.radius;
  how.xyz_to_rgb = to_rgb;
  how.saturated = saturated.view();
  Resaturated out;
  out.chroma_noise = how.chroma_noise;
  const double dark = options.black.x + options.black.y + options.black.z;
  out.fraction_dark = fraction_of_dark(std::as_const(xyz).view(), saturated, dark, options.radius);
  const auto at_white = std::count(saturated.data(), saturated.data() + saturated.size(), std::uint8_t{1});
  out.fraction_saturated = static_cast<double>(at_white) / static_cast<double>(saturated.size());
  denoise::resaturate(std::as_const(xyz).view(), how, xyz.view());
  out.picture = encode_picture(xyz, options.space, options.samples, executor);
  return out;
}

}  // namespace lowlux::isp
