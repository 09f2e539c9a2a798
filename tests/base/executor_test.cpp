#include "isp/base/executor.h"

#include <gtest/gtest.h>

#include <array>
#include <atomic>
#include <chrono>
#include <new>
#include <set>
#include <thread>
#include <vector>

#include "tests/support/this_process.h"

namespace lowlux {
namespace {

TEST(RowBand, BandsCoverEveryRowOnceAndStartAtEvenRows) {
  for (int height = 0; height <= 40; ++height) {
    for (int count = 1; count <= 9; ++count) {
      int next = 0;
      for (int i = 0; i < count; ++i) {
        const RowBand band = row_band(height, count, i);
        EXPECT_EQ(band.first, next);
        EXPECT_LE(band.first, band.last);
        if (band.first < height) {
          EXPECT_EQ(band.first % 2, 0);
        }
        next = band.last;
      }
      EXPECT_EQ(next, height);
    }
  }
}

TEST(PoolExecutor, RunsEachTaskOnceOverManyRounds) {
  for (const int width : {1, 2, 3, 7}) {
    PoolExecutor pool(width);
    EXPECT_EQ(pool.width(), width);
    for (int round = 0; round < 200; ++round) {
      std::vector<std::atomic<int>> runs(width + 2);
      pool.run(
          width + 2, [](void* context, int i) { ++(*static_cast<std::vector<std::atomic<int>>*>(context))[i]; }, &runs);
      for (const auto& count : runs) ASSERT_EQ(count, 1);
    }
  }
}

// Whether one part has no memory or all have none, on whichever thread: the caller has the exception, and the next call
// works as ever.
TEST(PoolExecutor, WhatAPartThrowsReachesTheCaller) {
  for (const int width : {1, 2, 4}) {
    PoolExecutor pool(width);
    for (int failing = -1; failing < 8; ++failing) {
      std::atomic<int> done{0};
      const auto work = [&](int i) {
        if (failing < 0 || i == failing) throw std::bad_alloc();
        ++done;
      };
      EXPECT_THROW(for_each_index(pool, 8, work), std::bad_alloc) << width << " threads, part " << failing;
      EXPECT_LT(done, 8);
      EXPECT_NO_THROW(for_each_band(pool, 16, [&](RowBand, int) { ++done; }));
    }
  }
}

// Threads look out for work for a moment and then sleep: calls come in both states, and on the way between them; slow
// tasks make the caller and the other workers sleep.
TEST(PoolExecutor, FindsItsThreadsAwakeAndAsleep) {
  PoolExecutor pool(4);
  for (int round = 0; round < 400; ++round) {
    std::array<std::atomic<int>, 6> runs{};
    for_each_index(pool, 6, [&](int i) {
      if (round % 16 == 0 && i == round / 16 % 4) std::this_thread::sleep_for(std::chrono::microseconds(300));
      ++runs[static_cast<std::size_t>(i)];
    });
    for (const auto& count : runs) ASSERT_EQ(count, 1) << round;
    if (round % 4 == 0) std::this_thread::sleep_for(std::chrono::microseconds(round / 4));
  }
}

TEST(PoolExecutor, RunsNothingForNoTasks) {
  PoolExecutor pool(3);
  int runs = 0;
  pool.run(
      0, [](void* context, int) { ++*static_cast<int*>(context); }, &runs);
  EXPECT_EQ(runs, 0);
}

TEST(PoolExecutor, EndsItsThreadsWhenDestroyed) {
  const int before = test::threads_at_rest();
  {
    PoolExecutor pool(5);
    EXPECT_EQ(test::threads_now(), before + 4);
  }
  EXPECT_EQ(test::settled_threads(before), before);
}

TEST(PoolExecutor, TaskIndexDecidesTheThread) {
  PoolExecutor pool(3);
  std::vector<std::thread::id> first(3), second(3);
  const auto record = [](void* context, int i) {
    (*static_cast<std::vector<std::thread::id>*>(context))[i] = std::this_thread::get_id();
  };
  pool.run(3, record, &first);
  pool.run(3, record, &second);
  EXPECT_EQ(first, second);
  EXPECT_EQ(first[0], std::this_thread::get_id());
  EXPECT_EQ(std::set<std::thread::id>(first.begin(), first.end()).size(), 3u);
}

TEST(InlineExecutor, RunsInOrderOnTheCaller) {
  InlineExecutor executor;
  std::vector<int> order;
  executor.run(
      4, [](void* context, int i) { static_cast<std::vector<int>*>(context)->push_back(i); }, &order);
  EXPECT_EQ(order, (std::vector<int>{0, 1, 2, 3}));
}

}  // namespace
}  // namespace lowlux
