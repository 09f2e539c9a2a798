#include "isp/model/sensor/noise_source_plan.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <set>
#include <string_view>
#include <vector>

#include "isp/model/colour/colorimetry.h"
#include "isp/model/colour/colour_difference.h"
#include "tests/support/numbers.h"
#include "tests/support/sweep.h"

namespace lowlux::isp {
namespace {

using test::inf;

using Reason = NoiseSourceDecision::Reason;

SensorModel rich_sensor() {
  SensorModel m;
  m.read_noise_e = 2.5;
  m.full_well_e = 30000;
  m.bits = 14;
  m.black_level_dn = 512;
  m.white_level_dn = 16383;
  m.system_gain_dn_per_e = 0.5;
  m.dark_current_e_per_s = {5, 8, 6};
  m.prnu = 0.01;
  m.dsnu = 0.3;
  m.hot_pixel_fraction = 1e-4;
  m.hot_pixel_current_e_per_s = 50;
  m.row_noise_e = 0.8;
  m.column_noise_e = 0.6;
  m.telegraph_fraction = 0.01;
  m.telegraph_e = 4;
  m.glow_e_per_s = 40;
  m.crosstalk = 0.01;
  return m;
}

/// Flat blocks, with neighbours from which crosstalk adds a hundredth to green, and the lens a thousandth to red.
BlockLevel grey(double level_e) {
  BlockLevel out{{level_e, level_e, level_e}, {level_e, level_e, level_e}, level_e, {3, 2, 4, 0.25}};
  const auto adds = [](const Vector3& d) {
    MovedLight moved;
    moved.mean_e = moved.moved_e = moved.count_variance_e2 = d;
    return moved;
  };
  out.by_crosstalk = adds({0, 0.01 * level_e, 0});
  out.by_lens_blur = adds({0.001 * level_e, 0, 0});
  out.by_both = adds({0.001 * level_e, 0.01 * level_e, 0});
  return out;
}

struct Case {
  SensorModel sensor = rich_sensor();
  Exposure exposure;
  std::vector<BlockLevel> blocks{grey(1000)};

