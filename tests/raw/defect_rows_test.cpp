#include "isp/raw/defect_rows.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <random>
#include <vector>

#include "tests/support/guarded_memory.h"
#include "tests/support/only_target.h"

namespace lowlux::isp {
namespace {

constexpr int beside = 2;  // read on either side

/// Three rows, the last code of each right before a page that must not be read.
struct ThreeRows {
  explicit ThreeRows(int count)
      : width(count + 2 * beside),
        memory{test::GuardedMemory(bytes()), test::GuardedMemory(bytes()), test::GuardedMemory(bytes())} {}
  std::size_t bytes() const { return static_cast<std::size_t>(width) * sizeof(std::uint16_t); }
  std::uint16_t* row(int r) { return reinterpret_cast<std::uint16_t*>(memory[r].last(bytes()).data()); }
  defect_rows::Rows rows() { return {row(0) + beside, row(1) + beside, row(2) + beside}; }

  int width;
  std::array<test::GuardedMemory, 3> memory;
};

/// How far code i is out of its neighbours' range, over what the bounds ask; below 0 inside of it.
double beyond(const defect_rows::Rows& rows, int i, const defect_rows::Bounds& bounds) {
  std::vector<int> around;
  for (const int dx : {-2, 0, 2}) {
    around.push_back(rows.above[i + dx]);
    around.push_back(rows.below[i + dx]);
    if (dx != 0) around.push_back(rows.here[i + dx]);
  }
  const auto [low, high] = std::ranges::minmax(around);
  const int code = rows.here[i];
  const int distance = std::max(code - high, low - code);
  if (distance <= 0) return -1;
  const double level = std::max((code > high ? high : low) - static_cast<double>(bounds.black_dn[i % 2]), 0.0);
  const double plain = static_cast<double>(bounds.range_factor) * (high - low) + static_cast<double>(bounds.floor_dn);
  const double bound =
      std::sqrt(plain * plain + static_cast<double>(bounds.variance_dn2) + static_cast<double>(bounds.shot_dn) * level);
  return bound > 0 ? distance / bound : INFINITY;
}

void expect_marks(ThreeRows& of, int count, const defect_rows::Bounds& bounds) {
  std::vector<std::uint8_t> marked(static_cast<std::size_t>(count) + 1, 77);
  defect_rows::mark_outliers(of.rows(), count, bounds, marked.data());
  EXPECT_EQ(marked[static_cast<std::size_t>(count)], 77);
  constexpr double rounding = 1e-5;
  for (int i = 0; i < count; ++i) {
    const double ratio = beyond(of.rows(), i, bounds);
    const bool marked_it = marked[static_cast<std::size_t>(i)] == 1;
    const bool in_tail = i >= count / 16 * 16;  // of the widest vector there is
    EXPECT_TRUE(marked_it || ratio < 1 + rounding) << i << " of " << count;
    EXPECT_TRUE(!marked_it || in_tail || ratio > 1 - rounding) << i << " of " << count;
  }
}

TEST(DefectRows, MarkWhatIsOutsideAsFarAsAskedWithEachInstructionSet) {
  const defect_rows::Bounds known{{512, 530}, 0, 0, 25 * 9.0f, 25 * 0.5f}, unknown{{512, 530}, 4, 30, 0, 0};
  ASSERT_FALSE(test::kernel_targets().empty());
  for (const std::int64_t target : test::kernel_targets()) {
    const test::OnlyTarget only(target);
    std::mt19937 draw(11);
    for (const int count : {1, 3, 15, 16, 17, 100, 512}) {
      ThreeRows of(count);
      for (const int spread : {3, 40, 65535}) {
        std::uniform_int_distribution<int> code(spread == 65535 ? 0 : 600, spread == 65535 ? 65535 : 600 + spread);
        for (int r = 0; r < 3; ++r) {
          for (int x = 0; x < of.width; ++x) {
            const bool hot = draw() % 13 == 0;
            of.row(r)[x] = static_cast<std::uint16_t>(hot ? draw() % 2000 : code(draw));
          }
        }
        expect_marks(of, count, known);
        expect_marks(of, count, unknown);
      }
    }
  }
}

TEST(DefectRows, MarkNothingInAFlatAndAllThatDiffersWithoutBounds) {
  ThreeRows of(64);
  for (int r = 0; r < 3; ++r) std::fill_n(of.row(r), of.width, std::uint16_t{65535});
  expect_marks(of, 64, {});
  of.row(1)[20] = 65534;
  of.row(1)[33] = 0;
  expect_marks(of, 64, {});
}

}  // namespace
}  // namespace lowlux::isp
