#include "isp/pipeline/finished/resaturate_picture.h"

#include <algorithm>
#include <array>
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

/// Mean intensity S of a square of 2 x 2 smaller squares, and the absolute diagonal Haar details of X - x0 S and of
/// Y - y0 S between these.
struct SquareDetail {
  double intensity = 0;
  std::array<double, 2> detail{};
};

/// @param side  side of the smaller squares [px]
SquareDetail detail_at(const RgbView<const float>& xyz, int x, int y, int side) {
  const Vector3 white = vector_of(*xyz_of(white_d65));
  const double sum_of_white = white[0] + white[1] + white[2];
  SquareDetail out;
  for (int j = y; j < y + 2 * side; ++j) {
    for (int i = x; i < x + 2 * side; ++i) {
      const double intensity = intensity_at(xyz, i, j), sign = (i < x + side) == (j < y + side) ? 1 : -1;
      out.intensity += intensity / (4 * side * side);
      for (int k = 0; k < 2; ++k) {
        out.detail[k] += sign * (xyz[k].at(i, j) - white[k] / sum_of_white * intensity) / (2 * side * side);
      }
    }
  }
  for (double& detail : out.detail) detail = std::abs(detail);
  return out;
}

/// Returns 1.4826 times the median of the details of the darkest part of the squares that are brighter than `dark`, a
/// tenth for a `fraction` of 10; the mean of both chromas.
double median_detail(const RgbView<const float>& xyz, double dark, int side, std::size_t fraction) {
  constexpr std::size_t least = 64;
  std::vector<SquareDetail> squares;
  for (int y = 0; y + 2 * side <= xyz[0].height; y += 2 * side) {
    for (int x = 0; x + 2 * side <= xyz[0].width; x += 2 * side) {
      const SquareDetail square = detail_at(xyz, x, y, side);
      if (square.intensity > dark && std::isfinite(square.detail[0] + square.detail[1])) squares.push_back(square);
    }
  }
  if (squares.empty()) return 0;
  const auto n = static_cast<std::ptrdiff_t>(std::min(squares.size(), std::max(squares.size() / fraction, least)));
  std::nth_element(squares.begin(), squares.begin() + (n - 1), squares.end(),
                   [](const auto& a, const auto& b) { return a.intensity < b.intensity; });
  double mean = 0;
  for (int k = 0; k < 2; ++k) {
    std::nth_element(squares.begin(), squares.begin() + n / 2, squares.begin() + n,
                     [k](const auto& a, const auto& b) { return a.detail[k] < b.detail[k]; });
    mean += 1.4826 * squares[static_cast<std::size_t>(n / 2)].detail[k] / 2;
  }
  return mean;
}

}  // namespace

double chroma_noise_of(const RgbView<const float>& xyz, double dark) {
  for (const std::size_t fraction : {10, 1}) {  // all of it where rounding leaves no noise in the dark
    double largest = 0;
    for (const int side : {1, 2, 4}) largest = std::max(largest, side * median_detail(xyz, dark, side, fraction));
    if (largest > 0) return largest;
  }
  return 0;
}

Resaturated resaturate_picture(SceneLinear xyz, const ResaturateOptions& options, Executor& executor) {
  const Matrix3 to_rgb = *xyz_to_output(options.space == OutputSpace::xyz ? OutputSpace::linear_srgb : options.space);
  const Plane<std::uint8_t> saturated = saturated_pixels(std::as_const(xyz).view(), to_rgb);
  denoise::Resaturation how;
  how.dark = options.black;
  const double dark = options.black.x + options.black.y + options.black.z;
  how.chroma_noise = options.chroma_noise ? *options.chroma_noise : chroma_noise_of(std::as_const(xyz).view(), dark);
  how.prior_std = options.prior_std;
  how.radius = options.radius;
  how.xyz_to_rgb = to_rgb;
  how.saturated = saturated.view();
  Resaturated out;
  out.chroma_noise = how.chroma_noise;
  out.fraction_dark = fraction_of_dark(std::as_const(xyz).view(), saturated, dark, options.radius);
  const auto at_white = std::count(saturated.data(), saturated.data() + saturated.size(), std::uint8_t{1});
  out.fraction_saturated = static_cast<double>(at_white) / static_cast<double>(saturated.size());
  denoise::resaturate(std::as_const(xyz).view(), how, xyz.view());
  out.picture = encode_picture(xyz, options.space, options.samples, executor);
  return out;
}

}  // namespace lowlux::isp
