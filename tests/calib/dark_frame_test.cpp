#include "calib/dark/dark_frame.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "calib/dark/dark_library.h"
#include "calib/dark/light_in_darks.h"
#include "capture/synthetic/fixed_pattern.h"
#include "tests/sensor_bench/sensor_bench.h"

namespace lowlux::calib::dark_frame_test {
namespace {

using test::SensorBench;

std::vector<DarkGroup> darks_of(const SensorBench& bench, const std::vector<isp::Exposure>& exposures, int frames,
                                std::uint32_t first = 100) {
  DarkLibrary library;
  for (const isp::Exposure& exposure : exposures) {
    for (int i = 0; i < frames; ++i) {
      const auto added = library.add(bench.frame(exposure, first++));
      EXPECT_TRUE(added) << added.error().message;
    }
  }
  return library.groups();
}

RawDn picture_of(SensorBench bench, const isp::Exposure& exposure, double rate_e_per_s) {
  bench.rate_e_per_s = {rate_e_per_s, rate_e_per_s, rate_e_per_s};
  return bench.frame(exposure, 7);
}

// Mean code of each pixel in the dark: what an endless number of darks would give.
Plane<float> true_dark_dn(const SensorBench& bench, const isp::Exposure& exposure) {
  const SensorModel& s = bench.sensor;
  const double time_s =
      exposure.time_s * std::exp2((exposure.temperature_c - s.dark_temperature_c) / s.dark_doubling_c);
  Plane<float> out(bench.width, bench.height);
  std::vector<float> scratch(bench.width);
  std::vector<std::uint32_t> words(bench.width);
  for (int y = 0; y < bench.height; ++y) {
    const capture::PatternRow row{bench.seed, 0, static_cast<std::uint32_t>(y)};
    std::vector<float> charge(bench.width), offset(bench.width, 0);
    for (int x = 0; x < bench.width; ++x) {
      const auto colour = static_cast<std::size_t>(colour_at(bench.phase, x, y));
      charge[x] = static_cast<float>(s.dark_current_e_per_s[colour] * time_s);
    }
    if (s.dsnu > 0) capture::apply_dsnu(row, static_cast<float>(s.dsnu), charge, scratch);
    capture::add_hot_pixels(row, s.hot_pixel_fraction, s.hot_pixel_current_e_per_s * time_s, charge, words);
    if (s.column_noise_e > 0) capture::add_column_pattern(row, static_cast<float>(s.column_noise_e), offset, scratch);
    for (int x = 0; x < bench.width; ++x) {
      out.at(x, y) = static_cast<float>(s.black_level_dn + s.system_gain_dn_per_e * (charge[x] + offset[x]));
    }
  }
  return out;
}

PerSite<double> site_means(const Plane<float>& plane) {
  PerSite<double> sum{};
  for (int y = 0; y < plane.height(); ++y) {
    for (int x = 0; x < plane.width(); ++x) sum[site_of(x, y)] += plane.at(x, y);
  }
  for (double& s : sum) s *= 4.0 / static_cast<double>(plane.size());
  return sum;
}

// Mean square distance to the truth [DN^2] of the pixels that are not unknown.
double mean_square(const DarkFrame& dark, const Plane<float>& truth) {
  double sum = 0;
  for (std::size_t i = 0; i < truth.size(); ++i) sum += std::pow(dark.dn.data()[i] - truth.data()[i], 2);
  for (const DefectRect& d : dark.unknown) sum -= std::pow(dark.dn.at(d.x, d.y) - truth.at(d.x, d.y), 2);
  return sum / static_cast<double>(truth.size() - dark.unknown.size());
}

double mean_of(const PerSite<double>& v) { return (v[0] + v[1] + v[2] + v[3]) / 4; }

const std::vector<SensorModel> sensors{test::modern_small(), test::column_noise_sensor(), test::hot_sensor()};

TEST(DarkFrame, AFewDarksAddTheNoiseThatIsReportedAndNoMoreThanAllowed) {
  for (const SensorModel& sensor : sensors) {
    const SensorBench bench{.sensor = sensor, .width = 256, .height = 256};
    const isp::Exposure exposure{4, 20};
    const RawDn picture = picture_of(bench, exposure, 20);
    for (const int n : {2, 4, 16}) {
      const auto a = make_dark_frame(darks_of(bench, {exposure}, n), picture, {});
      const auto b = make_dark_frame(darks_of(bench, {exposure}, n, 5000), picture, {});
      ASSERT_TRUE(a && b) << a.error().message;
      EXPECT_LE(a->noise_fraction, 0.1 + 1e-12);
      EXPECT_EQ(a->pattern_fraction == 1, n == 16);
      // Where neither is hot; there a is all noise, and its share of the pixels is a half percent at most.
      double sum = 0, count = 0;
      for (int y = 0; y < bench.height; ++y) {
        for (int x = 0; x < bench.width; ++x) {
          const int site = site_of(x, y);
          if (std::fabs(a->dn.at(x, y) - a->mean_dn[site]) > 5 * a->noise_std_dn[site]) continue;
          sum += std::pow(a->dn.at(x, y) - b->dn.at(x, y), 2) / 2;
          ++count;
        }
      }
      const double added = mean_of(a->added_variance_dn2);
      // A chi-square of `count` degrees, and weights that scatter by 1 % (16,384 pixels of a site each). Columns and
      // rows are 512 values, and add less than two pixels' noise over 128; where they have no pattern, chance still
      // gives them a weight of sqrt(2 / 128).
      const double noise_dn2 = std::pow(a->noise_std_dn[0], 2);
      const double tolerance = added * (5 * std::sqrt(2 / count) + 0.02) +
                               5 * std::sqrt(2.0 / 512) * 2 * noise_dn2 / (128 * n) + 5 * noise_dn2 / (64 * 128 * n);
      EXPECT_NEAR(sum / count, added, tolerance) << sensor.name << " " << n;
    }
  }
}

TEST(DarkFrame, OneDarkHelpsWhereThereIsAPatternAndNeverHurts) {
  for (const SensorModel& sensor : sensors) {
    const SensorBench bench{.sensor = sensor, .width = 256, .height = 256};
    const isp::Exposure exposure{4, 20};
    const auto dark = make_dark_frame(darks_of(bench, {exposure}, 1), picture_of(bench, exposure, 20), {});
    ASSERT_TRUE(dark) << dark.error().message;
    EXPECT_LE(dark->noise_fraction, 0.1 + 1e-12);
    const Plane<float> truth = true_dark_dn(bench, exposure);
    DarkFrame none;  // four figures, as good as can be
    none.dn = truth.clone();
    const PerSite<double> means = site_means(truth);
    for (int y = 0; y < 256; ++y) {
      for (int x = 0; x < 256; ++x) none.dn.at(x, y) = static_cast<float>(means[site_of(x, y)]);
    }
    const double with = mean_square(*dark, truth), without = mean_square(none, truth);
    const double noise_dn2 = std::pow(dark->noise_std_dn[0], 2);
    // The mean of 16,384 pixels instead of the truth's; weights of columns that follow from 128 of them.
    EXPECT_LT(with, without + noise_dn2 * (25 / 16384.0 + 5 * std::sqrt(2 / 128.0) / 128)) << sensor.name;
    if (sensor.hot_pixel_fraction > 0) {
      EXPECT_LT(with, 0.1 * without);
    }
    if (sensor.column_noise_e > 0) {
      EXPECT_LT(with, 0.2 * without);
    }
    RecordProperty("with_" + std::to_string(&sensor - sensors.data()), std::to_string(with / without));
  }
}

TEST(DarkFrame, SixteenDarksOfTheSameSettingAreTheirMeanAsItIs) {
  const SensorBench bench{.sensor = test::hot_sensor(), .width = 96, .height = 96};
  const auto groups = darks_of(bench, {{4, 20}}, 16);
  const auto dark = make_dark_frame(groups, picture_of(bench, {4, 20}, 20), {});
  ASSERT_TRUE(dark);
  EXPECT_EQ(dark->frames, 16);
  EXPECT_EQ(dark->scale, 1);
  EXPECT_NEAR(dark->noise_fraction, 1.0 / 16, 1e-12);
  EXPECT_TRUE(dark->warnings.empty());
  EXPECT_TRUE(std::equal(dark->dn.data(), dark->dn.data() + dark->dn.size(), groups[0].mean_dn.data()));
}

struct Scaled {
  std::vector<isp::Exposure> darks;
  isp::Exposure picture;
  DarkRequest request;
  double tolerance;  // of the mean dark charge, relative
};

TEST(DarkFrame, ScaledDarksComeCloserToTheTruthThanFourFiguresCould) {
  const SensorBench bench{.sensor = test::hot_sensor(), .width = 192, .height = 192};
  const PerSite<double> pedestal{512.2, 512.2, 512.2, 512.2};
  // By least squares in time; above a tag; by a doubling that is given (the sensor's is 7), and one that is fitted.
  const std::vector<Scaled> cases{{{{0.1, 20}, {8, 20}}, {4, 20}, {}, 0},
                                  {{{8, 20}}, {4, 20}, {.pedestal_dn = pedestal}, 0},
                                  {{{4, 27}}, {4, 20}, {.doubling_c = 7, .pedestal_dn = pedestal}, 0},
                                  {{{0.1, 20}, {8, 13}, {8, 20}}, {8, 17}, {}, 0.01}};
  for (const Scaled& c : cases) {
    const auto dark = make_dark_frame(darks_of(bench, c.darks, 8), picture_of(bench, c.picture, 20), c.request);
    ASSERT_TRUE(dark) << dark.error().message;
    const Plane<float> truth = true_dark_dn(bench, c.picture);
    double off = 0, charge = 0;
    for (std::size_t i = 0; i < truth.size(); ++i) {
      off += dark->dn.data()[i] - truth.data()[i];
      charge += truth.data()[i] - 512.2;
    }
    for (const DefectRect& d : dark->unknown) off -= dark->dn.at(d.x, d.y) - truth.at(d.x, d.y);
    const auto n = static_cast<double>(truth.size());
    const double error = dark->noise_std_dn[0] * std::sqrt(1 / (8 * n)) + std::sqrt(dark->noise_fraction / n);
    EXPECT_NEAR(off / n, 0, 5 * error + c.tolerance * charge / n);
    // 20 % of the charge of 16 e- at least is its spread: 6.5 DN^2. What is left is noise and what shrinking leaves.
    double spread = 0;
    const PerSite<double> means = site_means(truth);
    for (int y = 0; y < 192; ++y) {
      for (int x = 0; x < 192; ++x) spread += std::pow(truth.at(x, y) - means[site_of(x, y)], 2) / n;
    }
    EXPECT_LT(mean_square(*dark, truth), 0.1 * spread);
    EXPECT_LE(dark->noise_fraction, 0.1 + 1e-12);
  }
}

TEST(DarkFrame, MaskedPixelsOfThePictureSetTheLevelOfOneScaledDark) {
  const SensorBench bench{.sensor = test::hot_sensor(), .width = 96, .height = 96};
  const Plane<float> truth = true_dark_dn(bench, {4, 20});
  const PerSite<double> masked = site_means(truth);
  const auto dark =
      make_dark_frame(darks_of(bench, {{8, 20}}, 16), picture_of(bench, {4, 20}, 20), {.masked_dn = masked});
  ASSERT_TRUE(dark) << dark.error().message;
  // Masked pixels hold hot ones, the median of the darks does not: 0.4 % of 300 e- at 4 s, times 0.8 DN/e-.
  for (int site = 0; site < 4; ++site) EXPECT_NEAR(dark->mean_dn[site], masked[site], 3);

  // Of other masked pixels: as if made for them, within the rounding of floats of 500 DN.
  const PerSite<double> other{masked[0] + 1, masked[1] - 2, masked[2] + 3, masked[3]};
  const auto made =
      make_dark_frame(darks_of(bench, {{8, 20}}, 16), picture_of(bench, {4, 20}, 20), {.masked_dn = other});
  const DarkFrame moved = at_masked_level(*dark, other);
  for (int site = 0; site < 4; ++site) EXPECT_NEAR(moved.mean_dn[site], made->mean_dn[site], 1e-4);
  for (std::size_t i = 0; i < moved.dn.size(); ++i) ASSERT_NEAR(moved.dn.data()[i], made->dn.data()[i], 1e-3);
}

// Of 0.1 e- in the darks, one pixel in ten holds an electron and the median none: scaled to half the time, the level of
// the dark frame is that of the masked pixels, 0.05 e-.
TEST(DarkFrame, MaskedPixelsSetTheLevelOfDarksOfFewElectrons) {
  SensorModel sensor = test::modern_small();
  sensor.system_gain_dn_per_e = 20;
  sensor.read_noise_e = 0.15;
  sensor.dsnu = sensor.prnu = sensor.hot_pixel_fraction = sensor.row_noise_e = sensor.column_noise_e = 0;
  sensor.dark_current_e_per_s = {0.0125, 0.0125, 0.0125};
  sensor.full_well_e = 150;
  const SensorBench bench{.sensor = sensor, .width = 256, .height = 256};
  PerSite<double> masked{};
  masked.fill(sensor.black_level_dn + 20 * 0.05);
  DarkNoiseModel noise;
  noise.gain_dn_per_e.fill(20);
  noise.read_variance_dn2.fill(9 + 1.0 / 12);
  for (const int frames : {1, 4}) {
    const auto dark = make_dark_frame(darks_of(bench, {{8, 20}}, frames), picture_of(bench, {4, 20}, 20),
                                      {.masked_dn = masked, .noise = noise});
    ASSERT_TRUE(dark) << dark.error().message;
    // Half of the mean of the darks is in the level, whose error is that of 65,536 pixels.
    const double error_dn = 20 * std::sqrt((0.1 + 0.0225) / (65536.0 * frames));
    EXPECT_NEAR(mean_of(site_means(dark->dn)), masked[0], 5 * error_dn + 1e-3) << frames;
  }
}

TEST(DarkFrame, PixelsThatAreFullOrTooNoisyAreToBeRepaired) {
  SensorBench bench{.sensor = test::hot_sensor(), .width = 256, .height = 256};
  bench.sensor.hot_pixel_current_e_per_s = 2000;
  const isp::Exposure exposure{4, 20};
  const auto dark = make_dark_frame(darks_of(bench, {exposure}, 16), picture_of(bench, exposure, 20), {});
  ASSERT_TRUE(dark) << dark.error().message;
  const Plane<float> truth = true_dark_dn(bench, exposure);
  int noisy = 0, listed = 0;
  for (int y = 0; y < bench.height; ++y) {
    for (int x = 0; x < bench.width; ++x) {
      const double charge_e = (truth.at(x, y) - 512.2) / 0.8;
      const bool unknown =
          std::ranges::any_of(dark->unknown, [&](const DefectRect& d) { return d.x == x && d.y == y; });
      // 16 e- of dark and 4 of reading: five times that noise is 25 times 20 to 24 e-. A variance of 16 frames scatters
      // by a third; five of that lie within a factor of 3.
      if (charge_e > 3 * 600) noisy += 1, listed += unknown;
      if (charge_e < 600 / 3.0) {
        EXPECT_FALSE(unknown) << x << " " << y;
      }
    }
  }
  EXPECT_GT(noisy, 50);
  EXPECT_EQ(listed, noisy);
}

std::string refusal(const SensorBench& darks, const RawDn& picture, const DarkRequest& request = {}, int frames = 2,
                    isp::Exposure exposure = {4, 20}) {
  const auto dark = make_dark_frame(darks_of(darks, {exposure}, frames), picture, request);
  if (!dark) return dark.error().message;
  if (request.masked_dn) {
    if (const auto fits = check_masked_level(picture, *request.masked_dn, *dark); !fits) return fits.error().message;
  }
  const auto below = check_below_picture(picture, *dark);
  return below ? "" : below.error().message;
}

const SensorBench small{.sensor = test::hot_sensor(), .width = 96, .height = 96};

TEST(DarkFrame, DarksThatHoldLightAreRefused) {
  const RawDn picture = picture_of(small, {4, 20}, 20);
  EXPECT_EQ(refusal(small, picture), "");
  SensorBench lit = small;
  lit.rate_e_per_s = {30, 30, 30};
  EXPECT_NE(refusal(lit, picture).find("below the darks"), std::string::npos);  // brighter than the picture
  const PerSite<double> masked = site_means(true_dark_dn(small, {4, 20}));
  EXPECT_EQ(refusal(small, picture, {.masked_dn = masked}), "");
  lit.rate_e_per_s = {8, 8, 8};  // not above the picture, but above its masked pixels: 32 e- are 26 DN
  EXPECT_NE(refusal(lit, picture, {.masked_dn = masked}).find("masked pixels"), std::string::npos);
  lit.shading = 1;
  EXPECT_NE(refusal(lit, picture).find("light reaches the sensor"), std::string::npos);
}

TEST(DarkFrame, FramesThatDoNotBelongToThePictureAreRefused) {
  const auto with = [](auto change) {
    RawDn picture = picture_of(small, {4, 20}, 20);
    change(picture);
    return refusal(small, picture);
  };
  EXPECT_EQ(with([](RawDn&) {}), "");
  EXPECT_NE(with([](RawDn& p) { p.info.iso = 800; }).find("ISO"), std::string::npos);
  EXPECT_NE(with([](RawDn& p) { p.info.model = "other"; }).find("camera"), std::string::npos);
  EXPECT_NE(with([](RawDn& p) { p.active.width = 94; }).find("pixels"), std::string::npos);
  EXPECT_NE(with([](RawDn& p) { p.phase = BayerPhase::rggb; }).find("mosaic"), std::string::npos);
  EXPECT_NE(with([](RawDn& p) { p.info.exposure_s.reset(); }).find("exposure time"), std::string::npos);
  EXPECT_NE(with([](RawDn& p) { p.layout = SensorLayout::linear_rgb; }).find("demosaiced"), std::string::npos);
}

TEST(DarkFrame, SaturatedDarksAndRequestsOutOfRangeAreRefused) {
  SensorBench bright = small;
  bright.rate_e_per_s = {1e5, 1e5, 1e5};
  bright.sensor.full_well_e = 1e5;
  EXPECT_NE(refusal(bright, bright.frame({4, 20}, 1)).find("saturated"), std::string::npos);
  const RawDn picture = picture_of(small, {4, 20}, 20);
  for (const double share : {0.0, -1.0, 1.1, std::nan("")}) {
    EXPECT_NE(refusal(small, picture, {.noise_fraction = share}).find("fraction of variance"), std::string::npos)
        << share;
  }
  EXPECT_NE(refusal(small, picture, {.doubling_c = 1}).find("doubling"), std::string::npos);
  EXPECT_FALSE(make_dark_frame({}, picture, {}));
}

TEST(DarkLibrary, SortsFramesBySettingAndRefusesOthers) {
  DarkLibrary library;
  for (const isp::Exposure& e : {isp::Exposure{1, 20}, {4, 20}, {1, 20.5}, {4, 30}, {1, 19.2}}) {
    ASSERT_TRUE(library.add(small.frame(e, 1)));
  }
  const auto groups = library.groups();
  ASSERT_EQ(groups.size(), 3U);
  EXPECT_EQ(groups[0].frames, 3);
  EXPECT_EQ(groups[1].frames, 1);
  RawDn other = small.frame({1, 20}, 1);
  other.info.iso = 100;
  EXPECT_FALSE(library.add(other));
  for (int i = 0; i < 5; ++i) EXPECT_TRUE(library.add(small.frame({10.0 + i, 20}, 1)));
  EXPECT_EQ(library.add(small.frame({20, 20}, 1)).error().code, ErrorCode::too_large);
}

}  // namespace
}  // namespace lowlux::calib::dark_frame_test
