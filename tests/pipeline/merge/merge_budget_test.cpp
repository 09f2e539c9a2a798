#include "isp/pipeline/merge/merge_budget.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <memory>
#include <optional>
#include <random>
#include <string>

#include "tests/pipeline/merge/merge_bursts.h"

namespace lowlux::isp {
namespace {

using test::Burst;

constexpr double unlimited = std::numeric_limits<double>::infinity();

/// From worst to best result.
constexpr std::array<MergeMethod, 6> ranked{{{MergeAlignment::none, false},
                                             {MergeAlignment::none, true},
                                             {MergeAlignment::cells, false},
                                             {MergeAlignment::subpixel, false},
                                             {MergeAlignment::cells, true},
                                             {MergeAlignment::subpixel, true}}};

int rank_of(const MergeMethod& method) {
  for (std::size_t i = 0; i < ranked.size(); ++i) {
    if (ranked[i].alignment == method.alignment && ranked[i].robust == method.robust) return static_cast<int>(i);
  }
  return -1;
}

class Draws {
 public:
  explicit Draws(std::uint64_t seed) : random_(seed) {}
  int whole(int least, int most) { return std::uniform_int_distribution<>(least, most)(random_); }
  double between(double least, double most) {
    return least * std::pow(most / least, std::uniform_real_distribution<>(0, 1)(random_));
  }
  /// A machine whose parts of a merge take 1 to 30 ms for each megapixel.
  CostModel cost() {
    CostModel out;
    for (auto part = static_cast<std::size_t>(CostPart::merge_frame); part < out.points.size(); ++part) {
      out.points[part] = {{1, between(0.001, 0.03)}};
    }
    return out;
  }
  MergeWork work() {
    MergeWork out{.frames = whole(1, 40), .size = cost_size(whole(64, 6000), whole(64, 4000))};
    if (whole(0, 2) == 0) out.alignment = ranked[2 * static_cast<std::size_t>(whole(0, 1)) + 1].alignment;
    if (whole(0, 2) == 0) out.robust = whole(0, 1) == 1;
    return out;
  }
  bool coin() { return whole(0, 1) == 1; }

