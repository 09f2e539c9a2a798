#include "isp/bench/accuracy_time.h"

#include <gtest/gtest.h>

#include <chrono>
#include <cmath>
#include <thread>

#include "isp/metrics/statistics.h"

namespace lowlux::isp {
namespace {

AccuracyRow row(const char* group, const char* level, double ms_per_mp, double error) {
  return {.group = group, .error_of = "e", .level = level, .error = error, .ms_per_mp = ms_per_mp};
}

std::vector<bool> undominated(std::vector<AccuracyRow> rows) {
  mark_undominated(rows);
  std::vector<bool> out;
  out.reserve(rows.size());
  for (const AccuracyRow& r : rows) out.push_back(r.undominated);
  return out;
}

TEST(AccuracyTime, ALevelIsDominatedByOneThatIsFasterAndAsGoodOrBetterAndAsFast) {
  EXPECT_EQ(undominated({row("a", "slow", 2, 1), row("a", "fast", 1, 1)}), (std::vector{false, true}));
  EXPECT_EQ(undominated({row("a", "good", 1, 1), row("a", "bad", 1, 2)}), (std::vector{true, false}));
  EXPECT_EQ(undominated({row("a", "fast", 1, 2), row("a", "good", 2, 1), row("a", "worse", 3, 3)}),
            (std::vector{true, true, false}));
}

TEST(AccuracyTime, EqualLevelsDoNotDominateEachOtherAndALoneOneIsNotDominated) {
  EXPECT_EQ(undominated({row("a", "one", 1, 1), row("a", "two", 1, 1)}), (std::vector{true, true}));
  EXPECT_EQ(undominated({row("a", "lone", 9, 9)}), (std::vector{true}));
  EXPECT_EQ(undominated({}), std::vector<bool>{});
}

TEST(AccuracyTime, LevelsOfOtherGroupsDoNotCompete) {
  EXPECT_EQ(undominated({row("a", "slow", 2, 2), row("b", "fast", 1, 1), row("b", "slow", 2, 2)}),
            (std::vector{true, true, false}));
}

TEST(AccuracyTime, EveryRoundRunsEveryLevelOnceInTurnAndTheFirstDoesNotCount) {
  std::string order;
  const AccuracyGroup group{
      "g", "error", {{"a", 0, [&] { order += 'a'; }, 1e-4}, {"b", 2, [&] { order += 'b'; }, 1e-4}}};
  const auto rows = measure(group, {.rounds = 3});
  EXPECT_EQ(order, "abababab");
  ASSERT_EQ(rows.size(), 2u);
  EXPECT_EQ(rows[1].group, "g");
  EXPECT_EQ(rows[1].error_of, "error");
  EXPECT_EQ(rows[1].level, "b");
  EXPECT_EQ(rows[1].error, 2);
  for (const AccuracyRow& r : rows) {
    EXPECT_TRUE(std::isfinite(r.ms_per_mp) && r.ms_per_mp >= 0);
    EXPECT_TRUE(std::isfinite(r.times_memcpy) && r.times_memcpy >= 0);
  }
  EXPECT_TRUE(rows[0].undominated || rows[1].undominated);
}

void sleep_for_ms(int ms) { std::this_thread::sleep_for(std::chrono::milliseconds(ms)); }

TEST(AccuracyTime, TheWallClockSeesSleepAndTheThreadsClockDoesNot) {
  const AccuracyGroup group{"g", "e", {{"asleep", 0, [] { sleep_for_ms(20); }, 2}}};
  EXPECT_GE(measure(group, {.rounds = 1, .wall_clock = true})[0].ms_per_mp, 10);  // 20 ms for 2 MP: never sooner
  EXPECT_LT(measure(group, {.rounds = 1})[0].ms_per_mp, 5);                       // a sleep takes microseconds of CPU
}

TEST(AccuracyTime, TheMedianLeavesAnOutlierToTheSpread) {
  int run = 0;
  const auto uneven = [&](const std::vector<int>& ms) {
    run = 0;
    const AccuracyGroup group{"g", "e", {{"uneven", 0, [&run, ms] { sleep_for_ms(ms[run++ % ms.size()]); }, 1}}};
    return measure(group, {.rounds = 5, .wall_clock = true})[0];
  };
  const AccuracyRow two_slow = uneven({1, 20, 20, 20, 400, 400});  // the first does not count
  EXPECT_GE(two_slow.ms_per_mp, 20);
  EXPECT_LT(two_slow.ms_per_mp, 400);  // the median of 20, 20, 20, 400, 400
  EXPECT_GT(two_slow.spread, 0.3);     // quartiles 20 and 400
  // One round tells nothing of the next.
  EXPECT_TRUE(std::isnan(measure({"g", "e", {{"one", 0, [] {}, 1}}}, {.rounds = 1})[0].spread));
}

TEST(AccuracyTime, SpreadIsHalfTheDistanceOfTheQuartilesOverTheMedian) {
  EXPECT_EQ(spread_of({5, 1, 4, 2, 3}), 1.0 / 3);  // (4 - 2) / (2 x 3)
  EXPECT_EQ(spread_of({2, 1, 10}), 4.5 / 4);       // (6 - 1.5) / (2 x 2)
  EXPECT_EQ(spread_of({9, 1, 10}), 4.5 / 18);      // (9.5 - 5) / (2 x 9)
  EXPECT_EQ(spread_of({7, 7}), 0);
  EXPECT_TRUE(std::isnan(spread_of({7})) && std::isnan(spread_of({})));
}

TEST(AccuracyTime, ShortWorkIsRepeatedUntilItTakesLongEnough) {
  int runs = 0;
  const AccuracyGroup group{"g", "e", {{"short", 0, [&] { ++runs; }, 1e-4}}};
  measure(group, {.rounds = 1, .min_s = 1e-3});
  EXPECT_GT(runs, 2 * 10);  // two rounds of 1 ms of calls of less than 0.1 ms
}

TEST(AccuracyTime, TheTableHasALineForEachRowAndPlotsJoinTheUndominated) {
  std::vector<AccuracyRow> rows{row("a", "good", 4, 1), row("a", "bad", 5, 3), row("a", "fast", 1, 2),
                                row("b", "lone", 1, 1)};
  mark_undominated(rows);
  const BenchTable table = accuracy_table(rows);
  ASSERT_EQ(table.rows.size(), 4u);
  for (const auto& cells : table.rows) EXPECT_EQ(cells.size(), table.columns.size());
  const auto plots = accuracy_plots("stage", rows);
  ASSERT_EQ(plots.size(), 2u);
  EXPECT_EQ(plots[0].id, "stage-1");
  ASSERT_EQ(plots[0].series.size(), 4u);
  EXPECT_EQ(plots[0].series.back().x, (std::vector<double>{1, 4}));
  EXPECT_EQ(plots[0].series.back().y, (std::vector<double>{2, 1}));
  EXPECT_TRUE(plots[0].caption.ends_with(": fast; good")) << plots[0].caption;  // names may have commas
  EXPECT_EQ(plots[1].title, "b");
}

TEST(AccuracyTime, TheRemarkNamesClockThreadsAndRounds) {
  EXPECT_NE(timing_remark({.rounds = 7}, 1).find("7 rounds"), std::string::npos);
  EXPECT_NE(timing_remark({}, 1).find("CPU time of one thread"), std::string::npos);
  EXPECT_NE(timing_remark({.wall_clock = true}, 2).find("wall clock of 2 threads"), std::string::npos);
}

}  // namespace
}  // namespace lowlux::isp
