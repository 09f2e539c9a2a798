#include "denoise/picture/resaturate.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <limits>
#include <utility>

namespace lowlux::denoise {
namespace {

constexpr double lowest_locus_y = 0.0048;  // CIE 1931, 405 to 420 nm: no light is below it, and X / Y would diverge

Vector3 rgb_of(const isp::Xy& c, const Matrix3& xyz_to_rgb) { return xyz_to_rgb * Vector3{c.x, c.y, 1 - c.x - c.y}; }

/// Returns the fraction of the way from the neutral to a colour on which a value stays >= 0, given that it is
/// `at_neutral` > 0 and `there` at the ends.
double inside(double at_neutral, double there) { return there < 0 ? at_neutral / (at_neutral - there) : 1; }

/// Returns the chromaticity, or the last one inside the gamut on the straight line to it from the neutral.
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

/// Returns the chromaticity of a pixel's light; the neutral where it cannot be estimated.
isp::Xy light_of(const isp::Xyz& pixel, double mean_intensity, const Resaturation& how) {
  const double signal = mean_intensity - intensity(how.dark, ShareWeights::xy);
  const auto measured = isp::xy_of(pixel);
  if (!measured || !(pixel.y > 0) || !(signal > 0) || !(mean_intensity > 0)) return how.neutral;
  const double confidence = plane_confidence(signal, how.chroma_noise * how.chroma_noise, how.prior_std);
  const isp::Xy dark = isp::xy_of(how.dark).value_or(how.neutral);  // no effect without dark charge: alpha is 1
  return held_in_gamut(resaturate_xy(*measured, dark, signal / mean_intensity, confidence, how.neutral), how);
}

}  // namespace

Plane<double> box_mean(const Plane<double>& values, int radius) {
  assert(radius >= 0 && radius <= 64);
  const int width = values.width(), height = values.height();
  Plane<double> row_sum(width, height), out(width, height);
  Plane<int> row_count(width, height);
  for (int y = 0; y < height; ++y) {
    const double* in = values.row(y);
    for (int x = 0; x < width; ++x) {
      double sum = 0;
      int count = 0;
      for (int i = std::max(x - radius, 0); i <= std::min(x + radius, width - 1); ++i) {
        if (!std::isfinite(in[i])) continue;
        sum += in[i];
        ++count;
      }
      row_sum.at(x, y) = sum;
      row_count.at(x, y) = count;
    }
  }
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      double sum = 0;
      int count = 0;
      for (int j = std::max(y - radius, 0); j <= std::min(y + radius, height - 1); ++j) {
        sum += row_sum.at(x, j);
        count += row_count.at(x, j);
      }
      out.at(x, y) = count > 0 ? sum / count : std::numeric_limits<double>::quiet_NaN();
    }
  }
  return out;
}

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

namespace {

/// Returns 1 / (1 + q^2) for q = noise / expected value; 0 where there is no such q.
double share_of(double expected_std, double noise_std) {
  if (!(expected_std > 0) || !(noise_std >= 0)) return 0;
  const double q = noise_std / expected_std;
  return std::isnan(q) ? 0 : 1 / (1 + q * q);
}

Vector3 difference(const Vector3& numerator, double neutral) {
  Vector3 out{};
  for (int i = 0; i < 3; ++i) out[i] = numerator[i] - neutral * weight_form[i];
  return out;
}

}  // namespace

ShrunkChroma shrunk_chroma(const XyzEstimate& estimate, const ChromaPrior& prior) {
  assert(prior.std > 0);
  const Vector3 xyz = isp::vector_of(estimate.value);
  const double weight = dot(weight_form, xyz);
  const Vector3 u_row = difference(u_form, prior.neutral.u), v_row = difference(v_form, prior.neutral.v);
  const double noise = std::sqrt((covariance_of(u_row, estimate.covariance, u_row) +  //
                                  covariance_of(v_row, estimate.covariance, v_row)) /
                                 2);
  const double a = weight * prior.std / noise;  // ratio of the expected chroma to the noise
  const auto moved = [&](const Vector3& row) {
    // Compute w / W as one factor: separately, w vanishes and 1 / W grows as W approaches 0.
    const double r = dot(row, xyz);
    return noise > 0 && std::isfinite(a) ? r / noise * prior.std / (a + 1 / a) : r / weight;
  };
  const double w = share_of(weight * prior.std, noise);
  const isp::UvPrime uv{prior.neutral.u + moved(u_row), prior.neutral.v + moved(v_row)};
  if (!(w > 0) || !std::isfinite(uv.u) || !std::isfinite(uv.v)) return {prior.neutral, 0};
  return {uv, w};
}

