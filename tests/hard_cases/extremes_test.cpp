#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <utility>
#include <vector>

#include "isp/base/matrix3.h"
#include "isp/model/colour/camera_colour.h"
#include "isp/model/sensor/noise_budget.h"
#include "isp/model/vision/mesopic.h"
#include "tests/hard_cases/mosaics.h"
#include "tests/hard_cases/rendering.h"
#include "tests/hard_cases/simulated.h"
#include "tests/reference/exact_ref.h"
#include "tests/support/numbers.h"
#include "tests/support/sweep.h"

// What no specification names and every frame may hold.
namespace lowlux::hard_cases {
namespace {

using denoise_testing::flat;
using test::inf;

constexpr std::string_view extremes_group = "Other cases";
constexpr std::string_view codes_are_whole = "codes are integers";
constexpr double eps = std::numeric_limits<double>::epsilon();

TEST(HardCaseExtreme, DenormalElectrons) {
  HardCase row(
      {extremes_group, "mosaics of +-1e-40 e- without noise", "closed form: within the values themselves", "1e-40 e-"});
  MosaicCase c{.raw_e = Plane<float>(150, 97)};
  for (std::size_t i = 0; i < c.raw_e.size(); ++i) c.raw_e.data()[i] = i % 3 == 0 ? -1e-40f : 1e-40f;
  measure(row, c, {1, 1, -1, -1}, [](PlaneView<const double> out) { return distance_from(0)(out) / 1e-40; });
  row.none(pipelines, codes_are_whole);
}

TEST(HardCaseExtreme, DenormalsInRendering) {
  HardCase row({extremes_group, "samples of 1e-39, gains and matrices of 1e-30 and 1e30",
                "plain double; 1e-6 of the largest term, or the smallest normal number", "relative"});
  row.none(Path::reference, "is the reference itself").none(levels, "looks come after");
  row.on_each_set({1e-6, rounding}, [](Denormals m) {
    double worst = 0;
    RenderedCase gain{.gain = {1e-30f, 1e-30f, 1e-30f, 1e-30f}};
    keep_worst(worst, linear_error(gain, m));
    RenderedCase matrix{.gain = {1e-20f, 1e-20f, 1e-20f, 1e-20f}};
    matrix.transform.matrix = {1e9f, 0, 0, 0, 1e9f, 0, 0, 0, 1e9f};
    keep_worst(worst, linear_error(matrix, m));
    // Flushed, a sample is gone: the loss is at most itself, relative to the smallest normal number.
    RenderedCase samples{.scale = 1e-39f};
    keep_worst(worst, linear_error(samples, m) * 1e-39 / 0x1p-126 * 1e-5);
    return worst;
  });
  row.none(pipelines, codes_are_whole);
}

TEST(HardCaseExtreme, LuminancesBeyondNormal) {
  HardCase row({extremes_group, "luminances of 5e-324 to 1e300, NaN, negative",
                "closed form: m is 0 or 1, luminance that of the end", "m"});
  row.on(Path::reference, 0, [](Denormals m) {
    const auto state = [&](double p, double s) { return in_mode(m, [&] { return isp::mesopic_state({p, s}); }); };
    double worst = 0;
    for (const double light : {5e-324, 1e-310, 1e-300, 0.0, -1.0, std::numeric_limits<double>::quiet_NaN()}) {
      for (const double scotopic : {light, 2.3 * light, 0.0}) {
        const auto dark = state(light, scotopic);
        keep_worst(worst, dark.m + (dark.luminance_cd_m2 >= 0 && dark.luminance_cd_m2 < 1e-299 ? 0 : 1));
      }
    }
    for (const double light : {1e30, 1e300, inf}) {
      const auto bright = state(light, 2.3 * light);
      keep_worst(worst, 1 - bright.m + (std::isfinite(bright.luminance_cd_m2) ? 0 : 1));
    }
    return worst;
  });
  row.none(levels, no_image).none(instruction_sets, no_image).none(pipelines, no_image);
}

// Luma is of balanced colours, so that what passes of the noisiest one's noise is in all of them.
TEST(HardCaseExtreme, WhiteBalanceOfAThousandInNoiseReduction) {
  HardCase row({extremes_group, "white balance 1000 : 1 : 0.001, denoised",
                "closed form: means stay within three standard errors of the noisiest colour, all balanced",
                "standard errors of the noisiest balanced mean"});
  denoise_testing::Camera camera{.dark_e = {2, 2, 2, 2}};
  camera.white_gain = {1000, 1, 1e-3};
  MosaicCase c = case_of(camera, flat(0.02, 20, 3000), 256, 192, 95);
  c.options.rho = inf;
  const auto before = denoise_testing::colour_means(c.raw_e.view(), c.phase);
  const double noisiest = 1000 * std::sqrt((before[0] + 2.25) / (256 * 192 / 4.0));
  constexpr Bound bound{3, any_draw};
  measure(row, c, {bound, bound, bound, -1}, [&](PlaneView<const double> out) {
    const auto after = denoise_testing::colour_means(out, c.phase);
    double worst = 0;
    for (int k = 0; k < 3; ++k) {
      keep_worst(worst, std::abs(after[k] - (before[k] - 2)) * camera.white_gain[k] / noisiest);
    }
    return worst;
  });
  row.none(Path::live, "the prior is fixed, and the noisiest colour determines neutral");
}

TEST(HardCaseExtreme, WhiteBalanceOfAThousandInRendering) {
  HardCase row({extremes_group, "white balance 1000 : 1 : 1, rendered",
                "plain double (sets); the neutral itself (others)", "relative; pixels that are not neutral"});
  row.none(Path::reference, "is the reference itself").none(levels, "looks come after");
  row.on_each_set({3e-7, rounding}, [](Denormals m) { return linear_error({.gain = {1, 1000, 1e-3f, 1}}, m); });
  row.on(Path::file, 0, [](Denormals m) { return neutral_through_file({0.001, 1, 1}, m); });
  row.on(Path::live, 0, [](Denormals m) { return neutral_through_live({0.001, 1, 1}, m); });
}

/// Of condition 1e6: two rows that differ by about 1e-6.
const Matrix3 nearly_singular{{{0.7, 0.3, 0.1}, {0.7 + 1.1e-6, 0.3, 0.1 - 0.7e-6}, {0.05, 0.2, 0.9}}};

double largest_of(const Matrix3& m) {
  double out = 0;
  for (const Vector3& row : m) {
    for (const double value : row) out = std::max(out, std::abs(value));
  }
  return out;
}

double relative_error(const Matrix3& found, const Matrix3& expected) {
  double worst = 0;
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) keep_worst(worst, std::abs(found[i][j] - expected[i][j]));
  }
  return worst / largest_of(expected);
}

