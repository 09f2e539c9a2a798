#include "capture/synthetic/photon_rows.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <cstddef>
#include <span>
#include <vector>

#include "isp/base/random/random.h"
#include "isp/model/sensor/photon.h"
#include "tests/support/sensor_frames.h"
#include "tests/support/synthetic_camera.h"

// Physical photon sampling has the variance sum x_i Qe_i, published sampling sum x_i Qe_i^2; both have the same mean.
namespace lowlux::capture::photon_sampling_test {
namespace {

using isp::Effect;

constexpr int width = 128, height = 64, frames = 4;

/// What closed forms say of one channel [e-, e-^2].
struct Expected {
  double mean = 0, physical = 0, published = 0;
};

std::array<Expected, 3> expected_of(const SpectralResponse& response, const Spectrum& radiance, double time_s) {
  const Spectrum photons = *isp::photon_radiance(radiance);
  const std::vector<double> widths = isp::bin_widths_nm(photons);
  std::array<Expected, 3> out;
  for (std::size_t i = 0; i < photons.size(); ++i) {
    const double x = photons.values()[i] * widths[i] * response.etendue_m2_sr * time_s;
    for (int k = 0; k < 3; ++k) {
      const double efficiency = response.quantum_efficiency[k].at(photons.wavelengths_nm()[i]);
      out[k].mean += x * efficiency;
      out[k].published += x * efficiency * efficiency;
    }
  }
  for (Expected& e : out) e.physical = e.mean;
  return out;
}

/// Electrons of each channel over some frames, the readout adding nothing.
std::array<std::vector<double>, 3> electrons(const SyntheticSource& source, const SensorModel& s) {
  InlineExecutor executor;
  std::array<std::vector<double>, 3> out;
  for (std::uint32_t f = 0; f < frames; ++f) {
    const Plane<float> dn = source.frame_dn(f, executor);
    for (int y = 0; y < dn.height(); ++y) {
      for (int x = 0; x < dn.width(); ++x) {
        out[static_cast<int>(colour_at(BayerPhase::rggb, x, y))].push_back((dn.at(x, y) - s.black_level_dn) /
                                                                           s.system_gain_dn_per_e);
      }
    }
  }
  return out;
}

struct Tolerance {
  double mean_relative = 1e-6;      // float arithmetic
  double variance_relative = 1e-5;  // of squares
};

void expect_both_laws(const auto& make_scene, const Spectrum& radiance, double time_s, const Tolerance& tolerance) {
  isp::NamedSensor sensor = test::plain_sensor();
  sensor.model.black_level_dn = 0;
  const auto expected = expected_of(test::response_of(sensor), radiance, time_s);
  for (const PhotonSampling sampling : {PhotonSampling::physical, PhotonSampling::published}) {
    SyntheticOptions options;
    options.exposure.time_s = time_s;
    options.sampling = sampling;
    options.effects.effects = {Effect::photon_noise};
    const auto source = test::source_of(make_scene(), sensor, options);
    ASSERT_TRUE(source) << source.error().message;
    const auto found = electrons(*source, sensor.model);
    for (int k = 0; k < 3; ++k) {
      const test::SampleMoments m = test::moments_of(found[k]);
      const double variance = sampling == PhotonSampling::physical ? expected[k].physical : expected[k].published;
      EXPECT_NEAR(
          m.mean, expected[k].mean,
          5 * std::sqrt(variance / static_cast<double>(found[k].size())) + tolerance.mean_relative * expected[k].mean)
          << "channel " << k;
      EXPECT_NEAR(m.variance, variance, 5 * m.variance_error + tolerance.variance_relative * variance)
          << "channel " << k;
    }
  }
}

TEST(PhotonSampling, OfAPatchHasTheMeanAndTheVarianceOfItsLaw) {
  for (const char* light : {"D65", "HPS_generic", "LPS"}) {
    for (const double luminance_cd_m2 : {0.002, 1.0, 20.0}) {
      SCOPED_TRACE(testing::Message() << light << " " << luminance_cd_m2);
      const SceneSetup setup = test::setup_of(width, height, luminance_cd_m2, light);
      expect_both_laws([&] { return *flat_scene(setup); }, *isp::radiance_of(setup.light, luminance_cd_m2), 0.5, {});
    }
  }
}

TEST(PhotonSampling, OfALiftedColourHasTheMeanAndTheVarianceOfItsLaw) {
  const Vector3 xyz{0.3, 0.25, 0.4};  // a purple
  const auto radiance = isp::lift(isp::xyz_of(5.0 * identity3() * xyz));
  ASSERT_TRUE(radiance);
  // 0.5 %: the bilinear table between the chromaticities of its nodes, see spectral_lift_test.
  expect_both_laws([&] { return *picture_scene(test::even_picture(width, height, xyz), 5); }, *radiance, 0.5,
                   {0.005, 0.01});
}

TEST(PhotonSampling, PublishedVarianceIsTooSmallWhereverTheEfficiencyIsBelowOne) {
  const isp::NamedSensor sensor = test::plain_sensor();
  for (const Expected& e : expected_of(test::response_of(sensor), *isp::radiance_of(*isp::light_named("D65"), 1), 1)) {
    EXPECT_LT(e.published, isp::assumed_peak_quantum_efficiency * e.physical);
    EXPECT_GT(e.published, 0);
  }
}

TEST(PhotonSampling, PublishedRowsMayBeCollectedInPieces) {
  const isp::NamedSensor sensor = test::plain_sensor();
  const SpectralResponse response = test::response_of(sensor);
  const isp::LiftTable table(response);
  const Scene patches = *chart_scene(test::setup_of(37, 9, 3), isp::spectra_of(isp::SpectrumSet::munsell_ten));
  const Scene picture = *picture_scene(test::even_picture(37, 9, {0.3, 0.25, 0.4}), 3);
  for (const Scene* scene : {&patches, &picture}) {
    for (const int masked : {0, 4}) {
      const PhotonRows rows(*scene, response, &table, BayerPhase::gbrg, masked);
      std::vector<float> whole(37 + masked), pieces(37 + masked);
      rows.collect(3, 2, 0, 5, 0.7, whole);
      for (int x0 = 0; x0 < 37 + masked; x0 += 3) {
        rows.collect(3, 2, x0, 5, 0.7, std::span(pieces).subspan(x0, std::min(3, 37 + masked - x0)));
      }
      EXPECT_EQ(whole, pieces);
      for (int x = 0; x < masked; ++x) EXPECT_EQ(whole[x], 0);
    }
  }
}

TEST(PhotonSampling, StarsCannotBePublished) {
  Scene scene = *dark_scene(test::setup_of(16, 16, 1));
  ASSERT_TRUE(add_stars(scene, 1, 1, 1));
  SyntheticOptions options;
  options.sampling = PhotonSampling::published;
  const auto source = test::source_of(std::move(scene), test::plain_sensor(), options);
  ASSERT_FALSE(source);
  EXPECT_EQ(source.error().code, ErrorCode::invalid_argument);
}

// A narrow line where the filters let little pass: electrons are few, photons are more than the sampler counts.
TEST(PhotonSampling, PublishedRefusesMorePhotonsInABinThanTheSamplerCounts) {
  const isp::NamedSensor sensor = test::plain_sensor();
  const SpectralResponse response = test::response_of(sensor);
  const Spectrum light = *Spectrum::of({775, 780, 785}, {0, 1, 0});
  SceneSetup setup{4, 4, light, "deep red", 1};
  const Spectrum photons = *isp::photon_radiance(*isp::radiance_of(light, 1));
  const double per_cd_m2 = photons.values()[1] * 5 * response.etendue_m2_sr;
  SyntheticOptions options;
  options.sampling = PhotonSampling::published;
  options.effects.effects = {Effect::photon_noise, Effect::clipping};
  setup.luminance_cd_m2 = 0.99 * poisson_max_mean / per_cd_m2;
  EXPECT_TRUE(test::source_of(*flat_scene(setup), sensor, options));
  setup.luminance_cd_m2 = 1.01 * poisson_max_mean / per_cd_m2;
  const auto refused = test::source_of(*flat_scene(setup), sensor, options);
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().code, ErrorCode::invalid_argument);
  options.sampling = PhotonSampling::physical;
  EXPECT_TRUE(test::source_of(*flat_scene(setup), sensor, options));
}

}  // namespace
}  // namespace lowlux::capture::photon_sampling_test
