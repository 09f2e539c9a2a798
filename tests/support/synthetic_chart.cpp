#include "tests/support/synthetic_chart.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <map>
#include <numbers>
#include <utility>

#include "isp/base/spectrum.h"
#include "isp/model/cie_data.h"
#include "isp/model/correlated_colour_temperature.h"
#include "tests/support/spectral_table.h"

namespace lowlux::test {
namespace {

constexpr const char* patch_names[SyntheticChart::patches] = {"dark_skin",
                                                              "light_skin",
                                                              "blue_sky",
                                                              "foliage",
                                                              "blue_flower",
                                                              "bluish_green",
                                                              "orange",
                                                              "purplish_blue",
                                                              "moderate_red",
                                                              "purple",
                                                              "yellow_green",
                                                              "orange_yellow",
                                                              "blue",
                                                              "green",
                                                              "red",
                                                              "yellow",
                                                              "magenta",
                                                              "cyan",
                                                              "white_9p5_p05_D",
                                                              "neutral_8_p23_D",
                                                              "neutral_6p5_p44_D",
                                                              "neutral_5_p70_D",
                                                              "neutral_3p5_1p05_D",
                                                              "black_2_1p5_D"};

/// Element `index` of the van der Corput sequence of a base: evenly spread over 0..1 without randomness.
double van_der_corput(int index, int base) {
  double value = 0, digit = 1.0 / base;
  for (; index > 0; index /= base, digit /= base) value += digit * (index % base);
  return value;
}

/// Smooth reflectance number i: the logistic function keeps a short cosine series in 0.04..0.90,
///     R = 0.04 + 0.86 / (1 + exp(-q)),  q = sum over k = 0..3 of s_k (2 h_k - 1) cos(k pi t),  t = (nm - 380) / 400
/// with s = 3, 3, 2, 1 and h_k the van der Corput sequences of bases 2, 3, 5, 7 at i.
Result<Spectrum> smooth_reflectance(int i) {
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
  return Spectrum::of(std::move(nm), std::move(value));
}

/// Ten Munsell chips and 200 smooth reflectances.
Result<std::vector<Spectrum>> training_reflectances() {
  const auto munsell = read_spectra("munsell_ten_chips_1nm.csv");
  if (!munsell) return tl::make_unexpected(munsell.error());
  std::vector<Spectrum> all;
  for (const auto& chip : *munsell) all.push_back(chip.second);
  for (int i = 1; i <= 200; ++i) {
    auto smooth = smooth_reflectance(i);
    if (!smooth) return tl::make_unexpected(smooth.error());
    all.push_back(*std::move(smooth));
  }
  return all;
}

/// A camera under a light: what it measures of a reflectance, largest channel of the perfect diffuser 1.
class Photograph {
 public:
  static Result<Photograph> of(const std::string& camera, const std::string& light_name) {
    auto light = isp::light_named(light_name);
    if (!light) return fail(ErrorCode::not_found, "no such light", light_name);
    const auto sensitivities = read_camera_sensitivities();
    if (!sensitivities) return tl::make_unexpected(sensitivities.error());
    if (!sensitivities->contains(camera + "/R")) return fail(ErrorCode::not_found, "no such camera", camera);
    return Photograph(*std::move(light), {sensitivities->at(camera + "/R"), sensitivities->at(camera + "/G"),
                                          sensitivities->at(camera + "/B")});
  }

  Vector3 camera_rgb(const Spectrum& reflectance) const {
    return scale_ * integrals([&](double nm) { return reflectance.at(nm); });
  }
  Vector3 neutral() const {
    return scale_ * integrals([](double) { return 1.0; });
  }
  isp::Xyz scene_xyz(const Spectrum& reflectance) const { return *isp::xyz_of_reflectance(reflectance, light_); }
  isp::Xyz scene_white() const {
    const isp::Xyz sum = isp::xyz_of(light_);
    return {sum.x / sum.y, 1, sum.z / sum.y};
  }

 private:
  Photograph(Spectrum light, std::array<Spectrum, 3> sensitivity)
      : light_(std::move(light)), sensitivity_(std::move(sensitivity)) {
    const Vector3 white = integrals([](double) { return 1.0; });
    const double largest = *std::max_element(white.begin(), white.end());
    scale_ = diagonal3({1 / largest, 1 / largest, 1 / largest});
  }

