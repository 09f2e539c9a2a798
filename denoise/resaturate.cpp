#include "denoise/resaturate.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <limits>

#include "denoise/box_mean.h"
#include "denoise/confidence.h"
#include "denoise/dark.h"

namespace lowlux::denoise {
namespace {

constexpr double lowest_locus_y = 0.0048;  // CIE 1931, 405 to 420 nm: below it there is no light, and X / Y explodes

Vector3 rgb_of(const isp::Xy& c, const Matrix3& xyz_to_rgb) { return xyz_to_rgb * Vector3{c.x, c.y, 1 - c.x - c.y}; }

/// How far the way from the neutral to a colour stays where value >= 0, if it is `at_neutral` > 0 and `there` at its
/// ends.
double inside(double at_neutral, double there) { return there < 0 ? at_neutral / (at_neutral - there) : 1; }

/// The chromaticity, or the last one inside the gamut on the straight way to it from the neutral.
isp::Xy held_in_gamut(const isp::Xy& c, const Resaturation& how) {
  const Vector3 from = rgb_of(how.neutral, how.xyz_to_rgb), to = rgb_of(c, how.xyz_to_rgb);
  double t = inside(how.neutral.y - lowest_locus_y, c.y - lowest_locus_y);
  for (int k = 0; k < 3; ++k) t = std::min(t, inside(from[k], to[k]));
  if (t == 1) return c;
  return {how.neutral.x + t * (c.x - how.neutral.x), how.neutral.y + t * (c.y - how.neutral.y)};
}

float to_float(double value) {
  constexpr double largest = std::numeric_limits<float>::max();
  return static_cast<float>(std::clamp(value, -largest, largest));
}

isp::Xyz pixel_of(const RgbView<const float>& in, int x, int y) {
  return {in[0].at(x, y), in[1].at(x, y), in[2].at(x, y)};
}

bool is_left_out(const isp::Xyz& pixel, const Resaturation& how, int x, int y) {
  const bool saturated = how.saturated.data != nullptr && how.saturated.at(x, y) != 0;
  return saturated || !std::isfinite(pixel.x + pixel.y + pixel.z);
}

Plane<double> intensities(const RgbView<const float>& in, const Resaturation& how) {
  Plane<double> sum(in[0].width, in[0].height);
  for (int y = 0; y < sum.height(); ++y) {
    for (int x = 0; x < sum.width(); ++x) {
      const isp::Xyz pixel = pixel_of(in, x, y);
      sum.at(x, y) =
          is_left_out(pixel, how, x, y) ? std::numeric_limits<double>::quiet_NaN() : intensity(pixel, ShareWeights::xy);
    }
  }
  return sum;
}

/// The chromaticity of a pixel's light; the neutral where there is none to be had.
isp::Xy light_of(const isp::Xyz& pixel, double mean_intensity, const Resaturation& how) {
  const double signal = mean_intensity - intensity(how.dark, ShareWeights::xy);
  const auto measured = isp::xy_of(pixel);
  if (!measured || !(pixel.y > 0) || !(signal > 0) || !(mean_intensity > 0)) return how.neutral;
  const double confidence = plane_confidence(signal, how.chroma_noise * how.chroma_noise, how.prior_std);
  const isp::Xy dark = isp::xy_of(how.dark).value_or(how.neutral);  // without dark alpha is 1, and it plays no part
  return held_in_gamut(resaturate_xy(*measured, dark, signal / mean_intensity, confidence, how.neutral), how);
}

}  // namespace

isp::Xy resaturate_xy(const isp::Xy& measured, const isp::Xy& dark, double alpha, double confidence,
                      const isp::Xy& neutral) {
  assert(!(confidence < 0) && !(confidence > 1));
  if (!(alpha > 0)) return neutral;
  const double gain = confidence / alpha;
  const auto undone = [&](double i, double n, double c0) {
    return (1 - confidence) * c0 + confidence * n + gain * (i - n);
  };
  const isp::Xy out{undone(measured.x, dark.x, neutral.x), undone(measured.y, dark.y, neutral.y)};
  return std::isfinite(out.x) && std::isfinite(out.y) ? out : neutral;
}

void resaturate(const RgbView<const float>& in, const Resaturation& how, const RgbView<float>& out) {
  assert(intensity(how.dark, ShareWeights::xy) >= 0 && how.chroma_noise >= 0 && how.prior_std > 0);
  const Plane<double> mean = box_mean(intensities(in, how), how.radius);
  for (int y = 0; y < mean.height(); ++y) {
    for (int x = 0; x < mean.width(); ++x) {
      const isp::Xyz pixel = pixel_of(in, x, y);
      if (is_left_out(pixel, how, x, y)) {
        for (int k = 0; k < 3; ++k) out[k].at(x, y) = in[k].at(x, y);
        continue;
      }
      const isp::Xy c = light_of(pixel, mean.at(x, y), how);
      out[0].at(x, y) = to_float(c.x / c.y * pixel.y);
      out[1].at(x, y) = static_cast<float>(pixel.y);
      out[2].at(x, y) = to_float((1 - c.x - c.y) / c.y * pixel.y);
    }
  }
}

}  // namespace lowlux::denoise
