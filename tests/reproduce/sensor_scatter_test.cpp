#include "isp/reproduce/sensor_scatter.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "isp/metrics/statistics.h"

namespace lowlux::isp::sensor_scatter_test {
namespace {

const ThesisCamera& camera() {
  static const ThesisCamera the = *thesis_camera();
  return the;
}

const std::vector<Patch>& thirteen() {
  static const std::vector<Patch> the = *thesis_patches(camera(), scenario_ii_patches);
  return the;
}

double mean_delta_e(const LevelResult& level) {
  return mean_over(level, [](const PatchResult& p) { return p.delta_e_ab; });
}

// Compares mean Delta E ab over 13 patches of 200 samples with figures that were computed by an independent program
// from the same equations: printed with two digits, and drawn as often.
void expect_delta_e(const Scenario& scenario, const std::vector<double>& independent) {
  const auto levels = run_scenario(camera(), thirteen(), scenario, 1);
  ASSERT_TRUE(levels);
  ASSERT_EQ(levels->size(), independent.size());
  for (std::size_t i = 0; i < independent.size(); ++i) {
    const double ours = mean_delta_e((*levels)[i]);
    // A distance's deviation is about 0.6 of its mean (0.52 for two dimensions, 0.75 for one); both figures are drawn.
    const double drawn = 5 * std::sqrt(2.0) * 0.75 * ours / std::sqrt(13 * 200.0);
    const double printed = independent[i] < 10 ? 0.05 : 0.5;
    EXPECT_NEAR(ours, independent[i], drawn + printed) << 100 * (*levels)[i].level << " cd/m2";
  }
}

TEST(SensorScatter, DeltaEOfPhotonNoiseIsThatOfAnIndependentProgram) {
  expect_delta_e({{}, 0x10, 200}, {1.8, 2.5, 5.6, 7.8, 18, 25, 67});
}

TEST(SensorScatter, DeltaEWithDarkCurrentIsThatOfAnIndependentProgram) {
  expect_delta_e({{.dark = true}, 0x20, 200}, {5.8, 10.6, 33.5, 47, 73, 80, 86});
}

}  // namespace
}  // namespace lowlux::isp::sensor_scatter_test
