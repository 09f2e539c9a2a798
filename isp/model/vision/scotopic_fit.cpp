#include "isp/model/vision/scotopic_fit.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <utility>
#include <vector>

#include "isp/model/colour/camera_matrix.h"
#include "isp/model/spectrum/cie_data.h"
#include "isp/model/spectrum/spectral_data.h"
#include "isp/model/vision/mesopic.h"

namespace lowlux::isp {
namespace {

constexpr std::size_t fewest = 4;
constexpr double min_determinant = 1e-9;  // lower limit for normal equations, relative to their diagonal

/// Holds one reflectance in camera RGB, XYZ and scotopic luminance, the perfect diffuser having RGB 1, 1, 1 and Y = 1.
struct Seen {
  Vector3 rgb;
  Vector3 xyz;
  double scotopic;
};

/// Returns the weights that sum to s: with w_2 = s - w_0 - w_1 two are free,
///     minimise sum (w_0 (r - b) + w_1 (g - b) + s b - y)^2 / y^2
std::optional<Vector3> weights_of_sum(const std::vector<Seen>& all, double s) {
  double rr = 0, rg = 0, gg = 0, ry = 0, gy = 0;
  for (const Seen& one : all) {
    const double r = (one.rgb[0] - one.rgb[2]) / one.scotopic, g = (one.rgb[1] - one.rgb[2]) / one.scotopic;
    const double y = 1 - s * one.rgb[2] / one.scotopic;
    rr += r * r;
    rg += r * g;
    gg += g * g;
    ry += r * y;
    gy += g * y;
  }
  const double determinant = rr * gg - rg * rg;
  if (!(determinant > min_determinant * rr * gg)) return std::nullopt;
  const double w0 = (ry * gg - gy * rg) / determinant, w1 = (gy * rr - ry * rg) / determinant;
  return Vector3{w0, w1, s - w0 - w1};
}

/// Returns the M that minimises the sum of |xyz - M rgb|^2 / Y^2.
std::optional<Matrix3> best_matrix(const std::vector<Seen>& all) {
  Matrix3 cross{}, gram{};
  for (const Seen& one : all) {
    const double weight = 1 / (one.xyz[1] * one.xyz[1]);
    for (int i = 0; i < 3; ++i) {
      for (int j = 0; j < 3; ++j) {
        cross[i][j] += weight * one.xyz[i] * one.rgb[j];
        gram[i][j] += weight * one.rgb[i] * one.rgb[j];
      }
    }
  }
  const auto back = inverse(gram);
  if (!back) return std::nullopt;
  return cross * *back;
}

double rms_relative(const std::vector<Seen>& all, const Vector3& weights) {
  double sum = 0;
  for (const Seen& one : all) sum += std::pow(dot(weights, one.rgb) / one.scotopic - 1, 2);
  return std::sqrt(sum / static_cast<double>(all.size()));
}

}  // namespace

std::optional<ScotopicFit> fit_scotopic(const std::array<Spectrum, 3>& sensitivity, const Spectrum& light,
                                        std::span<const Spectrum> reflectances) {
  const Vector3 neutral = camera_response(sensitivity, light);
  const LuminancePair white = luminance_of(light);
  const bool all_see = *std::ranges::min_element(neutral) > 0 && white.photopic > 0 && white.scotopic > 0;
  if (reflectances.size() < fewest || !all_see) return std::nullopt;
  std::vector<Seen> all;
  all.reserve(reflectances.size());
  for (const Spectrum& reflectance : reflectances) {
    const Spectrum lit = reflected(light, reflectance);
    Seen one{camera_response(sensitivity, light, reflectance), vector_of(xyz_cd_m2(lit)),
             luminance_of(lit).scotopic / white.photopic};
    for (int i = 0; i < 3; ++i) {
      one.rgb[i] /= neutral[i];
      one.xyz[i] /= white.photopic;
    }
    if (!(one.scotopic > 0) || !(one.xyz[1] > 0)) return std::nullopt;
    all.push_back(one);
  }
  const double ratio = white.scotopic / white.photopic;
  const auto weights = weights_of_sum(all, ratio);
  const auto matrix = best_matrix(all);
  if (!weights || !matrix) return std::nullopt;
  Vector3 through{};
  for (int j = 0; j < 3; ++j) {
    for (int i = 0; i < 3; ++i) through[j] += scotopic_weights[i] * (*matrix)[i][j];
  }
  return ScotopicFit{*weights, ratio, rms_relative(all, *weights), rms_relative(all, through)};
}

const std::vector<Spectrum>& pigment_reflectances() {
  static const std::vector<Spectrum> all = [] {
    std::vector<Spectrum> out;
    for (const SpectrumSet set : {SpectrumSet::munsell_ten, SpectrumSet::macbeth}) {
      for (NamedSpectrum& one : spectra_of(set)) out.push_back(std::move(one.spectrum));
    }
    return out;
  }();
  return all;
}

}  // namespace lowlux::isp
