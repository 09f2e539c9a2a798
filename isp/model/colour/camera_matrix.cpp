#include "isp/model/colour/camera_matrix.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <numbers>
#include <optional>
#include <string>
#include <utility>

#include <Eigen/Dense>

#include "isp/base/text.h"
#include "isp/model/colour/colorimetry.h"
#include "isp/model/colour/correlated_colour_temperature.h"
#include "isp/model/sensor/photon.h"
#include "isp/model/spectrum/cie_data.h"
#include "isp/model/spectrum/spectral_data.h"

namespace lowlux::isp {
namespace {

constexpr double worst_condition_number = 1e12;  // leaves four of a double's sixteen digits

template <class Reflectance>
Vector3 response(const std::array<Spectrum, 3>& sensitivity, const Spectrum& light, const Reflectance& reflectance) {
  Vector3 out{};
  for (int c = 0; c < 3; ++c) {
    out[c] = integrate(light, [&](double nm) { return sensitivity[c].at(nm) * reflectance(nm); });
  }
  return out;
}

/// Returns element `index` of the van der Corput sequence of a base: evenly spread over 0..1 without randomness.
double van_der_corput(int index, int base) {
  double value = 0, digit = 1.0 / base;
  for (; index > 0; index /= base, digit /= base) value += digit * (index % base);
  return value;
}

/// Returns smooth reflectance number i: the logistic function keeps a short cosine series in 0.04..0.90,
///     R = 0.04 + 0.86 / (1 + exp(-q)),  q = sum over k = 0..3 of s_k (2 h_k - 1) cos(k pi t),  t = (nm - 380) / 400
/// with s = 3, 3, 2, 1 and h_k the van der Corput sequences of bases 2, 3, 5, 7 at i.
Spectrum smooth_reflectance(int i) {
  constexpr int bases[] = {2, 3, 5, 7};
  constexpr double spread[] = {3, 3, 2, 1};
  std::vector<double> nm, value;
  for (int step = 0; step <= 80; ++step) {
    double q = 0;
    for (int k = 0; k < 4; ++k) {
      q += spread[k] * (2 * van_der_corput(i, bases[k]) - 1) * std::cos(k * std::numbers::pi * step / 80.0);
    }
    nm.push_back(380 + 5 * step);
    value.push_back(0.04 + 0.86 / (1 + std::exp(-q)));
  }
  return *Spectrum::of(std::move(nm), std::move(value));
}

/// Returns the M that minimises the sum of |to - M from|^2 / to.y^2, errors relative to luminance so that dark colours
/// count: M = (sum w to from^T) (sum w from from^T)^-1.
std::optional<Matrix3> least_squares(const std::vector<Vector3>& from, const std::vector<Vector3>& to) {
  Matrix3 cross{}, gram{};
  for (std::size_t n = 0; n < from.size(); ++n) {
    const double weight = 1 / (to[n][1] * to[n][1]);
    for (int i = 0; i < 3; ++i) {
      for (int j = 0; j < 3; ++j) {
        cross[i][j] += weight * to[n][i] * from[n][j];
        gram[i][j] += weight * from[n][i] * from[n][j];
      }
    }
  }
  const auto inverted = inverse(gram);
  if (!inverted) return std::nullopt;
  return cross * *inverted;
}

/// Holds the camera RGB of the training set under a light, a perfect diffuser being (1, 1, 1), and the true XYZ.
struct TrainingSet {
  std::vector<Vector3> camera_rgb;
  std::vector<Vector3> xyz;  // Y = 1 for the perfect diffuser
};

TrainingSet photograph(const std::array<Spectrum, 3>& sensitivity, const Spectrum& light, const Vector3& neutral) {
  // weight holds the contribution of each node of the light to camera R, G, B and X, Y, Z: a reflectance costs one
  // pass.
  const auto nm = light.wavelengths_nm();
  const double white_y = xyz_of(light).y;
  std::vector<std::array<double, 6>> weight(nm.size());
  const std::vector<double> width_nm = bin_widths_nm(light);
  for (std::size_t i = 0; i < nm.size(); ++i) {
    const double power = light.values()[i] * width_nm[i];
    for (int c = 0; c < 3; ++c) {
      weight[i][c] = power * sensitivity[c].at(nm[i]) / neutral[c];
      weight[i][c + 3] = power * cie_1931_observer()[c].at(nm[i]) / white_y;
    }
  }
  TrainingSet out;
  for (const Spectrum& reflectance : training_reflectances()) {
    std::array<double, 6> sum{};
    for (std::size_t i = 0; i < nm.size(); ++i) {
      const double value = reflectance.at(nm[i]);
      for (int k = 0; k < 6; ++k) sum[k] += value * weight[i][k];
    }
    out.camera_rgb.push_back({sum[0], sum[1], sum[2]});
    out.xyz.push_back({sum[3], sum[4], sum[5]});
  }
  return out;
}

}  // namespace

Vector3 camera_response(const std::array<Spectrum, 3>& sensitivity, const Spectrum& light) {
  return response(sensitivity, light, [](double) { return 1.0; });
}

Vector3 camera_response(const std::array<Spectrum, 3>& sensitivity, const Spectrum& light,
                        const Spectrum& reflectance) {
  return response(sensitivity, light, [&](double nm) { return reflectance.at(nm); });
}

const std::vector<Spectrum>& training_reflectances() {
  static const std::vector<Spectrum> all = [] {
    std::vector<Spectrum> out;
    for (NamedSpectrum& chip : spectra_of(SpectrumSet::munsell_ten)) out.push_back(std::move(chip.spectrum));
    for (int i = 1; i <= 200; ++i) out.push_back(smooth_reflectance(i));
    return out;
  }();
  return all;
}

Result<ColourCalibration> fit_calibration(const std::array<Spectrum, 3>& sensitivity, const Spectrum& light,
                                          ForwardMatrix forward) {
  const std::optional<Xy> white = xy_of(xyz_of(light));
  const Vector3 neutral = camera_response(sensitivity, light);
  const double largest = *std::max_element(neutral.begin(), neutral.end());
  const double smallest = *std::min_element(neutral.begin(), neutral.end());
  const auto to_d50 = white ? bradford_adaptation(*white, white_d50) : std::nullopt;
  if (!to_d50 || !(smallest > 0)) {
    return fail(ErrorCode::insufficient, "no colour matrix can be fitted under a light that leaves a channel dark");
  }
  const TrainingSet set = photograph(sensitivity, light, neutral);
  const auto to_xyz = least_squares(set.camera_rgb, set.xyz);
  const auto to_camera = to_xyz ? inverse(*to_xyz) : std::nullopt;
  if (!to_camera) return fail(ErrorCode::insufficient, "the three sensitivities are not independent under the light");
  ColourCalibration out;
  out.cct_k = colour_temperature_of(*white)->cct_k;
  out.xyz_to_camera = diagonal3({neutral[0] / largest, neutral[1] / largest, neutral[2] / largest}) * *to_camera;
  if (forward == ForwardMatrix::fit) {
    std::vector<Vector3> xyz_d50;
    for (const Vector3& xyz : set.xyz) xyz_d50.push_back(*to_d50 * xyz);
    out.forward = least_squares(set.camera_rgb, xyz_d50);
  }
  return out;
}

Result<SpectralMatrix> spectral_matrix(const std::array<Spectrum, 3>& sensitivity) {
  Eigen::Matrix3d tt = Eigen::Matrix3d::Zero(), ct = Eigen::Matrix3d::Zero();
  for (const double nm : sensitivity[0].wavelengths_nm()) {
    Eigen::Vector3d t, c;
    for (int k = 0; k < 3; ++k) {
      t[k] = cie_1931_observer()[k].at(nm);
      c[k] = sensitivity[k].at(nm);
    }
    tt += t * t.transpose();
    ct += c * t.transpose();
  }
  const Eigen::JacobiSVD<Eigen::Matrix3d> svd(ct, Eigen::ComputeFullU | Eigen::ComputeFullV);
  const bool solved = svd.info() == Eigen::Success;  // false where a sensitivity is infinite
  const double condition = solved ? svd.singularValues()[0] / svd.singularValues()[2] : HUGE_VAL;
  if (!(condition <= worst_condition_number)) {
    return fail(ErrorCode::insufficient,
                "the sensitivities do not distinguish three dimensions of colour: C T^t has the condition number " +
                    number_text(condition));
  }
  const Eigen::Matrix3d m = tt * svd.solve(Eigen::Matrix3d::Identity());
  SpectralMatrix out{{}, condition};
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) out.camera_to_xyz[i][j] = m(i, j);
  }
  return out;
}

}  // namespace lowlux::isp