 private:
  std::mt19937_64 random_;
};

/// The steps of merge_frames: whether the camera moved is known only where there is time to measure it.
MergePlan chosen(const CostModel& cost, const MergeWork& work, double budget_s, bool camera_moved) {
  std::optional<bool> moved;
  if (measures_motion(cost, work, budget_s)) moved.emplace(camera_moved);
  return choose_merge_method(cost, work, budget_s, moved);
}

/// Returns whether a method is one that the request and what is known leave open.
bool is_open(const MergeMethod& method, const MergeWork& work, std::optional<bool> moved) {
  if (work.robust && *work.robust != method.robust) return false;
  if (work.alignment) return *work.alignment == method.alignment;
  return method.alignment == MergeAlignment::none || moved.value_or(false);
}

TEST(MergeBudget, TheBestMethodThatFitsIsChosenElseTheCheapest) {
  constexpr std::uint64_t seed = 2621;
  Draws draws(seed);
  int fitting = 0;
  for (int i = 0; i < 5000; ++i) {
    const CostModel cost = draws.cost();
    const MergeWork work = draws.work();
    const double budget_s = draws.between(1e-3, 100);
    const bool camera_moved = draws.coin();
    const MergePlan plan = chosen(cost, work, budget_s, camera_moved);
    std::optional<bool> moved;
    if (plan.motion_measured) moved.emplace(camera_moved);
    ASSERT_TRUE(is_open(plan.method, work, moved)) << seed << ' ' << i;
    EXPECT_DOUBLE_EQ(plan.predicted_s, predicted_merge_s(cost, work, plan.method, plan.motion_measured));
    EXPECT_EQ(plan.fits, plan.predicted_s <= budget_s);
    fitting += plan.fits ? 1 : 0;
    double cheapest_better_s = unlimited;
    for (const MergeMethod& other : ranked) {
      if (!is_open(other, work, moved)) continue;
      const double seconds = predicted_merge_s(cost, work, other, plan.motion_measured);
      const bool better = rank_of(other) > rank_of(plan.method);
      if (better) cheapest_better_s = std::min(cheapest_better_s, seconds);
      if (plan.fits) {
        EXPECT_FALSE(better && seconds <= budget_s) << seed << ' ' << i;
      } else {
        EXPECT_GE(seconds, plan.predicted_s) << seed << ' ' << i;
      }
    }
    EXPECT_EQ(plan.better.has_value(), cheapest_better_s < unlimited);
    if (plan.better) {
      EXPECT_DOUBLE_EQ(plan.better_s, cheapest_better_s);
    }
  }
  EXPECT_GT(fitting, 1000);
  EXPECT_LT(fitting, 4900);
}

TEST(MergeBudget, MoreTimeNeverMeansAWorseMethod) {
  constexpr std::uint64_t seed = 2622;
  Draws draws(seed);
  for (int i = 0; i < 1000; ++i) {
    const CostModel cost = draws.cost();
    const MergeWork work = draws.work();
    const bool camera_moved = draws.coin();
    int rank = -1;
    for (double budget_s = 1e-3; budget_s < 1000; budget_s *= 1.07) {
      const MergePlan plan = chosen(cost, work, budget_s, camera_moved);
      if (!plan.fits) continue;  // the cheapest need not be the worst
      EXPECT_GE(rank_of(plan.method), rank) << seed << ' ' << i << ' ' << budget_s;
      rank = rank_of(plan.method);
    }
    const MergePlan plan = chosen(cost, work, unlimited, camera_moved);
    EXPECT_TRUE(plan.fits);
    EXPECT_FALSE(plan.better);
    EXPECT_EQ(plan.method.robust, work.robust.value_or(true));
    const bool aligned = camera_moved && work.frames > 1;
    EXPECT_EQ(plan.method.alignment,
              work.alignment.value_or(aligned ? MergeAlignment::subpixel : MergeAlignment::none));
  }
}

TEST(MergeBudget, TimesAreTheSumOfTheFramesWork) {
  CostModel cost;
  const auto set = [&](CostPart part, double seconds) { cost.points[static_cast<std::size_t>(part)] = {{1, seconds}}; };
  set(CostPart::merge_frame, 1);
  set(CostPart::merge_mean, 10);
  set(CostPart::merge_robust, 100);
  set(CostPart::merge_comparison, 1e3);
  set(CostPart::merge_alignment, 1e4);
  set(CostPart::merge_cells, 1e5);
  set(CostPart::merge_subpixel, 1e6);
  set(CostPart::merge_prediction, 1e7);
  set(CostPart::merge_codes, 1e8);
  const MergeWork work{.frames = 8, .size = {.megapixels = 2}};
  const auto seconds = [&](MergeAlignment alignment, bool robust, bool measured) {
    return predicted_merge_s(cost, work, {alignment, robust}, measured);
  };
  EXPECT_DOUBLE_EQ(seconds(MergeAlignment::none, false, false), 2 * (9 + 8 * 10 + 1e8));
  EXPECT_DOUBLE_EQ(seconds(MergeAlignment::none, true, false), 2 * (13 + 80 + 100 + 8e3 + 1e8));
  EXPECT_DOUBLE_EQ(predicted_merge_s(cost, {.frames = 2, .size = work.size}, {MergeAlignment::none, true}, false),
                   2 * (4 + 20 + 62.5 + 2e3 + 1e8));
  EXPECT_DOUBLE_EQ(seconds(MergeAlignment::none, false, true), 2 * (11 + 80 + 2e4 + 1e8));
  EXPECT_DOUBLE_EQ(seconds(MergeAlignment::cells, true, false), 2 * (8 + 10 + 7e3 + 7e4 + 7e5 + 1e8));
  EXPECT_DOUBLE_EQ(seconds(MergeAlignment::subpixel, false, true), 2 * (10 + 10 + 7e4 + 7e6 + 1e7 + 1e8));
}

/// Holds times for each megapixel, over that of the fixed workload: of the robust mean alone, and of merging five
/// frames.
struct MeasuredMerge {
  int width;
  int height;
  double robust_mean;
  double at_rest;
  double cells;
  double subpixel;
};

// Processor time on two cores with AVX2, of frames of 5 and 20 e- that differ in their noise, and of the same displaced
// by 6 px each: the greater of both.
TEST(MergeBudget, WithoutCalibrationNoMergeIsPredictedFasterThanMeasured) {
  constexpr double least = 1.1, most = 1.5;
  constexpr std::array<MeasuredMerge, 7> measured{{{128, 96, 9.2, 29, 340, 347},
                                                   {384, 256, 3.5, 9.7, 32, 36},
                                                   {672, 448, 3.2, 7.1, 8.5, 11.3},
                                                   {1296, 864, 2.9, 6.0, 4.3, 7.3},
                                                   {2112, 1408, 3.0, 6.4, 3.4, 6.5},
                                                   {3680, 2448, 2.65, 5.1, 2.9, 5.6},
                                                   {6000, 4000, 2.6, 5.4, 3.1, 5.7}}};
  const CostModel& cost = reference_cost();
  for (const MeasuredMerge& merge : measured) {
    const CostSize size = cost_size(merge.width, merge.height);
    SCOPED_TRACE(size.megapixels);
    const auto expect = [&](double predicted_s, double taken) {
      const double ratio = predicted_s / cost.pace_s / size.megapixels / taken;
      EXPECT_GE(ratio, least);
      EXPECT_LE(ratio, most);
    };
    expect(cost.seconds(CostPart::merge_robust, size), merge.robust_mean);
    const auto predicted_s = [&](MergeAlignment alignment) {
      return predicted_merge_s(cost, {.frames = 5, .size = size}, {alignment, true}, false);
    };
    expect(predicted_s(MergeAlignment::none), merge.at_rest);
    expect(predicted_s(MergeAlignment::cells), merge.cells);
    expect(predicted_s(MergeAlignment::subpixel), merge.subpixel);
  }
}

TEST(MergeBudget, TheReferenceIsPredictedAnewAtPowersOfTwoUpToHalfOfTheFrames) {
  CostModel cost;
  cost.points[static_cast<std::size_t>(CostPart::merge_prediction)] = {{1, 1}};
  for (int frames = 2; frames <= 300; ++frames) {
    const double predictions =
        predicted_merge_s(cost, {.frames = frames, .size = {.megapixels = 1}}, {MergeAlignment::subpixel, true}, false);
    EXPECT_DOUBLE_EQ(predictions, frames < 16 ? 1 : 1 + 4.5 * (std::floor(std::log2(frames)) - 3)) << frames;
    EXPECT_FALSE(predicts_again(frames - frames / 2 + 1, frames)) << frames;
    // The mean of all colours holds no more than 256 frames.
    EXPECT_TRUE(predicts_again(256, 512 + frames) && !predicts_again(512, 1024 + frames)) << frames;
    EXPECT_TRUE(will_predict_again(255, 1024 + frames) && !will_predict_again(256, 1024 + frames)) << frames;
    for (int averaged = 1; averaged <= frames; ++averaged) {
      int later = 0;
      for (int i = averaged + 1; i <= frames; ++i) later += predicts_again(i, frames) ? 1 : 0;
      EXPECT_EQ(will_predict_again(averaged, frames), later > 0) << averaged << " of " << frames;
    }
  }
}

/// Merges a burst with the budget in the options of its reference.
MergedRaw merged_within(const Burst& burst, int count, double budget_s, MergeOptions options = {}) {
  auto cost = std::make_shared<CostModel>();
  for (auto part = static_cast<std::size_t>(CostPart::merge_frame); part < cost->points.size(); ++part) {
    cost->points[part] = {{1, 0.01}};
  }
  InlineExecutor executor;
  const FrameReader read = [&](int index, bool) {
    DevelopOptions develop = burst.options();
    develop.effects = ProcessingGoal{.budget_s = budget_s, .cost = cost};
    return Result<FrameToMerge>({burst.frame(index), develop, {}});
  };
  auto merged = merge_frames(count, read, options, executor);
  EXPECT_TRUE(merged) << merged.error().message;
  return *std::move(merged);
}

std::ptrdiff_t budget_warnings(const MergedRaw& merged) {
  return std::ranges::count_if(merged.warnings,
                               [](const std::string& line) { return line.find("budget") != std::string::npos; });
}

TEST(MergeBudget, AMergeUsesWhatFitsAndSaysSo) {
  Burst hand_held;
  hand_held.position = [](int index, double x, double y) { return std::array{x + 5.3 * index, y - 3.2 * index}; };
  const MergedRaw best = merged_within(hand_held, 4, 100);
  ASSERT_TRUE(best.plan);
  EXPECT_EQ(best.alignment, MergeAlignment::subpixel);
  EXPECT_TRUE(best.plan->motion_measured && best.plan->fits);
  EXPECT_GT(best.plan->taken_s, 0);
  EXPECT_EQ(budget_warnings(best), 0);
  const MergedRaw none = merged_within(hand_held, 4, 1e-9);
  EXPECT_EQ(none.alignment, MergeAlignment::none);
  EXPECT_FALSE(none.plan->method.robust);
  EXPECT_FALSE(none.plan->fits);
  EXPECT_EQ(budget_warnings(none), 1);
  const MergedRaw fixed = merged_within(hand_held, 4, 1e-9, {.robust = true, .alignment = MergeAlignment::cells});
  EXPECT_EQ(fixed.alignment, MergeAlignment::cells);
  EXPECT_TRUE(fixed.plan->method.robust);
  const MergedRaw shared = merged_within(hand_held, 4, 100, {.developed_after = true});
  EXPECT_LE(shared.plan->budget_s, 100);
  EXPECT_FALSE(hand_held.merged(2).plan);
}

TEST(MergeBudget, TheReserveForDevelopingIsAtMostHalf) {
  CostModel cost;
  cost.points[static_cast<std::size_t>(CostPart::standard_0)] = {{1, 0.1}};
  const CostSize size{.megapixels = 1, .denoised_megapixels = 2};
  EXPECT_DOUBLE_EQ(developing_reserve_s(cost, size, 10), 0.2);
  EXPECT_DOUBLE_EQ(developing_reserve_s(cost, size, 0.3), 0.15);
}

}  // namespace
}  // namespace lowlux::isp
