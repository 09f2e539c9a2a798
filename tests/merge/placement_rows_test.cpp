#include "isp/merge/placement_rows.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <limits>
#include <random>
#include <vector>

namespace lowlux::merge::rows::placement_rows_test {
namespace {

constexpr float nan = std::numeric_limits<float>::quiet_NaN();

class Draw {
 public:
  explicit Draw(std::uint64_t seed) : words_(seed) {}
  double uniform(double least, double most) { return std::uniform_real_distribution(least, most)(words_); }
  int log_uniform(int least, int most) {
    return static_cast<int>(std::exp(uniform(std::log(least), std::log(most + 1))));
  }
  bool chance(double p) { return uniform(0, 1) < p; }

 private:
  std::mt19937_64 words_;
};

/// Random samples with the displacements of one row: those of a camera that turns, or any.
struct Case {
  explicit Case(std::uint64_t seed) : draw(seed) {
    width = draw.log_uniform(1, 90);
    height = draw.log_uniform(1, 40);
    y = static_cast<int>(draw.uniform(0, height));
    const double missing = draw.chance(0.5) ? 0 : 0.2;
    for (std::vector<float>& plane : planes) {
      plane.resize(static_cast<std::size_t>(width) * static_cast<std::size_t>(height));
      for (float& v : plane) v = static_cast<float>(draw.uniform(-100, 1000));
    }
    with_gaps = planes[0];
    for (float& v : with_gaps) v = draw.chance(missing) ? nan : v;
    const bool turns = draw.chance(0.7), whole = draw.chance(0.2);
    const double shift_x = draw.uniform(-1, 1) * width, shift_y = draw.uniform(-1, 1) * height;
    const double along = draw.uniform(-0.1, 0.1), across = draw.uniform(-0.1, 0.1);
    for (int x = 0; x < width; ++x) {
      double u = turns ? shift_x / 3 + along * x : draw.uniform(-1.2, 1.2) * width;
      double v = turns ? shift_y / 3 + across * x : draw.uniform(-1.2, 1.2) * height;
      if (whole) u = std::round(u), v = std::round(v);
      if (!turns && draw.chance(0.05)) u = draw.chance(0.5) ? static_cast<double>(nan) : 1e30;
      dx.push_back(static_cast<float>(u));
      dy.push_back(static_cast<float>(v));
    }
  }

  Samples samples(const std::vector<float>& plane) const { return {plane.data(), width, width, height}; }
  DisplacedRow row() const { return {y, width, dx.data(), dy.data()}; }
  double at(const std::vector<float>& plane, int u, int v) const {
    return static_cast<double>(plane[static_cast<std::size_t>(v) * static_cast<std::size_t>(width) + u]);
  }
  bool exists(int u, int v) const { return u >= 0 && v >= 0 && u < width && v < height; }

