#include "isp/reproduce/thesis_sensor.h"

#include <gtest/gtest.h>

#include <cmath>
#include <set>

#include "isp/metrics/statistics.h"
#include "isp/model/colour/dark_desaturation.h"
#include "isp/model/spectrum/cie_data.h"
#include "isp/reproduce/sampled_light.h"
#include "isp/reproduce/sensor_scenario.h"

namespace lowlux::isp {
namespace {

const ThesisCamera& camera() {
  static const ThesisCamera the = *thesis_camera();
  return the;
}

Patch white_patch() {
  const Spectrum light = *at_full_level(*light_named("D65"));
  return {"white", light, *xy_of(xyz_of(light)), signal_charge_e(camera(), light)};
}

// Mean and variance of one channel over samples, against what is expected, in standard errors. Var(S^2) of a variable
// with fourth central moment m4 is (m4 - Var^2) / n; for Poisson m4 = Var (1 + 3 Var).
void expect_poisson(const std::vector<double>& e, double mean) {
  const double n = static_cast<double>(e.size());
  const Estimate found = mean_of(e);
  const double variance = found.standard_error * found.standard_error * n;
  EXPECT_NEAR(found.value, mean, 5 * std::sqrt(mean / n)) << mean;
  EXPECT_NEAR(variance, mean, 5 * std::sqrt((mean * (1 + 3 * mean) - mean * mean) / n)) << mean;
}

TEST(PoissonCounts, HaveTheirMeanAsVarianceOnBothSidesOfTheSamplersLimit) {
  std::uint32_t row = 0;
  for (const double mean : {0.1, 1.0, 26.0, 1e4, 9.9e5, 1.01e6, 1e12}) {
    std::vector<double> counts;
    for (std::uint32_t i = 0; i < 20000; ++i) counts.push_back(poisson_count({11, 0, 16}, i, row, mean));
    expect_poisson(counts, mean);
    EXPECT_EQ(counts[7], std::round(counts[7]));
    ++row;
  }
  EXPECT_EQ(poisson_count({11, 0, 16}, 0, 0, 0), 0);
}

TEST(ThesisCamera, APerfectWhiteAtFullLevelFillsTheBestChannel) {
  const Vector3 e = white_patch().signal_e;
  EXPECT_NEAR(std::max({e[0], e[1], e[2]}), 9000, 1e-9);
  EXPECT_NEAR(camera().sensor.system_gain_dn_per_e * 9000, 255, 0.01);  // Table 4-1
  EXPECT_NEAR(683 * xyz_of(white_patch().radiance).y, 100, 1e-12);
  for (const Spectrum& qe : camera().response.quantum_efficiency) {
    for (const double value : qe.values()) EXPECT_LE(value, 1);
  }
}

TEST(ThesisCamera, MatrixIsExactForSumsOfColourMatchingFunctions) {
  // Eq. 4.14 is built so; on the camera's own nodes, 0.3 xbar + 0.5 ybar + 0.2 zbar.
  const auto nm = camera().response.quantum_efficiency[0].wavelengths_nm();
  std::vector<double> values;
  for (const double w : nm) {
    double v = 0;
    for (int k = 0; k < 3; ++k) v += Vector3{0.3, 0.5, 0.2}[k] * cie_1931_observer()[k].at(w);
    values.push_back(v);
  }
  const Spectrum light = *at_full_level(*Spectrum::of({nm.begin(), nm.end()}, values));
  const Xyz truth = xyz_of(light), seen = xyz_of_charge(camera(), signal_charge_e(camera(), light));
  EXPECT_NEAR(seen.x / (683 * truth.x), 1, 1e-4);  // the sums of Eq. 4.14 give the two end nodes their whole width
  EXPECT_NEAR(seen.y / 100, 1, 1e-4);
  EXPECT_NEAR(seen.z / (683 * truth.z), 1, 1e-4);
}

TEST(ThesisPatches, SpanTheGamutWithoutRepeatingAndBeginWithTheSame) {
  const auto twenty = *thesis_patches(camera(), 20);
  const auto thirteen = *thesis_patches(camera(), 13);
  std::set<std::string> names;
  double before = 1e9;
  for (std::size_t i = 0; i < twenty.size(); ++i) {
    EXPECT_TRUE(names.insert(twenty[i].name).second);
    EXPECT_NEAR(683 * xyz_of(twenty[i].radiance).y, 100, 1e-10);
    if (i < 13) {
      EXPECT_EQ(thirteen[i].name, twenty[i].name);
    }
    if (i == 0) continue;
    double nearest = 1e9;  // to those before: what farthest-point choice makes fall
    for (std::size_t j = 0; j < i; ++j) nearest = std::min(nearest, distance(twenty[i].xy, twenty[j].xy));
    EXPECT_LE(nearest, before);
    before = nearest;
  }
  EXPECT_GT(before, 0.02);  // even the last is far from all others
  for (const int wrong : {-1, 0, 601}) EXPECT_FALSE(thesis_patches(camera(), wrong)) << wrong;
  EXPECT_EQ(thesis_patches(camera(), 600)->size(), 600u);
}

TEST(Photographs, PhysicalElectronsArePoissonAndChannelsIndependent) {
  const Patch white = white_patch();
  for (const double level : {0.0001, 0.01, 1.0}) {
    const auto samples = photograph(camera(), white, level, {.dark = true}, {3, 0, 0}, 20000);
    std::array<std::vector<double>, 3> e;
    for (const Vector3& dn : samples.dn) {
      for (int k = 0; k < 3; ++k) e[k].push_back(dn[k] / camera().sensor.system_gain_dn_per_e);
    }
    const double red = mean_of(e[0]).value, green = mean_of(e[1]).value;
    double correlation = 0;
    for (std::size_t i = 0; i < e[0].size(); ++i) correlation += (e[0][i] - red) * (e[1][i] - green);
    correlation /= 20000 * std::sqrt((level * white.signal_e[0] + 195) * (level * white.signal_e[1] + 230));
    EXPECT_LT(std::fabs(correlation), 5 / std::sqrt(20000.0));
    for (int k = 0; k < 3; ++k) {
      expect_poisson(e[k], level * white.signal_e[k] + camera().sensor.dark_current_e_per_s[k]);
    }
  }
}

TEST(Photographs, ChargesBeyondTheExactSamplerKeepMeanAndVariance) {
  const Patch white = white_patch();
  const double level = 1e9;  // 9e12 e-: scenario I with the light of 1 m2 sr
  const auto samples = photograph(camera(), white, level, {}, {3, 0, 0}, 20000);
  for (int k = 0; k < 3; ++k) {
    std::vector<double> e;
    for (const Vector3& dn : samples.dn) e.push_back(dn[k] / camera().sensor.system_gain_dn_per_e);
    expect_poisson(e, level * white.signal_e[k]);
  }
}

TEST(Photographs, PublishedSamplingHasTooLittleVarianceAndCorrelatesTheChannels) {
  const Patch white = white_patch();
  const int n = 4000;
  const auto samples =
      photograph(camera(), white, 0.01, {.sampling = capture::PhotonSampling::published}, {3, 0, 0}, n);
  const auto photons = *photon_radiance(white.radiance);
  const auto& qe = camera().response.quantum_efficiency;
  const double scale = 0.01 * camera().response.etendue_m2_sr;
  const auto moment = [&](int a, int b) {
    return scale * integrate(photons, [&](double nm) { return qe[a].at(nm) * qe[b].at(nm); });
  };
  const Vector3 mean{0.01 * white.signal_e[0], 0.01 * white.signal_e[1], 0.01 * white.signal_e[2]};
  for (int a = 0; a < 3; ++a) {
    for (int b = 0; b <= a; ++b) {
      double sum = 0;
      for (const Vector3& dn : samples.dn) {
        const double gain = camera().sensor.system_gain_dn_per_e;
        sum += (dn[a] / gain - mean[a]) * (dn[b] / gain - mean[b]) / n;
      }
      const double expected = moment(a, b);
      const double error = std::sqrt((moment(a, a) * moment(b, b) + expected * expected) / n);
      EXPECT_NEAR(sum, expected, 5 * error) << a << b;
      EXPECT_GT(expected, 0);
      if (a == b) {
        EXPECT_LT(expected, 0.9 * mean[a]);
      }
    }
  }
}

TEST(Photographs, TheIntegerPartTakesHalfACodeWhereNoiseDithers) {
  const Patch white = white_patch();
  const int n = 20000;
  Noises noises{true, true, true, Quantisation::floor};
  const auto low = *mean_code(photograph(camera(), white, 0.1, noises, {3, 0, 0}, n).dn);
  noises.quantisation = Quantisation::round;
  const auto near = *mean_code(photograph(camera(), white, 0.1, noises, {3, 0, 0}, n).dn);
  for (int k = 0; k < 3; ++k) {
    const double e = 0.1 * white.signal_e[k] + camera().sensor.dark_current_e_per_s[k];
    const double gain = camera().sensor.system_gain_dn_per_e;
    const double error = std::sqrt((gain * gain * (e + 16) + 1.0 / 12) / n);
    // Dither of 0.65 to 0.95 DN leaves up to 2 exp(-2 pi^2 0.65^2) / (2 pi) = 8e-5 DN of the quantiser's own pattern.
    EXPECT_NEAR(near[k], gain * e, 5 * error + 1e-4) << k;
    EXPECT_NEAR(low[k], gain * e - 0.5, 5 * error + 1e-4) << k;
  }
}

TEST(Photographs, SaturatedSamplesAreCountedAndLeftOut) {
  Noises noises{true, true, true, Quantisation::floor};
  const auto bright = photograph(camera(), white_patch(), 2, noises, {3, 0, 0}, 50);
  EXPECT_EQ(bright.saturated, 50);
  EXPECT_TRUE(bright.dn.empty());
  EXPECT_FALSE(mean_code(bright.dn));
  const auto dim = photograph(camera(), white_patch(), 0.5, noises, {3, 0, 0}, 50);
  EXPECT_EQ(dim.saturated, 0);
  EXPECT_EQ(dim.dn.size(), 50u);
  noises.converter = false;
  EXPECT_EQ(photograph(camera(), white_patch(), 2, noises, {3, 0, 0}, 50).saturated, 0);
}

TEST(Photographs, WithoutLightAndDarkThereIsNoChromaticity) {
  const auto nothing = photograph(camera(), white_patch(), 0, {}, {3, 0, 0}, 10);
  EXPECT_EQ(*mean_code(nothing.dn), (Vector3{0, 0, 0}));
  EXPECT_TRUE(chromaticities(camera(), nothing.dn).empty());
  EXPECT_FALSE(sensor_cloud(camera(), {0, 0, 0}, {0, 0, 0}));
}

TEST(SensorScenario, ExpectationsAreOnTheLineOfEq423) {
  const auto levels = *run_scenario(camera(), *thesis_patches(camera(), 5), {{.dark = true}, 0, 3}, 1);
  const Xy black = *xy_of(xyz_of_charge(camera(), dark_charge_e(camera())));
  ASSERT_EQ(levels.size(), std::size(sensor_levels));
  for (const LevelResult& level : levels) {
    for (const PatchResult& p : level.patches) {
      const Xy& m = p.expected.mean;
      const double cross = (m.x - black.x) * (p.truth.y - black.y) - (m.y - black.y) * (p.truth.x - black.x);
      EXPECT_NEAR(cross, 0, 1e-15);  // roundings of products below 0.3
      EXPECT_LT(distance(m, black), distance(p.truth, black));
    }
  }
}

TEST(SensorScenario, SampledCloudsHaveThePredictedCovariance) {
  const int n = 1000;
  const auto levels = *run_scenario(camera(), *thesis_patches(camera(), 8), {{.dark = true, .read = true}, 0, n}, 1);
  for (std::size_t l = 0; l < 3; ++l) {  // 10 cd/m2 and brighter: relative noise of a few percent, so first order holds
    for (const PatchResult& p : levels[l].patches) {
      ASSERT_TRUE(p.sampled);
      EXPECT_LT(worst_covariance_error(p.sampled->covariance, p.expected.covariance, n), 5) << l;
      EXPECT_LT(mean_error(*p.mean_code_xy, p.expected.mean, p.expected.covariance, n), 5) << l;
    }
  }
}

TEST(NoticeableDifferences, AreThreeDeviationsOfMacAdamsAlongEachAxis) {
  // First centre: 0.160 0.057, semi-axes 0.85e-3 and 0.35e-3 at 62.5 degrees.
  const double a = 62.5 * 3.14159265358979323846 / 180;
  const Xy centre{0.16, 0.057};
  EXPECT_NEAR(noticeable_differences(centre, {0.16 + 3 * 0.85e-3 * std::cos(a), 0.057 + 3 * 0.85e-3 * std::sin(a)}), 1,
              1e-9);
  EXPECT_NEAR(noticeable_differences(centre, {0.16 - 3 * 0.35e-3 * std::sin(a), 0.057 + 3 * 0.35e-3 * std::cos(a)}), 1,
              1e-9);
  EXPECT_EQ(noticeable_differences(centre, centre), 0);
}

}  // namespace
}  // namespace lowlux::isp
