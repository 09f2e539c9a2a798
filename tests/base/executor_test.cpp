#include "isp/base/executor.h"

#include <gtest/gtest.h>

#include <array>
#include <atomic>
#include <chrono>
#include <filesystem>
#include <set>
#include <thread>
#include <vector>

namespace lowlux {
namespace {

int threads_of_process() {
  int n = 0;
  for ([[maybe_unused]] const auto& entry : std::filesystem::directory_iterator("/proc/self/task")) ++n;
  return n;
}

// A joined thread can stay listed in /proc for a moment.
int settled_threads(int expected) {
  for (int tries = 0; tries < 200 && threads_of_process() != expected; ++tries) {
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
  }
  return threads_of_process();
}

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
  { const PoolExecutor first(2); }  // a sanitizer's own thread starts with the first of the program
  const int before = settled_threads(threads_of_process());
  {
    PoolExecutor pool(5);
    EXPECT_EQ(threads_of_process(), before + 4);
  }
  EXPECT_EQ(settled_threads(before), before);
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