  Draw draw;
  int width, height, y;
  std::array<std::vector<float>, 2> planes;
  std::vector<float> with_gaps, dx, dy;
};

template <class Work>
void for_cases(const Work& work) {
  for (std::uint64_t seed = 1; seed <= 600; ++seed) {
    const Case of(seed);
    SCOPED_TRACE(testing::Message() << "seed " << seed << ": " << of.width << " x " << of.height << ", row " << of.y);
    work(of);
    if (testing::Test::HasFailure()) return;
  }
}

double keys(double d) {
  d = std::abs(d);
  if (d < 1) return 1.5 * d * d * d - 2.5 * d * d + 1;
  return d < 2 ? -0.5 * d * d * d + 2.5 * d * d - 4 * d + 2 : 0;
}

TEST(PlacementRows, InterpolationIsCubicConvolution) {
  int inside = 0, outside = 0;
  for_cases([&](const Case& of) {
    std::vector<float> out(of.dx.size());
    interpolate_row(of.samples(of.planes[0]), of.samples(of.planes[1]), of.row(), out.data());
    for (int x = 0; x < of.width; ++x) {
      const double u = x + static_cast<double>(of.dx[x]), v = of.y + static_cast<double>(of.dy[x]);
      if (!(u >= 0 && v >= 0 && u <= of.width - 1 && v <= of.height - 1)) {
        EXPECT_TRUE(std::isnan(out[x])) << x;
        ++outside;
        continue;
      }
      double sum = 0;
      for (int j = -1; j <= 2; ++j) {
        for (int i = -1; i <= 2; ++i) {
          const int left = static_cast<int>(std::floor(u)) + i, top = static_cast<int>(std::floor(v)) + j;
          const double value = of.at(of.planes[static_cast<std::size_t>(x & 1)], std::clamp(left, 0, of.width - 1),
                                     std::clamp(top, 0, of.height - 1));
          sum += keys(u - left) * keys(v - top) * value;
        }
      }
      EXPECT_NEAR(static_cast<double>(out[x]), sum, 5e-3) << x;  // 16 products of values up to 1000, single precision
      ++inside;
    }
  });
  EXPECT_GT(inside, 3000);
  EXPECT_GT(outside, 1000);
}

TEST(PlacementRows, TheNearestSampleOfASiteIsAtMostAPixelAway) {
  for_cases([](const Case& of) {
    std::vector<float> out(of.dx.size());
    nearest_row(of.samples(of.with_gaps), of.row(), out.data());
    for (int x = 0; x < of.width; ++x) {
      const auto dx = static_cast<double>(of.dx[x]), dy = static_cast<double>(of.dy[x]);
      // Both of two samples that are a pixel away are nearest.
      bool found = std::isnan(out[x]);
      for (int v = (of.y & 1); v < of.height; v += 2) {
        for (int u = (x & 1); u < of.width; u += 2) {
          if (!(std::abs(u - x - dx) <= 1) || !(std::abs(v - of.y - dy) <= 1)) continue;
          const double value = of.at(of.with_gaps, u, v);
          if (!std::isnan(value) && std::abs(u - x - dx) < 1 && std::abs(v - of.y - dy) < 1) {
            EXPECT_EQ(static_cast<double>(out[x]), value) << x;
          }
          found = found || static_cast<double>(out[x]) == value;
        }
      }
      EXPECT_TRUE(found) << x;
    }
  });
}

TEST(PlacementRows, DropsAreSumsOverTheirColour) {
  for_cases([](const Case& of) {
    const int red_column = of.width & 1, red_row = of.height & 1;
    const auto colour = [&](int x, int y) { return ((x ^ red_column) & 1) + ((y ^ red_row) & 1); };
    for (const DropRadius& of_row : {DropRadius{0.5F, 0.5F}, {1, 1.3F}, {1.5F, 0.7F}, {1.5F, 2}, {2, 2}}) {
      std::vector<float> value(of.dx.size()), weight(of.dx.size());
      drop_row({of.samples(of.with_gaps), red_column, red_row}, of.row(), of_row, value.data(), weight.data());
      for (int x = 0; x < of.width; ++x) {
        const float radius = x % 2 == 0 ? of_row.even : of_row.odd;
        double sum = 0, weights = 0;
        for (int v = 0; v < of.height; ++v) {
          for (int u = 0; u < of.width; ++u) {
            const double tx = 1 - std::abs(u - x - static_cast<double>(of.dx[x])) / static_cast<double>(radius);
            const double ty = 1 - std::abs(v - of.y - static_cast<double>(of.dy[x])) / static_cast<double>(radius);
            if (!(tx > 0) || !(ty > 0) || colour(u, v) != colour(x, of.y) || std::isnan(of.at(of.with_gaps, u, v))) {
              continue;
            }
            sum += tx * ty * of.at(of.with_gaps, u, v);
            weights += tx * ty;
          }
        }
        EXPECT_NEAR(static_cast<double>(weight[x]), weights, 1e-4) << x;
        if (weights > 1e-3) {
          EXPECT_NEAR(static_cast<double>(value[x]), sum / weights, 0.2) << x;  // 1e-4 of the least weight, of 1000
        }
        EXPECT_EQ(std::isnan(value[x]), !(weight[x] > 0)) << x;
      }
    }
  });
}

TEST(PlacementRows, EveryPixelGetsTheSumsOfEachColour) {
  std::array<int, 3> hits{};
  for_cases([&](const Case& of) {
    const int red_column = of.width & 1, red_row = of.height & 1;
    const auto colour = [&](int x, int y) { return ((x ^ red_column) & 1) + ((y ^ red_row) & 1); };
    for (const ColourRadius& radius : {ColourRadius{0.75F, 0.9F}, {1, 1}, {0.5F, 0.6F}}) {
      std::array<std::vector<float>, 3> value, weight;
      ColourRow out{};
      for (std::size_t c = 0; c < 3; ++c) {
        value[c].resize(of.dx.size());
        weight[c].resize(of.dx.size());
        out.value[c] = value[c].data();
        out.weight[c] = weight[c].data();
      }
      colour_row({of.samples(of.with_gaps), red_column, red_row}, of.row(), radius, out);
      for (int x = 0; x < of.width; ++x) {
        std::array<double, 3> sum{}, weights{};
        for (int v = 0; v < of.height; ++v) {
          for (int u = 0; u < of.width; ++u) {
            const auto c = static_cast<std::size_t>(colour(u, v));
            const double px = static_cast<double>(c == 1 ? radius.green : radius.red_blue);
            const double tx = 1 - std::abs(u - x - static_cast<double>(of.dx[x])) / px;
            const double ty = 1 - std::abs(v - of.y - static_cast<double>(of.dy[x])) / px;
            if (!(tx > 0) || !(ty > 0) || std::isnan(of.at(of.with_gaps, u, v))) continue;
            sum[c] += tx * ty * of.at(of.with_gaps, u, v);
            weights[c] += tx * ty;
          }
        }
        for (std::size_t c = 0; c < 3; ++c) {
          // At most two samples, of up to 1000, whose weights are rounded by half a step.
          const double rounding = (c == 1 ? 2 : 1) * 0.501 / 256;
          EXPECT_NEAR(static_cast<double>(weight[c][x]), weights[c], rounding) << x << ", colour " << c;
          EXPECT_NEAR(static_cast<double>(value[c][x]), sum[c], 1000 * rounding) << x << ", colour " << c;
          EXPECT_EQ(std::fmod(256 * weight[c][x], 1.0F), 0) << x << ", colour " << c;
          hits[c] += weight[c][x] > 0 ? 1 : 0;
        }
      }
    }
  });
  for (const int count : hits) EXPECT_GT(count, 5000);
}

}  // namespace
}  // namespace lowlux::merge::rows::placement_rows_test
