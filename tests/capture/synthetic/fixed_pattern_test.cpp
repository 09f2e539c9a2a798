#include "capture/synthetic/fixed_pattern.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "tests/support/sensor_frames.h"

// Fixed patterns and banding of simulated flats: standard deviations against the sensor's figures.
namespace lowlux::capture::fixed_pattern_test {
namespace {

using isp::Effect;
using isp::NoiseSourceSet;

constexpr int width = 512, height = 256;

SensorModel quiet_sensor() {
  SensorModel s;
  s.full_well_e = 60000;
  s.bits = 16;
  s.black_level_dn = 1000;
  s.white_level_dn = 65535;
  return s;
}

/// Without noise that would hide the pattern: what is asked for, in DN of one electron each.
Plane<float> pattern(const SensorModel& s, NoiseSourceSet kept, double rate_e_per_s, std::uint64_t seed = 1,
                     std::uint32_t frame = 0) {
  return test::flat_dn(s, kept, {width, height, rate_e_per_s, {}, seed, frame});
}

bool same(const Plane<float>& a, const Plane<float>& b) { return std::equal(a.data(), a.data() + a.size(), b.data()); }

/// Correlation of two planes, whose standard error is 1 / sqrt(n) where there is none.
double correlation(const Plane<float>& a, const Plane<float>& b) {
  const auto va = test::samples_of(a), vb = test::samples_of(b);
  const auto ma = test::moments_of(va), mb = test::moments_of(vb);
  double sum = 0;
  for (std::size_t i = 0; i < va.size(); ++i) sum += (va[i] - ma.mean) * (vb[i] - mb.mean);
  return sum / (static_cast<double>(va.size()) * std::sqrt(ma.variance * mb.variance));
}

void expect_moments(const std::vector<double>& sample, double mean, double variance) {
  const test::SampleMoments found = test::moments_of(sample);
  EXPECT_NEAR(found.mean, mean, 5 * std::sqrt(variance / static_cast<double>(sample.size())));
  EXPECT_NEAR(found.variance, variance, 5 * found.variance_error);
}

TEST(FixedPattern, PrnuSpreadsTheSignalByItsShare) {
  SensorModel s = quiet_sensor();
  s.prnu = 0.02;
  expect_moments(test::samples_of(pattern(s, {Effect::prnu}, 1000)), 2000, 400);
}

TEST(FixedPattern, PrnuLeavesDarkChargeAlone) {
  SensorModel s = quiet_sensor();
  s.prnu = 0.5;
  s.dark_current_e_per_s.fill(500);
  EXPECT_TRUE(same(pattern(s, {Effect::prnu, Effect::dark_current}, 0), pattern(s, {Effect::dark_current}, 0)));
}

TEST(FixedPattern, FrameMeansOfManyNoisyFramesShowPrnuAndDsnuTogether) {
  SensorModel s = quiet_sensor();
  s.prnu = 0.05;
  s.dsnu = 0.2;
  s.dark_current_e_per_s.fill(100);
  s.read_noise_e = 2;
  constexpr int frames = 16;
  std::vector<double> mean(static_cast<std::size_t>(width) * height);
  for (std::uint32_t f = 0; f < frames; ++f) {
    const Plane<float> one = pattern(s, NoiseSourceSet::all().without(Effect::quantisation), 400, 1, f);
    for (std::size_t i = 0; i < mean.size(); ++i) mean[i] += one.data()[i] / frames;
  }
  // (0.05 x 400)^2 + (0.2 x 100)^2 of the pattern, (500 + 4) / 16 of the noise that is left
  expect_moments(mean, 1500, 400 + 400 + 504.0 / frames);
}

TEST(FixedPattern, ANonUniformityOfOneNeverTurnsChargeNegative) {
  SensorModel s = quiet_sensor();
  s.prnu = 1;
  // max(0, 1 + z): mean Phi(1) + phi(1), second moment 2 Phi(1) + phi(1)
  const double Phi = 0.841344746068543, phi = 0.241970724519143;
  const double mean = Phi + phi, variance = 2 * Phi + phi - mean * mean;
  expect_moments(test::samples_of(pattern(s, {Effect::prnu}, 1000)), 1000 + 1000 * mean, 1e6 * variance);
}

TEST(FixedPattern, HotPixelsHaveTheirNumberAndAnExponentialCharge) {
  const SensorModel s = [] {
    SensorModel hot = quiet_sensor();
    hot.hot_pixel_fraction = 0.03;
    hot.hot_pixel_current_e_per_s = 700;
    hot.full_well_e = 9e5;
    return hot;
  }();
  // Means straight from the pattern: what read-out adds to them is tested elsewhere.
  std::vector<double> hot;
  std::vector<float> charge(width);
  std::vector<std::uint32_t> words(width);
  for (std::uint32_t y = 0; y < height; ++y) {
    std::fill(charge.begin(), charge.end(), 10.0f);
    add_hot_pixels({5, 0, y}, s.hot_pixel_fraction, s.hot_pixel_current_e_per_s, charge, words);
    for (const float q : charge) {
      if (q > 10) hot.push_back(q - 10);
    }
  }
  const double n = width * height, share = 0.03;
  EXPECT_NEAR(static_cast<double>(hot.size()), n * share, 5 * std::sqrt(n * share * (1 - share)));
  expect_moments(hot, 700, 700 * 700);
  // A third figure of the law: the share above the mean is 1/e.
  const auto above = std::count_if(hot.begin(), hot.end(), [](double q) { return q > 700; });
  const double p = std::exp(-1.0), hots = static_cast<double>(hot.size());
  EXPECT_NEAR(static_cast<double>(above), hots * p, 5 * std::sqrt(hots * p * (1 - p)));
}

TEST(FixedPattern, NoPixelIsHotAtAFractionOfZeroAndAllAreAtOne) {
  std::vector<float> charge(1000, 0.0f);
  std::vector<std::uint32_t> words(1000);
  add_hot_pixels({}, 0, 700, charge, words);
  EXPECT_EQ(std::count(charge.begin(), charge.end(), 0.0f), 1000);
  add_hot_pixels({}, 1, 700, charge, words);
  EXPECT_EQ(std::count(charge.begin(), charge.end(), 0.0f), 0);
}

TEST(Telegraph, HasVarianceAndKurtosisOfItsLawAndTheSamePixelsInAllFrames) {
  SensorModel s = quiet_sensor();
  s.telegraph_fraction = 0.2;
  s.telegraph_e = 40;
  const double f = s.telegraph_fraction, a = s.telegraph_e, n = width * height;
  const Plane<float> first = pattern(s, {Effect::telegraph_noise}, 0, 3, 0);
  const Plane<float> second = pattern(s, {Effect::telegraph_noise}, 0, 3, 1);
  double sum = 0, square = 0, fourth = 0, differ = 0, traps = 0;
  for (std::size_t i = 0; i < first.size(); ++i) {
    const double z = first.data()[i] - 1000;
    ASSERT_NEAR(std::fabs(z), std::fabs(second.data()[i] - 1000), 1e-3) << "only the state changes";
    traps += z != 0;
    differ += first.data()[i] != second.data()[i];
    sum += z / n;
    square += z * z / n;
    fourth += z * z * z * z / n;
  }
  // E[A^j] = j! a^j, so E[z^j] = f j! (a/2)^j for even j.
  const auto moment = [&](int j) { return f * std::tgamma(j + 1) * std::pow(a / 2, j); };
  EXPECT_NEAR(sum, 0, 5 * std::sqrt(moment(2) / n));
  EXPECT_NEAR(square, isp::telegraph_variance_e2(s), 5 * std::sqrt((moment(4) - moment(2) * moment(2)) / n));
  EXPECT_NEAR(fourth, moment(4), 5 * std::sqrt((moment(8) - moment(4) * moment(4)) / n));
  EXPECT_NEAR(traps / n, f, 5 * std::sqrt(f * (1 - f) / n));
  EXPECT_NEAR(differ / traps, 0.5, 5 * std::sqrt(0.25 / traps));
  EXPECT_FALSE(same(first, pattern(s, {Effect::telegraph_noise}, 0, 4, 0))) << "another sensor";
}

std::vector<double> first_column(const Plane<float>& plane) {
  std::vector<double> out;
  out.reserve(plane.height());
  for (int y = 0; y < plane.height(); ++y) out.push_back(plane.at(0, y));
  return out;
}

std::vector<double> first_row(const Plane<float>& plane) { return {plane.data(), plane.data() + plane.width()}; }

TEST(Banding, RowNoiseIsOneOffsetForEachRowAndDiffersByFrame) {
  SensorModel s = quiet_sensor();
  s.row_noise_e = 3;
  std::vector<double> offsets;
  for (std::uint32_t frame = 0; frame < 40; ++frame) {
    const Plane<float> dn = pattern(s, {Effect::row_noise}, 0, 1, frame);
    for (int y = 0; y < height; ++y) {
      ASSERT_EQ(dn.at(0, y), dn.at(width - 1, y));
      ASSERT_EQ(dn.at(0, y), dn.at(width / 2 + 1, y));
    }
    for (const double v : first_column(dn)) offsets.push_back(v);
  }
  expect_moments(offsets, 1000, 9);
  EXPECT_FALSE(same(pattern(s, {Effect::row_noise}, 0, 1, 0), pattern(s, {Effect::row_noise}, 0, 1, 1)));
}

TEST(Banding, ColumnNoiseIsOneOffsetForEachColumnInAllFrames) {
  SensorModel s = quiet_sensor();
  s.column_noise_e = 3;
  std::vector<double> offsets;
  for (std::uint64_t seed = 0; seed < 20; ++seed) {
    const Plane<float> dn = pattern(s, {Effect::column_noise}, 0, seed);
    for (int x = 0; x < width; ++x) ASSERT_EQ(dn.at(x, 0), dn.at(x, height - 1));
    for (const double v : first_row(dn)) offsets.push_back(v);
    EXPECT_TRUE(same(dn, pattern(s, {Effect::column_noise}, 0, seed, 7)));
  }
  expect_moments(offsets, 1000, 9);
}

TEST(FixedPattern, IsTheSameInAllFramesOfASeedAndAnotherWithAnotherSeed) {
  SensorModel s = quiet_sensor();
  s.prnu = 0.02;
  s.dsnu = 0.3;
  s.dark_current_e_per_s.fill(100);
  s.column_noise_e = 5;
  for (const Effect effect : {Effect::prnu, Effect::dsnu, Effect::column_noise}) {
    // Photon noise on the other charge would hide the pattern: dark is Poisson wherever it is kept, so DSNU is seen
    // through it, in the correlation of two frames.
    const NoiseSourceSet kept =
        effect == Effect::dsnu ? NoiseSourceSet{Effect::dark_current, Effect::dsnu} : NoiseSourceSet{effect};
    const double signal = effect == Effect::prnu ? 1000 : 0;
    const Plane<float> a = pattern(s, kept, signal, 1, 0), b = pattern(s, kept, signal, 1, 1),
                       other = pattern(s, kept, signal, 2, 0);
    // Of DSNU 900 e-^2 of 1000 are pattern; the other two leave nothing else.
    const double expected = effect == Effect::dsnu ? 0.9 : 1;
    const double samples = effect == Effect::column_noise ? width : width * height;
    // 2 / n: the sample variances divide by n - 1.
    EXPECT_NEAR(correlation(a, b), expected,
                5 * (1 - expected * expected) / std::sqrt(samples) + 2.0 / (width * height));
    EXPECT_NEAR(correlation(a, other), 0, 5 / std::sqrt(samples));
  }
}

TEST(FixedPattern, PatternsOfOneSeedAreIndependentOfEachOther) {
  SensorModel s = quiet_sensor();
  s.prnu = 0.02;
  s.dsnu = 0.9;
  s.dark_current_e_per_s.fill(1000);
  s.read_noise_e = 5;
  const Plane<float> prnu = pattern(s, {Effect::prnu}, 1000),
                     dsnu = pattern(s, {Effect::dark_current, Effect::dsnu}, 0),
                     read = pattern(s, {Effect::read_noise}, 0), photons = pattern(s, {Effect::photon_noise}, 1000);
  const double bound = 5 / std::sqrt(static_cast<double>(width) * height);
  EXPECT_LT(std::fabs(correlation(prnu, dsnu)), bound);
  EXPECT_LT(std::fabs(correlation(prnu, read)), bound);
  EXPECT_LT(std::fabs(correlation(prnu, photons)), bound);
  EXPECT_LT(std::fabs(correlation(dsnu, read)), bound);
  EXPECT_LT(std::fabs(correlation(read, photons)), bound);  // dsnu holds dark charge, of the same draw as photons
}

}  // namespace
}  // namespace lowlux::capture::fixed_pattern_test
