#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "isp/base/random.h"
#include "isp/model/camera_matrix.h"
#include "isp/model/dark_desaturation.h"
#include "isp/model/noise_budget.h"
#include "isp/model/photon.h"
#include "isp/pipeline/develop.h"
#include "tests/reference/poisson_ref.h"
#include "tests/support/sensor_frames.h"
#include "tests/support/synthetic_camera.h"

// The cases of the sensor and photon model that are easily got wrong: each stays exact or fails clearly.
namespace lowlux {
namespace {

using capture::PhotonSampling;
using capture::SyntheticOptions;
using isp::Effect;
using isp::EffectSet;

constexpr double nan = std::numeric_limits<double>::quiet_NaN();
constexpr double inf = std::numeric_limits<double>::infinity();

TEST(SensorHardCases, ZeroPhotonsHaveNoSpectrumAndNoChromaticity) {
  const isp::PhotonMeans means = *isp::mean_photons(*isp::light_named("D65"), 0, 0.2);
  EXPECT_EQ(std::count(means.photons.begin(), means.photons.end(), 0.0), 81);
  EXPECT_FALSE(isp::estimated_spectrum(means, std::vector<double>(81, 0)));
  EXPECT_FALSE(isp::expected_squared_distance(means));
  EXPECT_FALSE(isp::xy_of(isp::Xyz{0, 0, 0}));
}

TEST(SensorHardCases, ZeroPhotonsAreExactlyNoElectronsInBothSamplings) {
  InlineExecutor executor;
  for (const PhotonSampling sampling : {PhotonSampling::physical, PhotonSampling::published}) {
    for (const bool dark : {true, false}) {  // nothing in the scene, and no time
      SyntheticOptions options;
      options.sampling = sampling;
      options.exposure.time_s = dark ? 1 : 0;
      const auto setup = test::setup_of(33, 17, 50);
      const auto source = test::source_of(dark ? *capture::dark_scene(setup) : *capture::flat_scene(setup),
                                          test::plain_sensor(), options);
      ASSERT_TRUE(source);
      const Plane<std::uint16_t> dn = source->frame(0, executor).raw.dn.clone();
      EXPECT_EQ(std::count(dn.data(), dn.data() + dn.size(), 512), 33 * 17);
    }
  }
}

TEST(SensorHardCases, MeansFromOneInABillionToAMillionAreExact) {
  const DrawStream stream{.seed = 4};
  std::vector<float> counts(500);
  for (const double mean : {1e-12, 1e-9, 1e-6, 1e-3, 0.3, 1.0, 30.0, 1e3, 1e5, 999999.0, 1e6}) {
    const std::vector<float> means(counts.size(), static_cast<float>(mean));
    poisson_row(stream, 0, 0, means, counts);
    for (std::size_t i = 0; i < counts.size(); ++i) {
      const std::uint32_t word = words_at(stream, static_cast<std::uint32_t>(i), 0)[0];
      ASSERT_EQ(counts[i], reference::poisson_count(word, means[i])) << mean;
    }
  }
  // The rarest event a word can tell of: the last one is a photon where the mean is above its distance to 1.
  EXPECT_EQ(poisson_of_word(0xffffffff, 1e-12f), 0);
  EXPECT_EQ(poisson_of_word(0xffffffff, 1e-9f), 1);
}

TEST(SensorHardCases, MeansAboveAMillionAreAClearErrorUnlessTheWellHoldsThem) {
  SyntheticOptions options;
  const auto setup = test::setup_of(2, 2, 1e6);  // 3e8 e-
  EXPECT_TRUE(test::source_of(*capture::flat_scene(setup), test::plain_sensor(), options));
  options.effects.effects = EffectSet::all().without(Effect::clipping);
  const auto refused = test::source_of(*capture::flat_scene(setup), test::plain_sensor(), options);
  ASSERT_FALSE(refused);
  EXPECT_NE(refused.error().message.find("1e6"), std::string::npos) << refused.error().message;
}

TEST(SensorHardCases, AnAllDarkFrameDevelopsWithoutLightAndWithoutBias) {
  InlineExecutor executor;
  isp::NamedSensor sensor = test::plain_sensor();
  sensor.model.read_noise_e = 3;
  const auto source = test::source_of(*capture::dark_scene(test::setup_of(256, 192, 1)), sensor);
  ASSERT_TRUE(source);
  const isp::DevelopOptions linear{.exposure_ev = 0,
                                   .tone = isp::ToneCurve::none,
                                   .space = OutputSpace::camera,
                                   .samples = SampleType::f32,
                                   .find_defects = false};
  const auto developed = isp::develop(source->frame(0, executor), linear, executor);
  ASSERT_TRUE(developed) << developed.error().message;
  const auto& picture = std::get<SceneLinear>(developed->picture);
  // White balance divides by the neutral; 15000 DN are white. Demosaicing keeps means, but makes neighbours alike:
  // the standard error is that of the channel's own samples, a quarter of the pixels or half of them.
  const double std_dn = std::sqrt(0.25 * 9 + 1.0 / 12);
  const double share[] = {0.25, 0.5, 0.25};
  for (int c = 0; c < 3; ++c) {
    double sum = 0;
    for (std::size_t i = 0; i < picture.plane[c].size(); ++i) {
      ASSERT_TRUE(std::isfinite(picture.plane[c].data()[i]));
      sum += picture.plane[c].data()[i];
    }
    const auto n = static_cast<double>(picture.plane[c].size());
    const double gain = 1 / *std::min_element(developed->plan.neutral.begin(), developed->plan.neutral.end());
    // Malvar's filters add differences of the other channels, whose means are zero: at most twice the scatter.
    EXPECT_NEAR(sum / n, 0, 2 * 5 * gain * std_dn / 15000 / std::sqrt(share[c] * n)) << c;
  }
  EXPECT_TRUE(isp::develop(source->frame(0, executor), {}, executor)) << "automatic exposure of nothing";
}

TEST(SensorHardCases, NegativeSumsAfterSubtractionHaveNoChromaticity) {
  const isp::Xyz dark{5, 6, 7};
  for (const isp::Xyz& measured : {isp::Xyz{5, 6, 7}, {4.9, 6, 7}, {0, 0, 0}, {6, 5, 6.9}, {nan, 6, 7}}) {
    EXPECT_FALSE(isp::resaturated(measured, dark));
    EXPECT_FALSE(isp::xy_of(isp::Xyz{measured.x - dark.x, measured.y - dark.y, measured.z - dark.z}));
  }
  EXPECT_TRUE(isp::resaturated(isp::Xyz{5.1, 6, 7}, dark));
}

TEST(SensorHardCases, AsAlphaVanishesErrorsGrowByItsReciprocalAndAtZeroThereIsNoColour) {
  const isp::Xy light{0.6, 0.3}, black{0.31, 0.33};
  for (const double alpha : {1e-1, 1e-4, 1e-8, 1e-12}) {
    isp::Xy measured = isp::desaturated(light, black, alpha);
    const double error = 1e-3 * alpha;
    measured.x += error;
    const auto restored = isp::resaturated(measured, black, alpha);
    ASSERT_TRUE(restored);
    // 1e-3, and the rounding of 0.3 divided by alpha.
    EXPECT_NEAR(restored->x - light.x, error / alpha, 2e-16 / alpha) << alpha;
  }
  EXPECT_FALSE(isp::resaturated(black, black, 0));
  EXPECT_FALSE(isp::signal_share({0, 0, 0}, {1, 1, 1}));
}

Vector3 largest_codes(const Plane<std::uint16_t>& dn) {
  Vector3 out{};
  for (int y = 0; y < dn.height(); ++y) {
    for (int x = 0; x < dn.width(); ++x) {
      double& code = out[static_cast<std::size_t>(colour_at(BayerPhase::rggb, x, y))];
      code = std::max<double>(code, dn.at(x, y));
    }
  }
  return out;
}

TEST(SensorHardCases, SaturatedChannelsAreFlaggedAndOthersAreNot) {
  InlineExecutor executor;
  for (const double gain_dn_per_e : {0.1, 0.5, 5.0}) {  // full well, both, converter first
    isp::NamedSensor sensor = test::plain_sensor();
    sensor.model.system_gain_dn_per_e = gain_dn_per_e;
    sensor.model.read_noise_e = 5;
    sensor.model.full_well_e = 20000;
    const double saturation_cd_m2 = 100 * isp::saturation_charge_e(sensor.model) / sensor.model.full_well_e;
    const auto flags = [&](double share_of_saturation) {
      const auto source =
          test::source_of(*capture::flat_scene(test::setup_of(64, 64, saturation_cd_m2 * share_of_saturation)), sensor);
      return isp::saturated_channels(sensor.model, largest_codes(source->frame(0, executor).raw.dn));
    };
    // Under D65 this camera's green is the most sensitive: at 1.02 it alone is full, at 20 all are.
    using Flags = std::array<bool, 3>;
    EXPECT_EQ(flags(0.8), (Flags{false, false, false})) << gain_dn_per_e;
    EXPECT_EQ(flags(1.02), (Flags{false, true, false})) << gain_dn_per_e;
    EXPECT_EQ(flags(20), (Flags{true, true, true})) << gain_dn_per_e;
  }
}

TEST(SensorHardCases, AWhiteLevelNotAboveBlackIsRefusedBySensorAndPipeline) {
  for (const double white : {512.0, 100.0, nan}) {
    isp::NamedSensor sensor = test::plain_sensor();
    sensor.model.white_level_dn = white;
    InlineExecutor executor;
    const auto refused =
        capture::SyntheticSource::of(*capture::flat_scene(test::setup_of(4, 4, 1)), sensor,
                                     test::response_of(test::plain_sensor()), SyntheticOptions{}, executor);
    ASSERT_FALSE(refused);
    EXPECT_NE(refused.error().message.find("black < white"), std::string::npos) << refused.error().message;
    RawFrame frame =
        test::source_of(*capture::flat_scene(test::setup_of(32, 32, 1)), test::plain_sensor())->frame(0, executor);
    frame.raw.white_dn.fill(white);
    EXPECT_FALSE(isp::develop(frame, {}, executor)) << white;
  }
}

TEST(SensorHardCases, ExposuresThatAreNegativeOrNotANumberAreRefused) {
  const auto setup = test::setup_of(4, 4, 1);
  for (const double time_s : {-1e-9, -inf, inf, nan}) {
    SyntheticOptions options;
    options.exposure.time_s = time_s;
    const auto refused = test::source_of(*capture::flat_scene(setup), test::plain_sensor(), options);
    ASSERT_FALSE(refused) << time_s;
    EXPECT_EQ(refused.error().code, ErrorCode::invalid_argument);
    EXPECT_FALSE(isp::mean_photons(*isp::light_named("D65"), 1, time_s)) << time_s;
  }
  for (const double temperature_c : {nan, inf, -inf, -101.0, 151.0}) {
    SyntheticOptions options;
    options.exposure.temperature_c = temperature_c;
    EXPECT_FALSE(test::source_of(*capture::flat_scene(setup), test::plain_sensor(), options)) << temperature_c;
  }
}

TEST(SensorHardCases, ASingularMatrixOfSensitivitiesIsRefused) {
  const auto nikon = *isp::camera_sensitivity("Nikon_D5100");
  EXPECT_TRUE(isp::spectral_matrix(nikon));
  const auto refused = isp::spectral_matrix({nikon[0], nikon[0], nikon[2]});
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().code, ErrorCode::insufficient);
}

/// Mean electrons of green from the definition: the sum of photons per bin times efficiency.
double green_by_hand(const SpectralResponse& response, const Spectrum& radiance, const std::vector<double>& widths) {
  double sum = 0;
  for (std::size_t i = 0; i < radiance.size(); ++i) {
    const double nm = radiance.wavelengths_nm()[i];
    const double photons = nm * 1e-9 * radiance.values()[i] * widths[i] / (isp::planck_j_s * isp::light_speed_m_per_s);
    sum += photons * response.etendue_m2_sr * response.quantum_efficiency[1].at(nm);
  }
  return sum;
}

void expect_green_flat(const Spectrum& light, const std::vector<double>& widths) {
  InlineExecutor executor;
  const isp::NamedSensor sensor = test::plain_sensor();
  capture::SceneSetup setup{128, 128, light, "test", 3};
  const double expected = green_by_hand(test::response_of(sensor), *isp::radiance_of(light, 3), widths);
  for (const PhotonSampling sampling : {PhotonSampling::physical, PhotonSampling::published}) {
    SyntheticOptions options;
    options.sampling = sampling;
    options.effects.effects = {Effect::photon_noise};
    const auto source = test::source_of(*capture::flat_scene(setup), sensor, options);
    ASSERT_TRUE(source) << source.error().message;
    const Plane<float> dn = source->frame_dn(0, executor);
    std::vector<double> green;
    for (int y = 0; y < 128; ++y) {
      for (int x = y % 2 == 0 ? 1 : 0; x < 128; x += 2) green.push_back((dn.at(x, y) - 512) / 0.5);
    }
    const test::SampleMoments m = test::moments_of(green);
    EXPECT_NEAR(m.mean, expected, 5 * m.mean_error + 1e-4) << "float of 512 DN and more";
  }
}

TEST(SensorHardCases, ASpectrumWithASingleBinThatIsNotZeroIsExposedAsItIs) {
  const Spectrum line = *Spectrum::of({540, 545, 550, 555, 560}, {0, 0, 1, 0, 0});
  EXPECT_NEAR(integrate(*isp::normalised(line)), 1, 1e-15);
  expect_green_flat(line, {2.5, 5, 5, 5, 2.5});
  const isp::PhotonMeans means = *isp::mean_photons(line, 1e-15, 0.2);
  const auto estimated = isp::estimated_spectrum(means, means.photons);
  ASSERT_TRUE(estimated);
  EXPECT_NEAR(isp::spectral_distance(*estimated, *isp::normalised(line)), 0, 1e-15);
}

TEST(SensorHardCases, NonUniformStepsWeighEachBinByItsOwnWidth) {
  const Spectrum uneven = *Spectrum::of({400, 401, 410, 450, 530, 531, 600, 720}, {1, 3, 2, 0.5, 2, 4, 1, 0.2});
  const std::vector<double> widths{0.5, 5, 24.5, 60, 40.5, 35, 94.5, 60};
  EXPECT_EQ(isp::bin_widths_nm(uneven), widths);
  expect_green_flat(uneven, widths);
}

TEST(SensorHardCases, MosaicsOfOnePixelAndOfOddSizesDevelopOrSayWhyNot) {
  InlineExecutor executor;
  for (const auto& [width, height] : {std::pair{1, 1}, {1, 5}, {5, 1}, {2, 2}, {3, 3}, {5, 7}, {33, 31}}) {
    const auto source = test::source_of(*capture::flat_scene(test::setup_of(width, height, 20)), test::plain_sensor());
    ASSERT_TRUE(source);
    const RawFrame frame = source->frame(0, executor);
    EXPECT_EQ(frame.raw.dn.size(), static_cast<std::size_t>(width) * static_cast<std::size_t>(height));
    const auto developed = isp::develop(frame, {}, executor);
    if (developed) {
      EXPECT_EQ(developed->plan.width, width);
      EXPECT_EQ(developed->plan.height, height);
    } else {
      EXPECT_LT(std::min(width, height), 5) << developed.error().message;
      EXPECT_FALSE(developed.error().message.empty());
    }
  }
}

}  // namespace
}  // namespace lowlux
