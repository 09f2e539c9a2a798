#include "isp/pipeline/budget/step_sizes.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdio>
#include <optional>
#include <random>
#include <string>
#include <string_view>
#include <utility>
#include <variant>
#include <vector>

#include "isp/model/colour/colorimetry.h"
#include "isp/model/colour/colour_difference.h"
#include "isp/pipeline/develop.h"
#include "isp/pipeline/plan/plan_develop.h"
#include "isp/render/output_space.h"
#include "tests/pipeline/night_frames.h"
#include "tests/support/executors.h"
#include "tests/support/reference_cost.h"

namespace lowlux::isp::step_sizes_test {
namespace {

using test::two_threads;

constexpr int width = 3072, height = 2048;  // a frame that is sampled

struct Grey {
  double mean_e = 20;
  double column_std_e = 0;
  double read_noise_e = 1.5;
};

/// A grey of equal electrons whose columns have offsets of this standard deviation.
RawFrame grey_with_columns(const Grey& grey, int frame_width = width, int frame_height = height) {
  std::mt19937 engine(1);
  std::normal_distribution<double> normal;
  std::vector<double> offset_e(static_cast<std::size_t>(frame_width));
  for (double& offset : offset_e) offset = grey.column_std_e * normal(engine);
  const auto scene = [&](int x, int) {
    const double e = grey.mean_e + offset_e[static_cast<std::size_t>(x)];
    return std::array{e, e, e};
  };
  return test::night_frame({.read_noise_e = grey.read_noise_e}, scene, frame_width, frame_height);
}

DevelopOptions planned(std::optional<double> tolerance, std::optional<double> budget_s = {}) {
  DevelopOptions options;
  options.denoise.mode = DenoiseChoice::Mode::automatic;
  options.exposure_ev = 0;
  options.effects.emplace().tolerance_delta_e = tolerance;
  options.effects->budget_s = budget_s;
  options.effects->cost = test::reference_cost();
  return options;
}

const PlannedStep& named(const DevelopPlan& plan, std::string_view name) {
  return *std::ranges::find(plan.effects->effects, name, &PlannedStep::name);
}

constexpr std::string_view lines_step = "row and column noise";

struct Lines {
  double predicted = 0;         // CIEDE2000
  std::size_t taken_kinds = 0;  // that the whole frame has, where all is done
};

Lines lines_of(const RawFrame& frame) {
  DevelopOptions options;
  options.denoise.mode = DenoiseChoice::Mode::automatic;
  options.effects.emplace().cost = test::reference_cost();
  const auto planned = plan_develop(frame, options, two_threads);
  options.effects->all = true;
  const auto all = plan_develop(frame, options, two_threads);
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
  const Lines none = lines_of(grey_with_columns({})), some = lines_of(grey_with_columns({.column_std_e = 0.18}));
  EXPECT_EQ(none.taken_kinds, 0);
  EXPECT_EQ(none.predicted, 0);
  EXPECT_EQ(some.taken_kinds, 1);
  EXPECT_GT(some.predicted, 0);
}

/// Returns the light of an even grey in the image, linear Rec. 709: the mean over all pixels.
Vector3 developed_light(double mean_e) {
  const RawFrame frame = grey_with_columns({.mean_e = mean_e}, 512, 512);
  DevelopOptions options = planned(std::nullopt);
  options.effects.reset();
  options.denoise.mode = DenoiseChoice::Mode::off;
  const Result<Developed> image = develop(frame, options, two_threads);
  EXPECT_TRUE(image);
  Vector3 sum{};
  const auto& codes = std::get<Encoded8>(image->picture);
  for (int y = 0; y < codes.height(); ++y) {
    for (int x = 0; x < codes.width(); ++x) {
      for (std::size_t c = 0; c < 3; ++c) {
        sum[c] += decode_transfer(OutputSpace::srgb, codes.codes.row(y)[3 * x + static_cast<int>(c)] / 255.0);
      }
    }
  }
  for (double& light : sum) light /= codes.width() * codes.height();
  return sum;
}

// 5 % of normal offsets exceed 1.96 standard deviations; what an electron changes is measured on two even greys. Means
// over 8 x 8 pixels would hide all but a square root of 8 of it. The measured deviation rests on 1536 columns, by the
// median absolute deviation of differences: a standard error of 1.2 / sqrt(0.74 x 1536) = 3.6 %.
TEST(StepSizes, LinesAreRatedByTheirOwnContrast) {
  constexpr double mean_e = 800, step_e = 40, column_std_e = 6;
  const Matrix3 to_xyz = *inverse(*xyz_to_output(OutputSpace::linear_srgb));
  const Xyz white = *xyz_of(output_white);
  const auto lab = [&](double e) { return lab_of(xyz_of(to_xyz * developed_light(e)), white); };
  const double per_e = ciede2000(lab(mean_e - step_e), lab(mean_e + step_e)) / (2 * step_e);
  const RawFrame frame = grey_with_columns({mean_e, column_std_e, 8});
  const auto plan = plan_develop(frame, planned(50), two_threads);
  ASSERT_TRUE(plan);
  const double expected = 1.96 * column_std_e * per_e;
  std::printf("  predicted %.3f, expected %.3f\n", named(*plan, lines_step).size, expected);
  EXPECT_NEAR(named(*plan, lines_step).size, expected, 5 * 0.036 * expected);
}

// Lines of more contrast than the tolerance are subtracted though no level is called for by the noise; others stay. A
// frame below 3 MP is measured as a whole.
TEST(StepSizes, LinesAboveTheToleranceAreSubtractedAndOthersStay) {
  for (const auto& [columns, rows] : {std::pair{width, height}, std::pair{1024, 768}}) {
    const Grey lined{.mean_e = 400, .column_std_e = 20, .read_noise_e = 30};
    const RawFrame frame = grey_with_columns(lined, columns, rows);
    const auto nothing = plan_develop(frame, planned(50), two_threads);
    ASSERT_TRUE(nothing);
    EXPECT_FALSE(nothing->effects->level);
    EXPECT_TRUE(nothing->noise_reduction.lines.empty());
    const double size = named(*nothing, lines_step).size, noise = named(*nothing, "noise").left;
    EXPECT_EQ(named(*nothing, lines_step).left, size);
    const double tolerance = std::sqrt(noise / 0.9 * size);
    std::printf("  %d x %d: lines %.2f, noise %.2f, tolerance %.2f\n", columns, rows, size, noise, tolerance);
    ASSERT_LT(noise, 0.9 * tolerance);
    ASSERT_GT(size, tolerance);
    const auto plan = plan_develop(frame, planned(tolerance), two_threads);
    ASSERT_TRUE(plan);
    EXPECT_EQ(plan->noise_reduction.lines.size(), 1);
    EXPECT_TRUE(named(*plan, lines_step).used);
    const auto even = plan_develop(grey_with_columns({400, 0, 30}, columns, rows), planned(tolerance), two_threads);
    ASSERT_TRUE(even);
    EXPECT_FALSE(even->effects->level) << "without lines the noise stays";
    EXPECT_EQ(named(*even, lines_step).size, 0);
  }
}

TEST(StepSizes, LinesLeftOutForLackOfTimeAreStatedWithTheirSize) {
  const RawFrame frame = grey_with_columns({.mean_e = 800, .column_std_e = 6, .read_noise_e = 8});
  const auto ample = plan_develop(frame, planned(std::nullopt, 100), two_threads);
  const auto tight = plan_develop(frame, planned(std::nullopt, 0.04), two_threads);
  ASSERT_TRUE(ample && tight);
  EXPECT_TRUE(named(*ample, lines_step).used);
  EXPECT_EQ(named(*ample, lines_step).left, 0);
  const PlannedStep& left_out = named(*tight, lines_step);
  EXPECT_FALSE(left_out.used);
  EXPECT_GT(left_out.size, 0);
  EXPECT_EQ(left_out.left, left_out.size);
  EXPECT_NE(left_out.decision.find("for lack of time"), std::string::npos) << left_out.decision;
  const auto tolerant = plan_develop(frame, planned(50), two_threads);
  ASSERT_TRUE(tolerant);
  EXPECT_NE(named(*tolerant, lines_step).decision.find("below the tolerance"), std::string::npos);
}

}  // namespace
}  // namespace lowlux::isp::step_sizes_test
