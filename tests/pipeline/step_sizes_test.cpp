#include "isp/pipeline/budget/step_sizes.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cstddef>
#include <random>
#include <vector>

#include "isp/pipeline/plan/plan_develop.h"
#include "tests/pipeline/night_frames.h"
#include "tests/support/reference_cost.h"

namespace lowlux::isp {
namespace {

constexpr int width = 3072, height = 2048;  // a frame that is sampled

/// A grey of 20 e- whose columns have offsets of this standard deviation.
RawFrame grey_with_columns(double column_std_e) {
  std::mt19937 engine(1);
  std::normal_distribution<double> normal;
  std::vector<double> offset_e(width);
  for (double& offset : offset_e) offset = column_std_e * normal(engine);
  const auto scene = [&offset_e](int x, int) {
    const double e = 20 + offset_e[static_cast<std::size_t>(x)];
    return std::array{e, e, e};
  };
  return test::night_frame({.read_noise_e = 1.5}, scene, width, height);
}

struct Lines {
  double predicted = 0;         // CIEDE2000
  std::size_t taken_kinds = 0;  // that the whole frame has, where all is done
};

Lines lines_of(const RawFrame& frame) {
  PoolExecutor executor(2);
  DevelopOptions options;
  options.denoise.mode = DenoiseChoice::Mode::automatic;
  options.effects.emplace().cost = test::reference_cost();
  const auto planned = plan_develop(frame, options, executor);
  options.effects->all = true;
  const auto all = plan_develop(frame, options, executor);
  EXPECT_TRUE(planned && all);
  if (!planned || !all) return {};
  const auto& effects = planned->effects->effects;
  const auto lines = std::ranges::find(effects, "row and column noise", &PlannedStep::name);
  EXPECT_NE(lines, effects.end());
  return {lines->size, all->noise_reduction.lines.size()};
}

// A column's offset is measured to 1.2 x 4.7 e- / sqrt(2048) = 0.12 e- in the whole frame, to 0.24 e- in a square of
// 512 rows: 0.18 e- stands out of the one and not of the other, but squares together tell its size.
TEST(StepSizes, ASampleTellsOfColumnsThatOnlyWholeOnesShow) {
  const Lines none = lines_of(grey_with_columns(0)), some = lines_of(grey_with_columns(0.18));
  EXPECT_EQ(none.taken_kinds, 0);
  EXPECT_EQ(none.predicted, 0);
  EXPECT_EQ(some.taken_kinds, 1);
  EXPECT_GT(some.predicted, 0);
}

}  // namespace
}  // namespace lowlux::isp
