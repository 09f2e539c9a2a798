#include "capture/synthetic/sensor_sim.h"

#include <gtest/gtest.h>

#include <utility>

#include "capture/synthetic/block_levels.h"
#include "tests/support/sensor_frames.h"
#include "tests/support/synthetic_camera.h"

namespace lowlux::capture {
namespace {

using isp::Effect;
using isp::NoiseSourceSet;

EffectCost cost_of(Scene scene, const isp::NamedSensor& sensor, NoiseSourceSet effects) {
  SyntheticOptions options;
  options.effects.effects = effects;
  return test::source_of(std::move(scene), sensor, options)->measure_cost();
}

TEST(MeasureCost, IsGivenForWhatIsLeftOutAndForNothingElse) {
  isp::NamedSensor sensor = test::plain_sensor();
  sensor.model.read_noise_e = 3;
  const EffectCost all = cost_of(*flat_scene(test::setup_of(64, 300, 1)), sensor, NoiseSourceSet::all());
  EXPECT_GT(all.all_ms, 0);
  for (const auto& saved : all.saved_ms) EXPECT_FALSE(saved);
  const EffectCost some =
      cost_of(*flat_scene(test::setup_of(64, 300, 1)), sensor, NoiseSourceSet::all().without(Effect::read_noise));
  for (int i = 0; i < isp::effect_count; ++i) {
    EXPECT_EQ(some.saved_ms[i].has_value(), static_cast<Effect>(i) == Effect::read_noise) << i;
  }
  const EffectCost none = cost_of(*flat_scene(test::setup_of(1, 1, 1)), sensor, {});
  EXPECT_FALSE(none.saved_ms[static_cast<int>(Effect::prnu)]) << "the sensor has none";
  EXPECT_TRUE(none.saved_ms[static_cast<int>(Effect::photon_noise)]);
}

TEST(BlockLevels, AreTheMeansOfEachChannelAndTheBrightestPixel) {
  Plane<float> rate(70, 33);
  for (int y = 0; y < 33; ++y) {
    for (int x = 0; x < 70; ++x) {
      const int column = x / 32, electrons = 1 + static_cast<int>(colour_at(BayerPhase::grbg, x, y)) + 10 * column;
      rate.at(x, y) = static_cast<float>(electrons);
    }
  }
  rate.at(69, 32) += 5;
  const SensorModel sensor = test::plain_sensor().model;
  const auto blocks = block_levels({sensor, {.time_s = 2}, BayerPhase::grbg, std::as_const(rate).view()});
  ASSERT_EQ(blocks.size(), 6u);
  for (int i = 0; i < 3; ++i) {
    for (int k = 0; k < 3; ++k) EXPECT_DOUBLE_EQ(blocks[i].signal_e[k], 2 * (1 + k + 10 * i));
    EXPECT_EQ(blocks[i].peak_e, 2 * (3 + 10 * i));
  }
  // The last row of blocks is one pixel high: G R G R..., and blue is given the mean of both.
  EXPECT_DOUBLE_EQ(blocks[3].signal_e[0], 2);
  EXPECT_DOUBLE_EQ(blocks[3].signal_e[1], 4);
  EXPECT_DOUBLE_EQ(blocks[3].signal_e[2], 3);
  EXPECT_EQ(blocks[5].peak_e, 2 * (21 + 5)) << "(69, 32) is red";
}

// A frame is read out in runs of blocks of one region: what other regions leave out must not show in them.
TEST(ReadOut, GivesEachRegionItsOwnEffects) {
  InlineExecutor executor;
  SensorModel sensor = test::plain_sensor().model;
  sensor.read_noise_e = 5;
  const Plane<float> rate = test::filled(96, 40, 100);
  isp::NoiseSourcePlan plan = test::plan_of(96, 40, {});
  plan.regions.push_back(plan.regions[0]);
  plan.regions[1].kept = {Effect::read_noise};
  plan.region_of_block = {0, 1, 0, 1, 1, 0};
  Plane<float> dn(96, 40), noisy(96, 40);
  const SensorFrame frame{sensor, {}, BayerPhase::rggb, std::as_const(rate).view(), nullptr, 3, 3, 4};
  read_out(frame, plan, executor, dn.view());
  read_out(frame, test::plan_of(96, 40, {Effect::read_noise}), executor, noisy.view());
  for (int y = 0; y < 40; ++y) {
    for (int x = 0; x < 96; ++x) {
      const int block = y / 32 * 3 + x / 32;
      const bool is_noisy = plan.region_of_block[static_cast<std::size_t>(block)] == 1;
      ASSERT_EQ(dn.at(x, y), is_noisy ? noisy.at(x, y) : 512 + 50) << x << " " << y;
    }
  }
}

}  // namespace
}  // namespace lowlux::capture