// An inverse by cofactors is off by about the condition times rounding.
TEST(HardCaseExtreme, MatricesOfConditionAMillion) {
  HardCase row({extremes_group, "matrices of condition 1e6",
                "inverse in 50 digits; condition times 8 roundings (double), of the largest term (sets)", "relative"});
  const double condition = reference::condition_number(nearly_singular);
  ASSERT_GT(condition, 1e6);
  const Matrix3 expected = reference::inverse(nearly_singular);
  const Bound bound{8 * eps * condition, "rounding: the bound holds for any matrix of this condition"};
  row.on(Path::reference, bound,
         [&](Denormals m) { return relative_error(in_mode(m, [] { return *inverse(nearly_singular); }), expected); });
  row.none(levels, "colours come later");
  row.on_each_set({4e-7, rounding}, [&](Denormals m) {
    RenderedCase c;
    for (int i = 0; i < 9; ++i) c.transform.matrix[i] = static_cast<float>(expected[i / 3][i % 3]);
    return linear_error(c, m);
  });
  // Of the file's colour matrix, for a scene white that is the output's: scaled so that the neutral goes to white.
  row.on(Path::file, bound, [&](Denormals m) {
    CameraColour colour;
    colour.calibrations = {{.cct_k = 6504, .xyz_to_camera = nearly_singular}};
    const auto found = in_mode(m, [&] { return isp::camera_to_xyz(colour, isp::white_d65, isp::white_d65); });
    if (!found) return inf;
    Matrix3 scaled = expected;
    const double scale = (*found)[0][0] / expected[0][0];
    for (Vector3& r : scaled) {
      for (double& value : r) value *= scale;
    }
    return relative_error(*found, scaled);
  });
  row.none(Path::live, "the same matrix: see file");
}

TEST(HardCaseExtreme, ExposuresOfAMicrosecondToAnHour) {
  HardCase row({extremes_group, "exposures of 1e-6 to 3600 s",
                "closed form: 50 digits (reference), five standard errors (frames)",
                "relative to 8 eps; standard errors"});
  row.on(Path::reference, {1, rounding}, [](Denormals m) {
    SensorModel sensor;
    sensor.dark_current_e_per_s = {0.3, 0.3, 0.3};
    double worst = 0;
    for (const double time_s : {1e-6, 1e-3, 1.0, 60.0, 3600.0}) {
      const double found = in_mode(m, [&] { return isp::dark_mean_e(sensor, {time_s, 33})[1]; });
      keep_worst(worst, std::abs(found / (0.3 * time_s * reference::doubled(33, 20, 7)) - 1) / (8 * eps));
    }
    return worst;
  });
  const auto frames = [](Denormals m) {
    double worst = 0;
    for (const double time_s : {1e-6, 1e-3, 60.0, 3600.0}) {
      keep_worst(worst, error_of_green({.green_e = 300, .time_s = time_s, .dark_e_per_s = 0.3}, m));
    }
    return worst;
  };
  row.none(levels, not_denoised).on_each_set(5, frames).on(Path::file, 5, frames);
  row.none(Path::live, "light that changes by 1e-6 and 1e6: see the means over frames");
}

TEST(HardCaseExtreme, TemperaturesOfMinus40To85) {
  HardCase row({extremes_group, "sensors of -40 to 85 C",
                "closed form: 50 digits (reference), five standard errors (frames)",
                "relative to 16 eps; standard errors"});
  row.on(Path::reference, {1, rounding}, [](Denormals m) {
    SensorModel sensor;
    double worst = 0;
    for (const double doubling : {6.0, 7.0, 8.0}) {
      sensor.dark_doubling_c = doubling;
      for (const double t : test::steps(-40, 85, 12.5)) {
        const double found = in_mode(m, [&] { return isp::dark_current_factor(sensor, t); });
        keep_worst(worst, std::abs(found / reference::doubled(t, 20, doubling) - 1) / (16 * eps));
      }
    }
    return worst;
  });
  const auto frames = [](Denormals m) {
    double worst = 0;
    for (const double temperature_c : {-40.0, 0.0, 60.0, 85.0}) {
      keep_worst(worst, error_of_green({.green_e = 5, .temperature_c = temperature_c, .dark_e_per_s = 2}, m));
    }
    return worst;
  };
  row.none(levels, "dark charge of 0.1 to 200 e-: see the invariances")
      .on_each_set(5, frames)
      .on(Path::file, 5, frames);
  row.none(Path::live, "streams get their black level with dark charge");
}

}  // namespace
}  // namespace lowlux::hard_cases
