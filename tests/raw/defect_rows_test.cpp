#include "isp/raw/defect_rows.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <random>
#include <type_traits>
#include <vector>

#include "tests/support/guarded_memory.h"
#include "tests/support/only_target.h"

namespace lowlux::isp {
namespace {

constexpr int beside = 2;  // read on either side

/// Three rows, the last sample of each right before a page that must not be read.
template <class Sample>
struct ThreeRows {
  explicit ThreeRows(int count)
      : width(count + 2 * beside),
        memory{test::GuardedMemory(bytes()), test::GuardedMemory(bytes()), test::GuardedMemory(bytes())} {}
  std::size_t bytes() const { return static_cast<std::size_t>(width) * sizeof(Sample); }
  Sample* row(int r) { return reinterpret_cast<Sample*>(memory[r].last(bytes()).data()); }
  defect_rows::Rows<Sample> rows() { return {row(0) + beside, row(1) + beside, row(2) + beside}; }

  int width;
  std::array<test::GuardedMemory, 3> memory;
};

/// How far sample i is out of its neighbours' range, over what the bounds ask; below 0 inside of it.
template <class Sample>
double beyond(const defect_rows::Rows<Sample>& rows, int i, const defect_rows::Bounds& bounds) {
  std::vector<double> around;
  for (const int dx : {-2, 0, 2}) {
    around.push_back(rows.above[i + dx]);
    around.push_back(rows.below[i + dx]);
    if (dx != 0) around.push_back(rows.here[i + dx]);
  }
  const auto [low, high] = std::ranges::minmax(around);
  const double code = rows.here[i];
  const double distance = std::max(code - high, low - code);
  if (distance <= 0) return -1;
  const double level = std::max((code > high ? high : low) - static_cast<double>(bounds.black_dn[i % 2]), 0.0);
  const double plain = static_cast<double>(bounds.range_factor) * (high - low) + static_cast<double>(bounds.floor_dn);
  const double bound =
      std::sqrt(plain * plain + static_cast<double>(bounds.variance_dn2) + static_cast<double>(bounds.shot_dn) * level);
  return bound > 0 ? distance / bound : INFINITY;
}

template <class Sample>
void expect_marks(ThreeRows<Sample>& of, int count, const defect_rows::Bounds& bounds) {
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

template <class Sample>
void expect_marks_of_noise(std::mt19937& draw, int count, const defect_rows::Bounds& bounds) {
  ThreeRows<Sample> of(count);
  for (const int spread : {3, 40, 65535}) {
    std::uniform_int_distribution<int> code(spread == 65535 ? 0 : 600, spread == 65535 ? 65535 : 600 + spread);
    for (int r = 0; r < 3; ++r) {
      for (int x = 0; x < of.width; ++x) {
        const bool hot = draw() % 13 == 0;
        of.row(r)[x] = static_cast<Sample>(hot ? draw() % 2000 : static_cast<unsigned>(code(draw)));
        if constexpr (std::is_same_v<Sample, float>) of.row(r)[x] += static_cast<float>(draw() % 1000) / 1000 - 300;
      }
    }
    expect_marks(of, count, bounds);
  }
}

TEST(DefectRows, MarkWhatIsOutsideAsFarAsAskedWithEachInstructionSet) {
  const defect_rows::Bounds known{{512, 530}, 0, 0, 25 * 9.0f, 25 * 0.5f}, unknown{{512, 530}, 4, 30, 0, 0};
  ASSERT_FALSE(test::kernel_targets().empty());
  for (const std::int64_t target : test::kernel_targets()) {
    const test::OnlyTarget only(target);
    std::mt19937 draw(11);
    for (const int count : {1, 3, 15, 16, 17, 100, 512}) {
      for (const defect_rows::Bounds& bounds : {known, unknown}) {
        expect_marks_of_noise<std::uint16_t>(draw, count, bounds);
        expect_marks_of_noise<float>(draw, count, bounds);
      }
    }
  }
}

TEST(DefectRows, MarkNothingInAFlatAndAllThatDiffersWithoutBounds) {
  ThreeRows<std::uint16_t> of(64);
  for (int r = 0; r < 3; ++r) std::fill_n(of.row(r), of.width, std::uint16_t{65535});
  expect_marks(of, 64, {});
  of.row(1)[20] = 65534;
  of.row(1)[33] = 0;
  expect_marks(of, 64, {});
}

}  // namespace
}  // namespace lowlux::isp
