#include "isp/model/sensor/exposure_advice.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include "isp/model/colour/camera_colour.h"
#include "isp/model/colour/camera_matrix.h"
#include "isp/model/colour/chroma_bound.h"
#include "isp/model/sensor/noise_budget.h"
#include "tests/support/sensor_frames.h"
#include "tests/support/synthetic_camera.h"

// The advice held against simulated patches: what it predicts is measured, and no neighbour of it is better.
namespace lowlux {
namespace {

using isp::AdvicePoint;
using isp::AdviceRequest;
using isp::ExposureAdvice;
using isp::ExposureLimit;

/// A camera's gain settings as the simulator knows them.
struct Camera {
  std::vector<isp::NamedSensor> sensors;
  std::vector<SpectralResponse> responses;
};

Camera camera_named(const std::string& name, const isp::SensorFigures& figures = {}) {
  Camera camera;
  for (const std::string_view gain : isp::gain_settings(name)) {
    isp::NamedSensor sensor = *isp::sensor_named(name, gain, figures);
    sensor.model.row_noise_e = 0;  // the advice does not know it
    camera.responses.push_back(*isp::spectral_response(sensor, {}));
    camera.sensors.push_back(std::move(sensor));
  }
  return camera;
}

AdviceRequest request_of(const Camera& camera, double midtone_cd_m2, double highlight_cd_m2, double longest_s) {
  AdviceRequest r;
  const Spectrum light = *isp::light_named("D65");
  for (std::size_t i = 0; i < camera.sensors.size(); ++i) {
    r.gains.push_back({camera.sensors[i].gain_setting, camera.sensors[i].model,
                       isp::electron_rate(camera.responses[i], *isp::radiance_of(light, 1))});
  }
  CameraColour colour;
  colour.calibrations = {
      *isp::fit_calibration(*isp::camera_sensitivity(camera.sensors[0].camera), light, isp::ForwardMatrix::fit)};
  r.camera_to_xyz = *isp::camera_to_xyz(colour, isp::white_d65, isp::white_d65);
  r.midtone_cd_m2 = midtone_cd_m2;
  r.highlight_cd_m2 = highlight_cd_m2;
  r.longest_exposure_s = longest_s;
  return r;
}

struct Measured {
  double value = 0, error = 0;  // standard error
};

struct MeasuredQuality {
  Measured snr, uv_std;
};

constexpr int side = 512;

capture::SyntheticSource flat_of(const Camera& camera, std::size_t gain, double luminance, double time_s,
                                 double temperature_c) {
  capture::SyntheticOptions options;
  options.exposure = {time_s, temperature_c};
  options.seed = 20 + gain;
  InlineExecutor executor;
  return *capture::SyntheticSource::of(*capture::flat_scene(test::setup_of(side, side, luminance)),
                                       camera.sensors[gain], camera.responses[gain], options, executor);
}

/// One frame of a neutral: the samples of each channel, and the chromaticity of each square of `cells` 2x2 cells.
struct Samples {
  std::array<std::vector<double>, 3> signal_e;
  std::vector<isp::UvPrime> uv;
};

void add_frame(const Plane<std::uint16_t>& codes, const SensorModel& s, const Vector3& dark_e, const Matrix3& matrix,
               int cells, Samples& out) {
  const auto signal_e = [&](int x, int y, int k) {
    return (codes.row(y)[x] - s.black_level_dn) / s.system_gain_dn_per_e - dark_e[k];
  };
  for (int top = 0; top + 2 * cells <= side; top += 2 * cells) {
    for (int left = 0; left + 2 * cells <= side; left += 2 * cells) {
      Vector3 sum{};
      for (int y = top; y < top + 2 * cells; ++y) {
        for (int x = left; x < left + 2 * cells; ++x) {
          const int k = static_cast<int>(colour_at(BayerPhase::rggb, x, y));
          const double e = signal_e(x, y, k);
          out.signal_e[k].push_back(e);
          sum[k] += k == 1 ? e / 2 : e;
        }
      }
      const auto xy = isp::xy_of(isp::xyz_of(matrix * sum));
      const auto uv = xy ? isp::uv_prime_of(*xy) : std::nullopt;
      ASSERT_TRUE(uv);
      out.uv.push_back(*uv);
    }
  }
}

/// Root of the mean squared distance to the mean, with the standard error of what it is the root of carried over.
Measured rss_of(const std::vector<isp::UvPrime>& uv) {
  const auto n = static_cast<double>(uv.size());
  double u = 0, v = 0, square = 0, fourth = 0;
  for (const isp::UvPrime& c : uv) u += c.u / n, v += c.v / n;
  for (const isp::UvPrime& c : uv) {
    const double d = (c.u - u) * (c.u - u) + (c.v - v) * (c.v - v);
    square += d / (n - 1);
    fourth += d * d / n;
  }
  return {std::sqrt(square), std::sqrt((fourth - square * square) / n) / (2 * std::sqrt(square))};
}

MeasuredQuality measured(const Camera& camera, const AdviceRequest& r, const AdvicePoint& point, int frames) {
  const SensorModel& s = camera.sensors[point.gain].model;
  const auto source = flat_of(camera, point.gain, r.midtone_cd_m2, point.exposure_s, r.temperature_c);
  const Vector3 dark_e = isp::dark_mean_e(s, {point.exposure_s, r.temperature_c});
  InlineExecutor executor;
  Samples samples;
  for (int i = 0; i < frames; ++i) {
    add_frame(source.frame(static_cast<std::uint32_t>(i), executor).raw.dn, s, dark_e, r.camera_to_xyz,
              static_cast<int>(std::sqrt(r.patch_pixels)), samples);
  }
  const Vector3& rate = r.gains[point.gain].white_e_per_s;
  const auto moments = test::moments_of(samples.signal_e[std::ranges::max_element(rate) - rate.begin()]);
  const double snr = moments.mean * moments.mean / moments.variance;
  return {{snr, snr * std::hypot(2 * moments.mean_error / moments.mean, moments.variance_error / moments.variance)},
          rss_of(samples.uv)};
}

/// What the chromaticity of averaged patches scatters; the bound is a little less.
double std_of_means(const AdviceRequest& r, const AdvicePoint& point) {
  const isp::GainSetting& gain = r.gains[point.gain];
  isp::FlatPatch patch;
  patch.dark_e = isp::dark_mean_e(gain.sensor, {point.exposure_s, r.temperature_c});
  for (int k = 0; k < 3; ++k) patch.signal_e[k] = gain.white_e_per_s[k] * r.midtone_cd_m2 * point.exposure_s;
  patch.noise_std_e = std::hypot(gain.sensor.read_noise_e, 1 / (std::sqrt(12.0) * gain.sensor.system_gain_dn_per_e));
  patch.pixels = {r.patch_pixels, 2 * r.patch_pixels, r.patch_pixels};
  return rss_std(isp::chroma_of_means(r.camera_to_xyz, patch)->uv_covariance);
}

void expect_as_predicted(const AdviceRequest& r, const AdvicePoint& point, const MeasuredQuality& found) {
  const std::string where = r.gains[point.gain].name + ", " + std::to_string(point.exposure_s) + " s";
  // First order in 1 / W: where W is 12 standard deviations, the next order is some 1 % of the standard deviation.
  ASSERT_GE(point.midtone->weight_snr, 12) << where;
  const double second_order = 2 / (point.midtone->weight_snr * point.midtone->weight_snr);
  const double of_means = std_of_means(r, point);
  EXPECT_NEAR(found.snr.value, point.midtone->snr, 5 * found.snr.error) << where;
  EXPECT_NEAR(found.uv_std.value, of_means, 5 * found.uv_std.error + second_order * of_means) << where;
  EXPECT_GE(found.uv_std.value, point.midtone->uv_std - 5 * found.uv_std.error) << where << ": below the bound";
  // The mean's efficiency is 0.88 at least from 0.5 e- and 1 e- read noise up.
  EXPECT_LE(of_means / point.midtone->uv_std, 1 / std::sqrt(0.88)) << where;
}

/// Simulates the advised setting, half its exposure, and every other gain at its longest.
void expect_unbeaten(const Camera& camera, const AdviceRequest& r, const ExposureAdvice& advice, int frames) {
  const AdvicePoint& best = advice.gains[advice.best].at;
  const MeasuredQuality of_best = measured(camera, r, best, frames);
  expect_as_predicted(r, best, of_best);
  std::vector<AdvicePoint> neighbours{isp::predicted_point(r, best.gain, best.exposure_s / 2)};
  for (std::size_t i = 0; i < advice.gains.size(); ++i) {
    if (i != advice.best) neighbours.push_back(advice.gains[i].at);
  }
  const double tie = std::pow(10, isp::equal_quality_db / 10);
  for (const AdvicePoint& point : neighbours) {
    const MeasuredQuality other = measured(camera, r, point, frames);
    expect_as_predicted(r, point, other);
    EXPECT_LE(other.snr.value, tie * of_best.snr.value + 5 * std::hypot(other.snr.error, tie * of_best.snr.error))
        << r.gains[point.gain].name << ", " << point.exposure_s << " s";
    EXPECT_GE(other.uv_std.value * std::sqrt(tie),
              of_best.uv_std.value - 5 * std::hypot(other.uv_std.error, of_best.uv_std.error))
        << r.gains[point.gain].name << ", " << point.exposure_s << " s";
  }
}

/// The share of a highlight's green pixels that read what a full pixel or converter reads.
double clipped_fraction(const Camera& camera, const AdviceRequest& r, std::size_t gain, double time_s) {
  const SensorModel& s = camera.sensors[gain].model;
  const auto source = flat_of(camera, gain, r.highlight_cd_m2, time_s, r.temperature_c);
  InlineExecutor executor;
  const Plane<std::uint16_t> codes = source.frame(0, executor).raw.dn.clone();
  // Full pixels still have read noise on them: it is none in the camera this is asked of, or the converter ends first.
  const double full_dn = std::min(s.white_level_dn, s.black_level_dn + s.system_gain_dn_per_e * s.full_well_e);
  double clipped = 0;
  for (int y = 0; y < side; ++y) {
    for (int x = 0; x < side; ++x) {
      if (colour_at(BayerPhase::rggb, x, y) == CfaColour::green) clipped += codes.row(y)[x] >= full_dn - 0.5;
    }
  }
  return clipped / (side * side / 2.0);
}

/// At the advised exposure no more of the highlight clips than allowed, at twice the exposure nearly all of it.
void expect_at_the_wall(const Camera& camera, const AdviceRequest& r, const ExposureAdvice& advice) {
  const AdvicePoint& best = advice.gains[advice.best].at;
  const double share = clipped_fraction(camera, r, best.gain, best.exposure_s);
  const double error = std::sqrt(r.clipped_fraction / (side * side / 2.0));
  EXPECT_LE(share, r.clipped_fraction + 5 * error);
  EXPECT_GE(share, r.clipped_fraction / 2 - 5 * error) << "exposed less than it might be";  // codes are 1 to 3 e- wide
  EXPECT_GT(clipped_fraction(camera, r, best.gain, 2 * best.exposure_s), 0.99);
  EXPECT_TRUE(isp::predicted_point(r, best.gain, 2 * best.exposure_s).exceeds);
}

TEST(ExposureAdvice, WhereMotionBindsIsAsPredictedAndNotBeaten) {
  isp::SensorFigures figures;
  figures.dark_current_e_per_s = std::array{20.0, 30.0, 25.0};
  const Camera camera = camera_named("ELD_NikonD850", figures);
  AdviceRequest r = request_of(camera, 0.2, 1, 0.05);
  r.patch_pixels = 64;
  r.temperature_c = 27;
  const auto advice = isp::advise_exposure(r);
  ASSERT_TRUE(advice) << advice.error().message;
  EXPECT_EQ(advice->gains[advice->best].limit, ExposureLimit::motion) << advice->reason;
  EXPECT_EQ(isp::predicted_point(r, advice->best, 0.1).exceeds, ExposureLimit::motion);
  expect_unbeaten(camera, r, *advice, 4);
}

TEST(ExposureAdvice, WhereTheConvertersRangeBindsIsAsPredictedAndNotBeaten) {
  isp::SensorFigures figures;
  figures.full_well_e = 3e5;  // beyond the converter at every gain
  const Camera camera = camera_named("ELD_SonyA7S2", figures);
  AdviceRequest r = request_of(camera, 5, 100, 1);
  r.patch_pixels = 64;
  const auto advice = isp::advise_exposure(r);
  ASSERT_TRUE(advice) << advice.error().message;
  EXPECT_EQ(advice->best, 0u) << advice->reason;
  EXPECT_EQ(advice->gains[0].limit, ExposureLimit::converter_range) << advice->reason;
  expect_unbeaten(camera, r, *advice, 4);
  expect_at_the_wall(camera, r, *advice);
}

TEST(ExposureAdvice, WhereTheFullWellBindsIsAsPredictedAndNotBeaten) {
  Camera camera;
  for (const double gain : {0.4, 1.6}) {  // 40000 and 10000 e- at the largest code
    isp::NamedSensor sensor = test::plain_sensor();
    sensor.gain_setting = gain < 1 ? "low" : "high";
    sensor.model.system_gain_dn_per_e = gain;
    sensor.model.full_well_e = 6000;
    sensor.model.dark_current_e_per_s = {50, 50, 50};
    camera.responses.push_back(*isp::spectral_response(sensor, {2, 100.0}));
    camera.sensors.push_back(sensor);
  }
  AdviceRequest r = request_of(camera, 5, 100, 1000);
  r.patch_pixels = 64;
  const auto advice = isp::advise_exposure(r);
  ASSERT_TRUE(advice) << advice.error().message;
  for (const isp::GainAdvice& gain : advice->gains) EXPECT_EQ(gain.limit, ExposureLimit::full_well);
  EXPECT_EQ(advice->best, 0u) << "no read noise: all gains are alike, " << advice->reason;
  expect_unbeaten(camera, r, *advice, 4);
  expect_at_the_wall(camera, r, *advice);
}

TEST(ExposureAdvice, WhereReadNoiseBindsTheGainIsRaisedAndNoOtherIsBetter) {
  const Camera camera = camera_named("ELD_SonyA7S2");
  AdviceRequest r = request_of(camera, 0.01, 0.1, 0.01);
  // As much time as gives green 2 e-: less than the 2.2 e-^2 of read noise at the highest gain.
  r.longest_exposure_s = 2 / (0.01 * std::ranges::max(r.gains[3].white_e_per_s));
  r.patch_pixels = 4096;
  const auto advice = isp::advise_exposure(r);
  ASSERT_TRUE(advice) << advice.error().message;
  EXPECT_EQ(advice->best, 3u) << advice->reason;
  EXPECT_EQ(advice->gains[3].largest_noise, isp::NoiseSource::read_noise) << advice->reason;
  EXPECT_GT(isp::decibel(advice->gains[3].at.midtone->snr / advice->gains[0].at.midtone->snr), 10);
  expect_unbeaten(camera, r, *advice, 16);
}

}  // namespace
}  // namespace lowlux