  Developing developing() const {
    return developing_of(sensor, exposure, *rgb_to_xyz(primaries_rec709), {1, 1, 1}, blocks);
  }
  NoiseSourcePlan plan(const Tolerance& tolerance) const {
    return plan_noise_sources(sensor, exposure, developing(), blocks, tolerance);
  }
  NoiseSourcePlan fixed(NoiseSourceSet wanted) const {
    return fixed_effects(sensor, exposure, developing(), blocks, wanted);
  }
};

TEST(NoiseSourceSet, HoldsWhatIsPutInAndNothingElse) {
  constexpr NoiseSourceSet none;
  constexpr NoiseSourceSet two{Effect::prnu, Effect::photon_noise};
  for (int i = 0; i < effect_count; ++i) {
    const auto effect = static_cast<Effect>(i);
    EXPECT_FALSE(none.has(effect));
    EXPECT_TRUE(NoiseSourceSet::all().has(effect));
    EXPECT_EQ(two.has(effect), effect == Effect::prnu || effect == Effect::photon_noise);
    EXPECT_EQ(none.with(effect).without(effect), none);
    EXPECT_EQ(two.with(effect).with(effect), two.with(effect));
    EXPECT_FALSE(NoiseSourceSet::all().without(effect).has(effect));
    EXPECT_EQ(NoiseSourceSet::all().without(effect).with(effect), NoiseSourceSet::all());
  }
  EXPECT_EQ(two.without(Effect::prnu).without(Effect::photon_noise), none);
}

TEST(EffectNames, AreAsManyAsEffectsAllDifferent) {
  const auto names = effect_names();
  ASSERT_EQ(names.size(), static_cast<std::size_t>(effect_count));
  EXPECT_EQ(std::set<std::string_view>(names.begin(), names.end()).size(), names.size());
  EXPECT_EQ(names[static_cast<int>(Effect::photon_noise)], "photon-noise");
  EXPECT_EQ(names[static_cast<int>(Effect::column_noise)], "column-noise");
  EXPECT_EQ(names[static_cast<int>(Effect::telegraph_noise)], "telegraph-noise");
  EXPECT_EQ(names[static_cast<int>(Effect::amplifier_glow)], "amplifier-glow");
  EXPECT_EQ(names[static_cast<int>(Effect::crosstalk)], "crosstalk");
  EXPECT_EQ(names[static_cast<int>(Effect::lens_blur)], "lens-blur");
}

TEST(NoiseSourcePlan, ATinyToleranceKeepsEveryEffectThatIsThere) {
  for (const double level : {0.0, 3.0, 1000.0, 1e6}) {
    Case c;
    c.blocks = {grey(level)};
    const NoiseSourcePlan plan = c.plan({1e-12, 1e-12});
    for (const NoiseSourceDecision& d : plan.regions[0].decisions) {
      // What is nothing to 12 digits may go: clipping far from both ends, all others where every pixel is full.
      if (d.alone.delta_e < 1e-12 && d.alone.relative_variance < 1e-12) continue;
      EXPECT_TRUE(d.kept) << level << " " << effect_names()[static_cast<int>(d.effect)];
      EXPECT_EQ(d.reason, Reason::needed);
    }
  }
  const NoiseSourcePlan plan = Case().plan({1e-12, 1e-12});
  EXPECT_EQ(plan.regions[0].kept.with(Effect::clipping), NoiseSourceSet::all());
}

TEST(NoiseSourcePlan, AHugeToleranceLeavesEveryEffectOut) {
  for (const double tolerance : {1e9, inf}) {
    const NoiseSourcePlan plan = Case().plan({tolerance, tolerance});
    EXPECT_EQ(plan.regions[0].kept, NoiseSourceSet());
    for (const NoiseSourceDecision& d : plan.regions[0].decisions) EXPECT_EQ(d.reason, Reason::negligible);
  }
}

TEST(NoiseSourcePlan, EffectsTheSensorHasNotAreAbsent) {
  Case c;
  c.sensor.prnu = c.sensor.read_noise_e = c.sensor.row_noise_e = c.sensor.column_noise_e = 0;
  c.sensor.dark_current_e_per_s = {};
  c.sensor.hot_pixel_fraction = 0;
  const NoiseSourcePlan plan = c.plan({1e-12, 1e-12});
  for (const Effect effect : {Effect::prnu, Effect::read_noise, Effect::row_noise, Effect::column_noise,
                              Effect::dark_current, Effect::dsnu, Effect::hot_pixels}) {
    const NoiseSourceDecision& d = plan.regions[0].decisions[static_cast<std::size_t>(effect)];
    EXPECT_EQ(d.effect, effect);
    EXPECT_EQ(d.reason, Reason::absent) << effect_names()[static_cast<int>(effect)];
    EXPECT_FALSE(d.kept);
    EXPECT_FALSE(plan.regions[0].kept.has(effect));
  }
  c.blocks[0].by_lens_blur = {};
  EXPECT_EQ(c.plan({1e-12, 1e-12}).regions[0].decisions[static_cast<std::size_t>(Effect::lens_blur)].reason,
            Reason::absent);
  Case no_time;  // without time there is no dark charge
  no_time.exposure.time_s = 0;
  const auto decisions = no_time.plan({1e-12, 1e-12}).regions[0].decisions;
  EXPECT_EQ(decisions[static_cast<std::size_t>(Effect::dark_current)].reason, Reason::absent);
  EXPECT_EQ(decisions[static_cast<std::size_t>(Effect::dsnu)].reason, Reason::absent);
  EXPECT_EQ(decisions[static_cast<std::size_t>(Effect::hot_pixels)].reason, Reason::absent);
  EXPECT_EQ(decisions[static_cast<std::size_t>(Effect::amplifier_glow)].reason, Reason::absent);
  EXPECT_EQ(decisions[static_cast<std::size_t>(Effect::crosstalk)].reason, Reason::absent);
}

TEST(NoiseSourcePlan, AskedForEffectsAreKeptAndAllOthersLeftOut) {
  const NoiseSourceSet wanted{Effect::photon_noise, Effect::clipping, Effect::row_noise};
  const RegionPlan region = Case().fixed(wanted).regions[0];
  EXPECT_EQ(region.kept, wanted);
  for (const NoiseSourceDecision& d : region.decisions) {
    EXPECT_EQ(d.reason, Reason::asked_for);
    EXPECT_EQ(d.kept, wanted.has(d.effect));
  }
  EXPECT_GT(region.left_out_together.relative_variance, 0) << "predicted all the same";
  Case without;
  without.sensor.row_noise_e = 0;
  EXPECT_FALSE(without.fixed(wanted).regions[0].kept.has(Effect::row_noise)) << "nobody can keep what is not there";
  EXPECT_EQ(Case().fixed({}).regions[0].kept, NoiseSourceSet());
}

TEST(NoiseSourcePlan, DarkNonUniformityIsNothingWithoutDarkCurrent) {
  EXPECT_FALSE(Case().fixed(NoiseSourceSet::all().without(Effect::dark_current)).regions[0].kept.has(Effect::dsnu));
  EXPECT_TRUE(Case().fixed(NoiseSourceSet::all()).regions[0].kept.has(Effect::dsnu));
  for (const double level : {0.0, 1.0, 300.0, 20000.0}) {
    for (const double tolerance : test::ratios(1e-4, 1e4, 3)) {
      Case c;
      c.blocks = {grey(level)};
      const NoiseSourceSet kept = c.plan({tolerance, tolerance}).regions[0].kept;
      EXPECT_TRUE(!kept.has(Effect::dsnu) || kept.has(Effect::dark_current)) << level << " " << tolerance;
    }
  }
}

TEST(NoiseSourcePlan, BlocksOfADecadeMakeARegion) {
  Case c;
  c.blocks = {grey(55), grey(0.5), grey(5), grey(50), {{2, 90, 1}, {2, 90, 1}, 95, grey(0).glow}, grey(0), grey(5.5)};
  const NoiseSourcePlan plan = c.plan({});
  ASSERT_EQ(plan.regions.size(), 4u);
  EXPECT_EQ(plan.region_of_block, (std::vector<std::uint8_t>{3, 1, 2, 3, 3, 0, 2}));
  const int blocks[] = {1, 1, 2, 3};
  const double darkest[] = {0, 0.5, 5, 50}, brightest[] = {0, 0.5, 5.5, 90};
  for (int r = 0; r < 4; ++r) {
    EXPECT_EQ(plan.regions[r].blocks, blocks[r]);
    EXPECT_EQ(plan.regions[r].darkest_e, darkest[r]);
    EXPECT_EQ(plan.regions[r].brightest_e, brightest[r]) << "the level of a block is its largest channel's";
  }
}

TEST(NoiseSourcePlan, BlocksOfADecadeOfGlowMakeARegion) {
  Case c;
  c.blocks = {grey(5), grey(50), grey(6), grey(7)};
  c.blocks[0].glow = {0.2, 0.1, 0.3, 0};
  c.blocks[3].glow = {0.9, 0.6, 1.2, 0.1};
  const NoiseSourcePlan plan = c.plan({});
  ASSERT_EQ(plan.regions.size(), 3u);
  EXPECT_EQ(plan.region_of_block, (std::vector<std::uint8_t>{0, 2, 1, 0}));
  EXPECT_EQ(plan.regions[0].glow_e, 0.9);
  EXPECT_EQ(plan.regions[2].glow_e, 3);
}

TEST(NoiseSourcePlan, WhatIsLeftOutTogetherStaysBelowTheTolerance) {
  for (const double level : {0.0, 0.3, 10.0, 1000.0, 14000.0, 29000.0, 1e5}) {
    for (const double time_s : {1e-3, 1.0, 60.0}) {
      for (const Tolerance& tolerance : {Tolerance{0.01, 0.001}, Tolerance{}, {3, 0.5}}) {
        Case c;
        c.blocks = {grey(level)};
        c.exposure.time_s = time_s;
        const RegionPlan region = c.plan(tolerance).regions[0];
        EXPECT_LT(region.left_out_together.delta_e, tolerance.delta_e);
        EXPECT_LT(region.left_out_together.relative_variance, tolerance.relative_variance);
        const PredictedChange again = predict_change(c.sensor, c.exposure, c.developing(), c.blocks[0], region.kept);
        EXPECT_EQ(again.delta_e, region.left_out_together.delta_e);
        EXPECT_EQ(again.relative_variance, region.left_out_together.relative_variance);
        for (const NoiseSourceDecision& d : region.decisions) EXPECT_EQ(d.kept, region.kept.has(d.effect));
      }
    }
  }
}

TEST(NoiseSourcePlan, ALargerToleranceKeepsASubset) {
  for (const double level : {0.0, 0.3, 10.0, 1000.0, 14000.0, 29000.0}) {
    for (const double time_s : {1e-3, 1.0, 60.0}) {
      Case c;
      c.blocks = {grey(level)};
      // With two effects that move light, leaving out one more can cost the other.
      c.blocks[0].by_lens_blur = {};
      c.blocks[0].by_both = c.blocks[0].by_crosstalk;
      c.exposure.time_s = time_s;
      NoiseSourceSet before = NoiseSourceSet::all();
      for (const double scale : test::ratios(1e-3, 1e4, 1.5)) {
        const NoiseSourceSet kept = c.plan({0.5 * scale, 0.05 * scale}).regions[0].kept;
        for (int i = 0; i < effect_count; ++i) {
          const auto effect = static_cast<Effect>(i);
          EXPECT_TRUE(before.has(effect) || !kept.has(effect))
              << effect_names()[i] << " came back at " << scale << ", level " << level << ", time " << time_s;
        }
        before = kept;
      }
    }
  }
}

TEST(PredictChange, IsNothingWhereNothingIsLeftOut) {
  for (const double level : {0.0, 1.0, 1000.0, 1e6}) {
    const Case c;
    const PredictedChange none =
        predict_change(c.sensor, c.exposure, c.developing(), grey(level), NoiseSourceSet::all());
    EXPECT_EQ(none.delta_e, 0) << level;
    EXPECT_EQ(none.relative_variance, 0) << level;
  }
}

TEST(PredictChange, IsAtLeastTheShareOfTheVarianceThatIsLeftOut) {
  const Case c;
  // 1000 + 8 + 3 + 2.5^2 + (0.01 x 1000)^2 + (0.3 x 8)^2 + 0.8^2 + 0.6^2 e-^2 of green, and 4/12 for quantisation
  const double whole = 1000 + 8 + 3 + 6.25 + 100 + 5.76 + 0.64 + 0.36 + 4.0 / 12;
  const struct {
    Effect effect;
    double variance_e2;
  } shares[] = {{Effect::amplifier_glow, 3}, {Effect::photon_noise, 1000}, {Effect::read_noise, 6.25},
                {Effect::prnu, 100},         {Effect::dsnu, 5.76},         {Effect::row_noise, 0.64},
                {Effect::column_noise, 0.36}};
  for (const auto& share : shares) {
    const PredictedChange change =
        predict_change(c.sensor, c.exposure, c.developing(), c.blocks[0], NoiseSourceSet::all().without(share.effect));
    EXPECT_GE(change.relative_variance, share.variance_e2 / whole);
    EXPECT_GT(change.delta_e, 0);
  }
}

// Quantiles of two Poisson distributions by their sums, over means and changes of them.
TEST(CountChangeVariance, IsNoLessThanThatOfTheQuantilesOfOneNumber) {
  const auto sums = [](double mean, int count) {
    std::vector<double> out;
    double sum = 0;
    for (int n = 0; n < count; ++n) {
      sum += std::exp(n * std::log(mean) - mean - std::lgamma(n + 1.0));
      out.push_back(sum);
    }
    return out;
  };
  for (const double mean : {0.01, 0.3, 1.0, 4.7, 30.0, 200.0}) {
    for (const double d : {0.001, 0.1, 0.5, 1.0, 3.3, 20.0}) {
      const int count = static_cast<int>(mean + d + 12 * std::sqrt(mean + d) + 30);
      const std::vector<double> low = sums(mean, count), high = sums(mean + d, count);
      double at = 0, first = 0, second = 0;
      int i = 0, j = 0;
      while (i < count && j < count) {
        const double next = std::min(low[static_cast<std::size_t>(i)], high[static_cast<std::size_t>(j)]);
        const double change = j - i;
        first += (next - at) * change;
        second += (next - at) * change * change;
        at = next;
        (low[static_cast<std::size_t>(i)] <= high[static_cast<std::size_t>(j)] ? i : j) += 1;
      }
      EXPECT_NEAR(first, d, 1e-6 * (1 + d));
      EXPECT_LE(second - first * first, count_change_variance_e2(mean, mean + d, 0) * (1 + 1e-6)) << mean << " " << d;
    }
  }
  EXPECT_EQ(count_change_variance_e2(0, 7, 0), 7) << "photons on a dark pixel";
  EXPECT_NEAR(count_change_variance_e2(100, 100.01, 10), 0.1, 1e-12)
      << "0.01 counts, a tenth of them by a code of 10 e-";
}

TEST(PredictChange, OfLightThatMovesIsItsShiftWhereThereIsNoNoise) {
  Case c;
  c.sensor = {};
  c.sensor.full_well_e = 30000;
  c.sensor.bits = 16;
  c.sensor.white_level_dn = 65535;
  const BlockLevel block = grey(20000);
  const Developing d = c.developing();
  const auto lab = [&](const Vector3& signal_e) {
    Vector3 rgb{};
    for (int k = 0; k < 3; ++k) rgb[k] = signal_e[k] / d.white_e[k];
    return lab_of(xyz_of(d.camera_to_xyz * rgb), *xyz_of(white_d65));
  };
  const struct {
    NoiseSourceSet kept;
    Vector3 signal_e;
  } cases[] = {{NoiseSourceSet::all().without(Effect::crosstalk), {20000, 19800, 20000}},
               {NoiseSourceSet::all().without(Effect::lens_blur), {19980, 20000, 20000}},
               {NoiseSourceSet::all().without(Effect::lens_blur).without(Effect::crosstalk), {19980, 19800, 20000}}};
  for (const auto& left_out : cases) {
    const double exact = ciede2000(lab({20000, 20000, 20000}), lab(left_out.signal_e));
    const double found = predict_change(c.sensor, c.exposure, d, block, left_out.kept).delta_e;
    EXPECT_GE(found, exact);
    EXPECT_LT(found, 1.1 * exact) << "five standard deviations of a count of 20 or 200 e- more in 256 pixels";
  }
}

TEST(DevelopingOf, WhiteIsTheBrightestBlockWithinNoiseAndSaturation) {
  Case c;
  const auto white = [&](double level) {
    c.blocks = {grey(1), grey(level)};
    return c.developing().white_e[1];
  };
  EXPECT_EQ(white(5000), 5000);
  EXPECT_EQ(white(1e6), 30000) << "saturation";
  // 50 times the noise of a black frame of green, the darkest-current channel: 8 + 5.76 + 6.25 + 0.64 + 0.36 + 4/12
  EXPECT_NEAR(white(0), 50 * std::sqrt(8 + 5.76 + 6.25 + 0.64 + 0.36 + 4.0 / 12), 1e-9);
  const Developing tinted = developing_of(c.sensor, c.exposure, identity3(), {0.5, 1, 0.8}, std::vector{grey(5000)});
  EXPECT_EQ(tinted.white_e, (Vector3{5000, 10000, 8000})) << "red is the channel nearest to white";
}

}  // namespace
}  // namespace lowlux::isp
