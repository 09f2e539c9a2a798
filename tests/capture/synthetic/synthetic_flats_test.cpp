#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <ostream>
#include <string>
#include <vector>

#include "isp/model/sensor/noise_budget.h"
#include "tests/reference/poisson_ref.h"
#include "tests/support/sensor_frames.h"

// Flat fields against closed forms and against the exact law of their codes.
namespace lowlux::capture {
namespace {

using isp::Effect;
using isp::NoiseSourceSet;

constexpr NoiseSourceSet everything = NoiseSourceSet::all();

struct FlatCase {
  const char* name;
  double signal_e, dark_e, read_noise_e, gain_dn_per_e;
  double full_well_e;
  int bits;
  double black_dn;
  Quantisation quantisation;
};

std::ostream& operator<<(std::ostream& out, const FlatCase& c) { return out << c.name; }

constexpr auto nearest = Quantisation::round;
constexpr auto below = Quantisation::floor;

const FlatCase flats[] = {
    {"nothing_at_all", 0, 0, 0, 1, 5000, 12, 64, nearest},
    {"read_noise_alone", 0, 0, 3, 2, 5000, 14, 256, nearest},
    {"read_noise_alone_below", 0, 0, 3, 2, 5000, 14, 256, below},
    {"read_noise_cut_at_zero", 0, 0, 4, 1, 5000, 12, 0, nearest},
    {"dark_alone", 0, 215, 4, 0.5, 9000, 12, 100, nearest},
    {"thesis_dark", 0, 215, 4, 0.028334, 9000, 8, 0, below},
    {"thesis_tenth_candela", 9, 215, 4, 0.028334, 9000, 8, 0, below},
    {"thesis_near_full", 8700, 215, 4, 0.028334, 9000, 8, 0, below},
    {"third_of_an_electron", 0.3, 0, 0.25, 7.42, 7500, 12, 64, nearest},
    {"third_of_an_electron_coarse", 0.3, 0.1, 1.5, 0.3, 5000, 10, 32, nearest},
    {"third_of_an_electron_below", 0.3, 0, 1.5, 1, 5000, 12, 64, below},
    {"five_electrons", 5, 0, 1.5, 1, 5000, 12, 64, nearest},
    {"five_electrons_without_read_noise", 5, 0, 0, 0.7, 5000, 12, 64, below},
    {"five_electrons_and_dark", 5, 20, 2, 3.5, 4000, 14, 512, below},
    {"hundred_electrons", 100, 0, 2, 2, 8000, 14, 256, nearest},
    {"hundred_electrons_and_dark", 100, 30, 5, 0.25, 8000, 10, 16, below},
    {"three_thousand_electrons", 3000, 10, 3, 1.1, 15000, 14, 256, nearest},
    {"three_thousand_fill_the_well", 3000, 0, 3, 1, 3000, 12, 64, nearest},
    {"three_thousand_above_the_converter", 3000, 0, 3, 0.35, 9000, 10, 16, below},
    {"far_above_saturation", 50000, 0, 3, 0.5, 4000, 14, 256, nearest},
};

SensorModel sensor_of(const FlatCase& c) {
  SensorModel s;
  s.system_gain_dn_per_e = c.gain_dn_per_e;
  s.read_noise_e = c.read_noise_e;
  s.full_well_e = c.full_well_e;
  s.bits = c.bits;
  s.black_level_dn = c.black_dn;
  s.white_level_dn = std::exp2(c.bits) - 1;
  s.quantisation = c.quantisation;
  s.dark_current_e_per_s.fill(c.dark_e);
  return s;
}

/// Mean, variance and fourth central moment.
struct Moments4 {
  double mean = 0, variance = 0, fourth = 0;
};

/// Charges of a Poisson law that hold all but 1e-12 of it, with their probabilities; those beyond full are full.
struct Charge {
  double e, probability;
};

std::vector<Charge> charge_law(const SensorModel& s, double mean_e) {
  const double reach = 8 * std::sqrt(mean_e) + 30;
  std::vector<Charge> law;
  double full = 0;
  for (double k = std::max(0.0, std::floor(mean_e - reach)); k <= mean_e + reach; ++k) {
    const double probability = reference::poisson_probability(k, mean_e);
    if (k < s.full_well_e) {
      law.push_back({k, probability});
    } else {
      full += probability;
    }
  }
  if (full > 0) law.push_back({s.full_well_e, full});
  return law;
}

double normal_cdf(double z) { return 0.5 * std::erfc(-z / std::numbers::sqrt2); }

/// Exact moments of the codes: each charge spreads over codes by the normal law of the read noise.
Moments4 moments_of_codes(const SensorModel& s, double mean_e) {
  const auto largest = static_cast<int>(s.white_level_dn);
  const double sigma_dn = s.system_gain_dn_per_e * s.read_noise_e;
  const double edge = s.quantisation == Quantisation::round ? 0.5 : 0;  // a code holds [code - edge, code - edge + 1)
  std::vector<double> law(static_cast<std::size_t>(largest) + 1);
  for (const Charge& charge : charge_law(s, mean_e)) {
    const double at = s.black_level_dn + s.system_gain_dn_per_e * charge.e;
    if (sigma_dn == 0) {
      const double code = edge > 0 ? std::nearbyint(at) : std::floor(at);
      law[static_cast<std::size_t>(std::clamp(code, 0.0, s.white_level_dn))] += charge.probability;
      continue;
    }
    const int first = std::clamp(static_cast<int>(at - 9 * sigma_dn) - 1, 0, largest);
    const int last = std::clamp(static_cast<int>(at + 9 * sigma_dn) + 1, 0, largest);
    for (int code = first; code <= last; ++code) {
      const double low = code == 0 ? -INFINITY : (code - edge - at) / sigma_dn;
      const double high = code == largest ? INFINITY : (code - edge + 1 - at) / sigma_dn;
      law[static_cast<std::size_t>(code)] += charge.probability * (normal_cdf(high) - normal_cdf(low));
    }
  }
  Moments4 m;
  double whole = 0;
  for (std::size_t code = 0; code < law.size(); ++code) {
    whole += law[code];
    m.mean += law[code] * static_cast<double>(code);
  }
  EXPECT_NEAR(whole, 1, 1e-9) << "the law is whole";
  for (std::size_t code = 0; code < law.size(); ++code) {
    const double square = (static_cast<double>(code) - m.mean) * (static_cast<double>(code) - m.mean);
    m.variance += law[code] * square;
    m.fourth += law[code] * square * square;
  }
  return m;
}

void expect_moments(const Plane<float>& dn, const Moments4& expected) {
  const auto n = static_cast<double>(dn.size());
  const test::SampleMoments found = test::moments_of(test::samples_of(dn));
  const double spread = expected.fourth - expected.variance * expected.variance * (n - 3) / (n - 1);
  // 1e-6 relative: float arithmetic of the readout. Five standard errors otherwise.
  EXPECT_NEAR(found.mean, expected.mean, 5 * std::sqrt(expected.variance / n) + 1e-6 * expected.mean);
  EXPECT_NEAR(found.variance, expected.variance,
              5 * std::sqrt(std::max(0.0, spread) / n) + 1e-6 * (1 + expected.variance));
}

class FlatFields : public testing::TestWithParam<FlatCase> {};

TEST_P(FlatFields, CodesHaveTheMomentsOfTheirExactLaw) {
  const FlatCase& c = GetParam();
  const SensorModel s = sensor_of(c);
  expect_moments(test::flat_dn(s, everything, {.rate_e_per_s = c.signal_e, .seed = 11}),
                 moments_of_codes(s, c.signal_e + c.dark_e));
}

TEST_P(FlatFields, WithoutQuantisationAndClippingTheBudgetIsExact) {
  const FlatCase& c = GetParam();
  const SensorModel s = sensor_of(c);
  const double k = s.system_gain_dn_per_e, mu = c.signal_e + c.dark_e, sigma2 = c.read_noise_e * c.read_noise_e;
  // Central moments of Poisson(mu) plus Normal(0, sigma^2): v = mu + sigma^2 and 3 v^2 + mu.
  const double v = mu + sigma2;
  const Moments4 expected{s.black_level_dn + k * mu, k * k * v, k * k * k * k * (3 * v * v + mu)};
  EXPECT_NEAR(expected.variance, isp::variance_dn2(s, {c.signal_e, c.dark_e}) - 1.0 / 12,
              1e-9 * (1 + expected.variance));
  expect_moments(test::flat_dn(s, everything.without(Effect::quantisation).without(Effect::clipping),
                               {.rate_e_per_s = c.signal_e, .seed = 12}),
                 expected);
}

TEST_P(FlatFields, ClippedButNotQuantisedTheyAreAMixtureOfClampedNormals) {
  const FlatCase& c = GetParam();
  const SensorModel s = sensor_of(c);
  double mean = 0, square = 0;  // about black, so that few digits cancel
  for (const Charge& charge : charge_law(s, c.signal_e + c.dark_e)) {
    const double sigma_dn = s.system_gain_dn_per_e * s.read_noise_e;
    const isp::Moments one = isp::clamped_normal(
        {s.black_level_dn + s.system_gain_dn_per_e * charge.e, sigma_dn * sigma_dn}, 0, s.white_level_dn);
    mean += charge.probability * (one.mean - s.black_level_dn);
    square += charge.probability * (one.variance + (one.mean - s.black_level_dn) * (one.mean - s.black_level_dn));
  }
  const double variance = square - mean * mean;
  const test::SampleMoments found = test::moments_of(test::samples_of(
      test::flat_dn(s, everything.without(Effect::quantisation), {.rate_e_per_s = c.signal_e, .seed = 13})));
  // 1e-6: float arithmetic, and the mixture's cancellation where all pixels are full. Five standard errors otherwise.
  EXPECT_NEAR(found.mean, s.black_level_dn + mean, 5 * found.mean_error + 1e-6 * (s.black_level_dn + mean));
  EXPECT_NEAR(found.variance, variance, 5 * found.variance_error + 1e-6 * (1 + variance));
}

INSTANTIATE_TEST_SUITE_P(TwentySensors, FlatFields, testing::ValuesIn(flats),
                         [](const auto& instance) { return std::string(instance.param.name); });

TEST(FlatFields, EffectsLeftOutLeaveTheirShareOut) {
  const FlatCase c{"", 400, 50, 3, 1.5, 9000, 14, 256, nearest};
  const SensorModel s = sensor_of(c);
  const double k2 = 1.5 * 1.5;
  const struct {
    Effect left_out;
    double mean_e, variance_dn2;
  } expected[] = {
      {Effect::photon_noise, 450, k2 * (50 + 9) + 1.0 / 12},
      {Effect::dark_current, 400, k2 * (400 + 9) + 1.0 / 12},
      {Effect::read_noise, 450, k2 * 450},  // codes of whole electrons lie on a lattice: see below
      {Effect::quantisation, 450, k2 * (450 + 9)},
      {Effect::clipping, 450, k2 * (450 + 9) + 1.0 / 12},
  };
  for (const auto& e : expected) {
    const test::SampleMoments found = test::moments_of(
        test::samples_of(test::flat_dn(s, everything.without(e.left_out), {.rate_e_per_s = 400, .seed = 5})));
    // 256 + 1.5 k lies half a code from one where k is odd: halves go to even codes, so the mean stays and the
    // variance grows by a quarter times one half.
    const double lattice = e.left_out == Effect::read_noise ? 0.125 : 0;
    EXPECT_NEAR(found.mean, 256 + 1.5 * e.mean_e, 5 * found.mean_error) << static_cast<int>(e.left_out);
    EXPECT_NEAR(found.variance, e.variance_dn2 + lattice, 5 * found.variance_error) << static_cast<int>(e.left_out);
  }
}

TEST(FlatFields, DarkChargeDoublesWithEveryDoublingTemperature) {
  FlatCase c{"", 0, 100, 0, 1, 9000, 14, 0, nearest};
  SensorModel s = sensor_of(c);
  s.dark_doubling_c = 8;
  for (const double steps : {-2.0, 0.0, 0.5, 3.0}) {
    const test::SampleMoments found =
        test::moments_of(test::samples_of(test::flat_dn(s, everything, {.exposure = {2, 20 + 8 * steps}, .seed = 3})));
    const double expected_e = 200 * std::exp2(steps);
    EXPECT_NEAR(found.mean, expected_e, 5 * std::sqrt(expected_e / (512 * 256))) << steps;
    EXPECT_NEAR(found.variance, expected_e, 5 * found.variance_error) << steps;
  }
}

}  // namespace
}  // namespace lowlux::capture