double chroma_confidence(const isp::UvCovariance& covariance, double prior_std) {
  assert(prior_std > 0);
  return share_of(prior_std, std::sqrt((covariance.uu + covariance.vv) / 2));
}

double plane_confidence(double luma, double residual_variance, double rho) {
  assert(rho > 0);
  return share_of(luma * rho, std::sqrt(residual_variance));
}

void subtract_dark(PlaneView<const float> charge_e, const PerSite<double>& dark_e, PlaneView<float> signal_e) {
  assert(charge_e.width == signal_e.width && charge_e.height == signal_e.height);
  for (int y = 0; y < charge_e.height; ++y) {
    for (int x = 0; x < charge_e.width; ++x) {
      signal_e.at(x, y) = static_cast<float>(charge_e.at(x, y) - dark_e[site_of(x, y)]);
    }
  }
}

SignalElectrons subtract_dark(RawElectrons charge, const PerSite<double>& dark_e) {
  subtract_dark(std::as_const(charge.value).view(), dark_e, charge.value.view());
  return {std::move(charge.value), charge.phase};
}

double intensity(const isp::Xyz& colour, ShareWeights weights) {
  return weights == ShareWeights::xy ? colour.x + colour.y + colour.z : colour.x + 15 * colour.y + 3 * colour.z;
}

Plane<float> alpha_map(const SceneLinear& signal_xyz, const isp::Xyz& dark, ShareWeights weights, int radius,
                       PlaneView<const std::uint8_t> saturated) {
  const double dark_intensity = intensity(dark, weights);
  assert(dark_intensity >= 0 && std::isfinite(dark_intensity));
  const auto& [x_plane, y_plane, z_plane] = signal_xyz.plane;
  Plane<double> signal(signal_xyz.width(), signal_xyz.height());
  for (int y = 0; y < signal.height(); ++y) {
    for (int x = 0; x < signal.width(); ++x) {
      const bool usable = saturated.data == nullptr || saturated.at(x, y) == 0;
      signal.at(x, y) = usable ? intensity({x_plane.at(x, y), y_plane.at(x, y), z_plane.at(x, y)}, weights)
                               : std::numeric_limits<double>::quiet_NaN();
    }
  }
  const Plane<double> mean = box_mean(signal, radius);
  Plane<float> alpha(signal.width(), signal.height());
  for (int y = 0; y < alpha.height(); ++y) {
    for (int x = 0; x < alpha.width(); ++x) {
      const double s = mean.at(x, y);
      alpha.at(x, y) = s > 0 ? static_cast<float>(s / (s + dark_intensity)) : 0.0f;
    }
  }
  return alpha;
}

XyzEstimate xyz_estimate(const Matrix3& camera_to_xyz, const PatchMean& patch) {
  const double noise_e2 = patch.noise_std_e * patch.noise_std_e;
  Vector3 signal_e{}, variance_e2{};
  for (int k = 0; k < 3; ++k) {
    assert(patch.dark_e[k] >= 0 && patch.pixels[k] > 0 && patch.noise_std_e >= 0);
    signal_e[k] = patch.charge_e[k] - patch.dark_e[k];
    variance_e2[k] = (std::max(patch.charge_e[k], 0.0) + noise_e2) / patch.pixels[k];
    if (!patch.dark_pixels) continue;
    assert((*patch.dark_pixels)[k] > 0);
    variance_e2[k] += (patch.dark_e[k] + noise_e2) / (*patch.dark_pixels)[k];
  }
  const Matrix3& a = camera_to_xyz;
  const Matrix3 transposed{{{a[0][0], a[1][0], a[2][0]}, {a[0][1], a[1][1], a[2][1]}, {a[0][2], a[1][2], a[2][2]}}};
  return {isp::xyz_of(a * signal_e), a * diagonal3(variance_e2) * transposed};
}

}  // namespace lowlux::denoise