  template <class Reflectance>
  Vector3 integrals(const Reflectance& reflectance) const {
    Vector3 out{};
    for (int c = 0; c < 3; ++c) {
      out[c] = integrate(light_, [&](double nm) { return sensitivity_[c].at(nm) * reflectance(nm); });
    }
    return out;
  }

  Spectrum light_;
  std::array<Spectrum, 3> sensitivity_;
  Matrix3 scale_ = identity3();
};

/// M that minimises the sum of |to - M from|^2 / to.y^2, errors relative to luminance so that dark colours count:
/// M = (sum w to from^T) (sum w from from^T)^-1.
Result<Matrix3> least_squares(const std::vector<Vector3>& from, const std::vector<Vector3>& to) {
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
  if (!inverted) return fail(ErrorCode::insufficient, "the training colours do not span three dimensions");
  return cross * *inverted;
}

Result<ColourCalibration> calibrate(const ChartSetup& setup, const std::string& light) {
  const auto photograph = Photograph::of(setup.camera, light);
  if (!photograph) return tl::make_unexpected(photograph.error());
  const auto reflectances = training_reflectances();
  if (!reflectances) return tl::make_unexpected(reflectances.error());
  const isp::Xy white = *isp::xy_of(photograph->scene_white());
  const Matrix3 to_d50 = *isp::bradford_adaptation(white, isp::white_d50);
  const Vector3 n = photograph->neutral();
  const Matrix3 balance = diagonal3({1 / n[0], 1 / n[1], 1 / n[2]});
  std::vector<Vector3> rgb, balanced, xyz, xyz_d50;
  for (const Spectrum& reflectance : *reflectances) {
    rgb.push_back(photograph->camera_rgb(reflectance));
    balanced.push_back(balance * rgb.back());
    xyz.push_back(isp::vector_of(photograph->scene_xyz(reflectance)));
    xyz_d50.push_back(to_d50 * xyz.back());
  }
  const auto to_xyz = least_squares(rgb, xyz);
  const auto forward = least_squares(balanced, xyz_d50);
  const auto to_camera = to_xyz ? inverse(*to_xyz) : std::nullopt;
  if (!to_camera || !forward) return fail(ErrorCode::insufficient, "the fit is singular", setup.camera);
  ColourCalibration out;
  out.cct_k = isp::colour_temperature_of(white)->cct_k;
  out.xyz_to_camera = *to_camera;
  if (setup.with_forward_matrix) out.forward = *forward;
  return out;
}

}  // namespace

Result<SyntheticChart> photograph_chart(const ChartSetup& setup) {
  const auto photograph = Photograph::of(setup.camera, setup.light);
  if (!photograph) return tl::make_unexpected(photograph.error());
  const auto reflectances = read_spectra("colorchecker_ohta_reflectance_5nm.csv");
  if (!reflectances) return tl::make_unexpected(reflectances.error());
  SyntheticChart chart;
  for (int i = 0; i < SyntheticChart::patches; ++i) {
    chart.scene_xyz[i] = photograph->scene_xyz(reflectances->at(patch_names[i]));
    chart.camera_rgb[i] = photograph->camera_rgb(reflectances->at(patch_names[i]));
  }
  chart.scene_white = photograph->scene_white();
  chart.colour.as_shot_neutral = photograph->neutral();
  chart.colour.source = CameraColour::Source::file_tags;
  for (const std::string& light : setup.calibration_lights) {
    const auto calibration = calibrate(setup, light);
    if (!calibration) return tl::make_unexpected(calibration.error());
    chart.colour.calibrations.push_back(*calibration);
  }
  return chart;
}

Result<std::vector<Vector3>> photograph_training_set(const ChartSetup& setup) {
  const auto photograph = Photograph::of(setup.camera, setup.light);
  const auto reflectances = training_reflectances();
  if (!photograph) return tl::make_unexpected(photograph.error());
  if (!reflectances) return tl::make_unexpected(reflectances.error());
  std::vector<Vector3> rgb;
  for (const Spectrum& reflectance : *reflectances) rgb.push_back(photograph->camera_rgb(reflectance));
  return rgb;
}

std::vector<std::string> chart_cameras() {
  std::vector<std::string> names;
  if (const auto sensitivities = read_camera_sensitivities()) {
    for (const auto& column : *sensitivities) {
      const std::string& name = column.first;
      if (name.ends_with("/R")) names.push_back(name.substr(0, name.size() - 2));
    }
  }
  return names;
}

}  // namespace lowlux::test
