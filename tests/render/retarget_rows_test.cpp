#include "isp/render/retarget/retarget_rows.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>
#include <random>
#include <vector>

#include "isp/base/executor.h"
#include "isp/render/retarget/retarget_table.h"
#include "tests/reference/retarget_ref.h"

namespace lowlux::isp {
namespace {

// Nodes without any order, so that a wrong node is seen.
RetargetTable random_table(int levels, unsigned seed) {
  std::mt19937 draw(seed);
  RetargetTable table{levels, {}};
  table.nodes.resize(2 * static_cast<std::size_t>(levels) * levels * levels);
  for (std::size_t i = 0; i < table.nodes.size(); ++i) {
    table.nodes[i] = static_cast<std::int32_t>(i % 2 == 0 ? draw() : draw() % 65536);
  }
  return table;
}

std::vector<std::uint16_t> random_codes(int width, unsigned seed) {
  std::mt19937 draw(seed);
  std::vector<std::uint16_t> out(3 * static_cast<std::size_t>(width));
  for (auto& code : out) {
    const auto kind = draw() % 8;  // ends and ties are where cells and tetrahedra meet
    code = static_cast<std::uint16_t>(kind == 0 ? 0 : kind == 1 ? 65535 : kind == 2 ? 32768 : draw() % 65536);
  }
  return out;
}

Vector3 expected(const RetargetTable& table, const std::vector<std::uint16_t>& rgb, int x) {
  Vector3 code{};
  for (std::size_t c = 0; c < 3; ++c) code[c] = rgb[3 * static_cast<std::size_t>(x) + c] / 65535.0;
  return reference::looked_up(table, code);
}

// Largest distances of rows of one table and width from the reference; codes beyond the row must stay.
struct Distance {
  double codes8 = 0, codes16 = 0, looked_up = 0;
};

Distance distance(const RetargetTable& table, int width, unsigned seed) {
  const auto rgb = random_codes(width, seed);
  std::vector<std::uint8_t> out8(rgb.size() + 8, 0xA5);
  std::vector<std::uint16_t> out16(rgb.size() + 8, 0xA5A5);
  apply(table, rgb.data(), width, out8.data());
  apply(table, rgb.data(), width, out16.data());
  for (std::size_t i = rgb.size(); i < out8.size(); ++i) {
    EXPECT_EQ(out8[i], 0xA5);
    EXPECT_EQ(out16[i], 0xA5A5);
  }
  Distance worst;
  for (int x = 0; x < width; ++x) {
    const Vector3 want = expected(table, rgb, x);
    const std::size_t at = 3 * static_cast<std::size_t>(x);
    const Vector3 scalar = looked_up(table, {rgb[at] / 65535.0, rgb[at + 1] / 65535.0, rgb[at + 2] / 65535.0});
    for (std::size_t c = 0; c < 3; ++c) {
      worst.codes8 = std::fmax(worst.codes8, std::fabs(out8[at + c] - 255 * want[c]));
      worst.codes16 = std::fmax(worst.codes16, std::fabs(out16[at + c] - 65535 * want[c]));
      worst.looked_up = std::fmax(worst.looked_up, std::fabs(scalar[c] - want[c]));
    }
  }
  return worst;
}

TEST(RetargetRows, AreThoseOfTheReferenceForAllTableSizes) {
  for (const int levels : {2, 3, 17, 33, 65}) {
    const Distance worst = distance(random_table(levels, 7), 4001, 11);
    // Half a code of rounding, and what a fraction of a cell in float, 64 * 2^-24, moves codes between two nodes that
    // are 65535 apart: 0.25 of 65535, and as much again for two more such differences.
    EXPECT_LT(worst.codes16, 0.5 + 3 * 0.25) << levels;
    EXPECT_LT(worst.codes8, 0.5 + 0.003) << levels;
    EXPECT_LT(worst.looked_up, 1e-10) << levels << ": double, 2^-52 times 64 levels and some sums";
  }
}

TEST(RetargetRows, EveryWidthTakesTheSameWayAndWritesNothingBeyond) {
  const RetargetTable table = random_table(5, 3);
  for (int width = 0; width <= 70; ++width) {
    const Distance worst = distance(table, width, static_cast<unsigned>(width));
    EXPECT_LT(worst.codes16, 0.5 + 3 * 0.25) << width;
  }
}

TEST(RetargetRows, ARowInPlaceAndInPiecesIsTheSameRow) {
  const RetargetTable table = random_table(9, 5);
  auto rgb = random_codes(101, 1);
  std::vector<std::uint16_t> whole(rgb.size()), pieces(rgb.size());
  apply(table, rgb.data(), 101, whole.data());
  apply(table, rgb.data(), 37, pieces.data());
  apply(table, rgb.data() + 3 * 37, 64, pieces.data() + 3 * 37);
  apply(table, rgb.data(), 101, rgb.data());
  EXPECT_EQ(pieces, whole);
  EXPECT_EQ(rgb, whole);
}

TEST(RetargetTable, TheIdentityIsKeptAndGreysStayGrey) {
  InlineExecutor one;
  const RetargetTable table = tabulated([](const Vector3& code) { return code; }, 33, one);
  std::vector<std::uint16_t> rgb;
  rgb.reserve(3 * std::size_t{256});
  for (int v = 0; v <= 255; ++v) rgb.insert(rgb.end(), 3, static_cast<std::uint16_t>(257 * v));
  std::vector<std::uint8_t> out(rgb.size());
  apply(table, rgb.data(), 256, out.data());
  for (std::size_t i = 0; i < out.size(); ++i) EXPECT_EQ(out[i], rgb[i] / 257);
}

TEST(RetargetTable, ErrorsAreThoseOfTheWorstAndTheMeanColour) {
  InlineExecutor one;
  PoolExecutor two(2);
  const CodeMap square = [](const Vector3& c) { return Vector3{c[0] * c[0], c[1], c[2]}; };
  const RetargetTable coarse = tabulated(square, 17, one);
  EXPECT_EQ(tabulated(square, 17, two).nodes, coarse.nodes) << "whatever the number of threads";
  const TableError error = table_error(coarse, square, 5000, two);
  // A parabola between nodes h apart is off by h^2 / 4 at most, in the middle, and by two thirds of it in the mean.
  const double largest = 255.0 / (16 * 16 * 4);
  EXPECT_NEAR(error.max_steps, largest, 0.01 * largest);
  EXPECT_NEAR(error.mean_steps, largest * 2 / 3, 0.02 * largest);
  EXPECT_GT(error.max_ciede2000, error.mean_ciede2000);
}

TEST(RetargetTable, IsDoubledOnlyWhereItHasToBe) {
  PoolExecutor two(2);
  const CodeMap smooth = [](const Vector3& c) { return c; };
  EXPECT_EQ(tabulated_to(smooth, 0.05, two).table.levels, 33);
  // A step as wide as a cell of the table: no size follows it.
  const CodeMap steep = [](const Vector3& c) { return Vector3{c[0] > 0.51 ? 1.0 : 0.0, c[1], c[2]}; };
  const MeasuredTable best = tabulated_to(steep, 0.05, two);
  EXPECT_EQ(best.table.levels, 65);
  EXPECT_GT(best.error.mean_ciede2000, 0.05) << "and that it is not good enough can be told";
}

}  // namespace
}  // namespace lowlux::isp
