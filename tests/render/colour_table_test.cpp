#include "isp/render/colour_table.h"
#include "isp/model/colour/colour_difference.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "isp/base/look_grid.h"
#include "isp/base/random/random.h"
#include "isp/model/appearance/entropy_model.h"
#include "isp/model/spectrum/cie_data.h"
#include "isp/model/spectrum/spectral_data.h"
#include "isp/render/colour_table_rows.h"
#include "tests/reference/colour_table_ref.h"
#include "tests/support/only_target.h"

namespace lowlux::isp {
namespace {

constexpr float infinite = std::numeric_limits<float>::infinity();
constexpr float not_a_number = std::numeric_limits<float>::quiet_NaN();

const ColourMap identity = [](const Xyz& c) { return c; };
/// Not homogeneous: a power of luminance, and a turn of chromaticity that grows with it.
const ColourMap compressive = [](const Xyz& c) {
  const double y = std::fmax(c.y, 0), gain = std::pow(y + 1e-4, -0.3), turn = 0.2 * y / (1 + y);
  return Xyz{gain * (c.x + turn * c.z), gain * c.y, gain * (c.z - turn * c.x)};
};

/// Draws in 0..1.
struct Draws {
  std::uint32_t next = 0;
  double operator()() {
    const auto words = philox4x32_10({next++, 1, 2, 3}, {4, 5});
    return (static_cast<double>(words[0]) + 0.5) / 4294967296.0;
  }
};

using Pixels = std::vector<std::array<float, 3>>;

Pixels shown(const ColourTable& table, const Pixels& in, int width = 0) {
  if (width == 0) width = static_cast<int>(in.size());
  const int height = static_cast<int>(in.size()) / width;
  SceneLinear planes(width, height);
  for (std::size_t i = 0; i < in.size(); ++i) {
    for (int c = 0; c < 3; ++c) planes.plane[c].data()[i] = in[i][c];
  }
  PoolExecutor two(2);
  apply_colour_table(table, std::as_const(planes).view(), planes.view(), two);
  Pixels out(in.size());
  for (std::size_t i = 0; i < in.size(); ++i) {
    for (int c = 0; c < 3; ++c) out[i][c] = planes.plane[c].data()[i];
  }
  return out;
}

/// Colours in and out of gamut, over many brightnesses.
Pixels any_colours(int count) {
  Draws draw;
  Pixels out;
  for (int i = 0; i < count; ++i) {
    const double size = std::exp2(24 * draw() - 20);
    std::array<float, 3> colour{};
    for (float& c : colour) c = static_cast<float>(size * (1.5 * draw() - 0.5));
    out.push_back(colour);
  }
  return out;
}

const Matrix3 rec709 = *rgb_to_xyz(primaries_rec709);
const Xyz white = xyz_of(rec709 * Vector3{1, 1, 1});

double difference(const ColourMap& map, const std::array<float, 3>& in, const std::array<float, 3>& out) {
  const Xyz exact = map(xyz_of(rec709 * Vector3{in[0], in[1], in[2]}));
  EXPECT_TRUE(std::isfinite(out[0] + out[1] + out[2]) && std::isfinite(exact.x + exact.y + exact.z));  // else 0
  return ciede2000(lab_of(xyz_of(rec709 * Vector3{out[0], out[1], out[2]}), white), lab_of(exact, white));
}

const ColourTable& entropy_table() {
  static const ColourTable table = *make_colour_table(*entropy_appearance().at({.white_cd_m2 = 0.5}), {});
  return table;
}
const ColourTable& compressive_table() {
  static const ColourTable table = *make_colour_table(compressive, {});
  return table;
}

// Float against double: 2^-24 in each of about ten steps, and in the place within a cell, where neighbouring nodes can
// differ by their own size; times the number of cells. Relative to the sum of what is interpolated.
constexpr double rounding = 1e-5;

Result<ColourMap> entropy_with_noise(double noise_to_signal) {
  ViewingConditions scene{.white_cd_m2 = 5};
  scene.noise = ColourNoise{.covariance = noise_covariance_of_xyz({.variance_e2 = {1, 1, 1}, .camera_to_xyz = rec709}),
                            .to_signal = noise_to_signal};
  return entropy_appearance().at(scene);
}

const ColourTable& noise_table() {
  static const ColourTable table = *make_noise_colour_table(entropy_with_noise, {});
  return table;
}

/// Passes colours through noise_table(); planes of `width` pixels, ratios of signal to noise linear between cells.
Pixels shown_with_noise(const Pixels& in, int width, const Plane<float>& ratios) {
  const int height = static_cast<int>(in.size()) / width;
  SceneLinear planes(width, height);
  for (std::size_t i = 0; i < in.size(); ++i) {
    for (int c = 0; c < 3; ++c) planes.plane[c].data()[i] = in[i][c];
  }
  PoolExecutor two(2);
  apply_colour_table(noise_table(), std::as_const(planes).view(), NoiseGrid{ratios.view()}, planes.view(), two);
  Pixels out(in.size());
  for (std::size_t i = 0; i < in.size(); ++i) {
    for (int c = 0; c < 3; ++c) out[i][c] = planes.plane[c].data()[i];
  }
  return out;
}

/// The ratio of noise to signal at a pixel, by the definition of NoiseGrid.
double ratio_at(const Plane<float>& ratios, int x, int y) {
  const auto axis = [](int pixel, int cells) {
    const double place = std::clamp((pixel + 0.5) / LookGrid::cell - 0.5, 0.0, cells - 1.0);
    const int cell = std::min(static_cast<int>(place), std::max(cells - 2, 0));
    return std::pair(cell, place - cell);
  };
  const auto [i, s] = axis(x, ratios.width());
  const auto [j, t] = axis(y, ratios.height());
  const int right = std::min(i + 1, ratios.width() - 1), down = std::min(j + 1, ratios.height() - 1);
  const double top = (1 - s) * ratios.at(i, j) + s * ratios.at(right, j);
  const double bottom = (1 - s) * ratios.at(i, down) + s * ratios.at(right, down);
  return 1 / std::clamp((1 - t) * top + t * bottom, 1e-6, 1e6);
}

// Widths and heights below, at and above a cell, ratios from nothing to no signal at all.
TEST(ColourTable, KernelByNoiseIsTheReferenceForEveryInstructionSet) {
  Draws draw{1000};
  for (const auto& [width, height] : {std::pair(1, 1), {3, 40}, {16, 16}, {17, 33}, {131, 29}}) {
    const Pixels in = any_colours(width * height);
    Plane<float> ratios(cells_along(width), cells_along(height));
    for (std::size_t i = 0; i < ratios.size(); ++i) {
      ratios.data()[i] = i % 7 == 3 ? 1e6f : i % 5 == 2 ? -1.0f : static_cast<float>(std::exp2(16 * draw() - 7));
    }
    for (const std::int64_t target : test::kernel_targets()) {
      const test::OnlyTarget only(target);
      const Pixels out = shown_with_noise(in, width, ratios);
      for (std::size_t i = 0; i < in.size(); ++i) {
        const double ratio = ratio_at(ratios, static_cast<int>(i) % width, static_cast<int>(i) / width);
        const Vector3 expected = reference::through_colour_table(noise_table(), {in[i][0], in[i][1], in[i][2]}, ratio);
        const double size = std::fabs(in[i][0]) + std::fabs(in[i][1]) + std::fabs(in[i][2]);
        const double gain = std::fabs(noise_table().grey[0]) + 1;
        for (int c = 0; c < 3; ++c) {
          ASSERT_NEAR(out[i][c], expected[c], rounding * gain * size) << i << " " << hwy::TargetName(target);
        }
      }
    }
  }
}

// Ratios and colours within the gamut drawn anew, not at the centres that the table was measured at.
TEST(ColourTable, ByNoiseIsWithinItsBoundOfTheMap) {
  EXPECT_TRUE(noise_table().within_bound);
  EXPECT_TRUE(noise_table().by_noise);
  Draws draw{5000};
  std::vector<double> errors;
  for (int i = 0; i < 60; ++i) {
    const auto ratio = static_cast<float>(std::exp2(16 * draw() - 9));
    const ColourMap map = *entropy_with_noise(ratio);
    Plane<float> ratios(4, 1);
    std::fill_n(ratios.data(), ratios.size(), 1 / ratio);
    Pixels in;
    for (int k = 0; k < 16; ++k) {
      in.push_back({static_cast<float>(draw()), static_cast<float>(draw()), static_cast<float>(draw())});
    }
    const Pixels out = shown_with_noise(in, 16, ratios);
    for (std::size_t k = 0; k < in.size(); ++k) errors.push_back(difference(map, in[k], out[k]));
  }
  // Of n colours, 1 % may be beyond the bound, and 5 standard errors.
  const auto n = static_cast<double>(errors.size());
  EXPECT_LE(static_cast<double>(std::ranges::count_if(errors, [](double error) { return error > 0.5; })),
            0.01 * n + 5 * std::sqrt(0.0099 * n));
}

TEST(ColourTable, ByNoiseReportsTheErrorsOfItsMaps) {
  const auto refuses = [](double) -> Result<ColourMap> { return fail(ErrorCode::invalid_argument, "no such map"); };
  const auto table = make_noise_colour_table(refuses, {});
  ASSERT_FALSE(table);
  EXPECT_EQ(table.error().message, "no such map");
  const auto from_one = [](double ratio) -> Result<ColourMap> {
    if (ratio > 1) return fail(ErrorCode::invalid_argument, "too much noise");
    return identity;
  };
  EXPECT_FALSE(make_noise_colour_table(from_one, {}));
  EXPECT_FALSE(make_noise_colour_table(entropy_with_noise, {.limit = 0}));
}

TEST(ColourTable, KernelIsTheReferenceForEveryInstructionSet) {
  const Pixels in = any_colours(4001);
  for (const ColourTable* table : {&entropy_table(), &compressive_table()}) {
    for (const std::int64_t target : test::kernel_targets()) {
      const test::OnlyTarget only(target);
      ASSERT_STREQ(table_rows::target_name(), hwy::TargetName(target));
      const Pixels out = shown(*table, in);
      for (std::size_t i = 0; i < in.size(); ++i) {
        const Vector3 expected = reference::through_colour_table(*table, {in[i][0], in[i][1], in[i][2]});
        const double size = std::fabs(in[i][0]) + std::fabs(in[i][1]) + std::fabs(in[i][2]);
        const double gain = std::fabs(table->grey[0]) + 1;
        for (int c = 0; c < 3; ++c) {
          ASSERT_NEAR(out[i][c], expected[c], rounding * gain * size) << i << " " << hwy::TargetName(target);
        }
      }
    }
  }
}

TEST(ColourTable, OfTheIdentityIsTheIdentity) {
  const ColourTable table = *make_colour_table(identity, {});
  EXPECT_EQ(table.levels, 1) << "homogeneous";
  EXPECT_EQ(table.cells, 32) << "as coarse as can be";
  EXPECT_TRUE(table.within_bound);
  EXPECT_LT(table.error.largest, 1e-3);
  Draws draw;
  Pixels in;
  for (int i = 0; i < 1000; ++i) {
    in.push_back({static_cast<float>(draw()), static_cast<float>(draw()), static_cast<float>(draw() - 0.05)});
  }
  const Pixels out = shown(table, in);
  for (std::size_t i = 0; i < in.size(); ++i) {
    const float sum = in[i][0] + in[i][1] + in[i][2];
    if (std::min({in[i][0], in[i][1], in[i][2]}) < -table.margin * sum) continue;
    for (int c = 0; c < 3; ++c) EXPECT_NEAR(out[i][c], in[i][c], rounding * sum);
  }
}

TEST(ColourTable, MovesColoursFarOutOfGamutAtEqualLuminance) {
  const ColourTable table = *make_colour_table(identity, {});
  const Pixels in = any_colours(1000), out = shown(table, in);
  int moved = 0;
  for (std::size_t i = 0; i < in.size(); ++i) {
    const auto luminance = [&](const std::array<float, 3>& c) {
      return table.luminance[0] * c[0] + table.luminance[1] * c[1] + table.luminance[2] * c[2];
    };
    const double size = std::fabs(in[i][0]) + std::fabs(in[i][1]) + std::fabs(in[i][2]);
    EXPECT_NEAR(luminance(out[i]), luminance(in[i]), rounding * size);
    if (luminance(in[i]) <= 0) continue;
    const double sum = out[i][0] + out[i][1] + out[i][2];
    EXPECT_GE(std::min({out[i][0], out[i][1], out[i][2]}), -table.margin * sum - rounding * size);
    moved += std::fabs(out[i][0] - in[i][0]) > 1e-3 * size;
  }
  EXPECT_GT(moved, 200);
}

TEST(ColourTable, FindsOutWhetherAMapIsHomogeneous) {
  EXPECT_EQ(entropy_table().levels, 1);
  EXPECT_GT(compressive_table().levels, 1);
  const auto literal = entropy_colour_map({.white_cd_m2 = 0.5}, {.variant = EntropyVariant::thesis});
  EXPECT_EQ(make_colour_table(*literal, {.error_bound = 5})->levels, 1);
}

void expect_close(const ColourTable& table, const ColourMap& map, const Pixels& in) {
  const Pixels out = shown(table, in);
  std::vector<double> all;
  for (std::size_t i = 0; i < in.size(); ++i) all.push_back(difference(map, in[i], out[i]));
  std::sort(all.begin(), all.end());
  // A share of 1 % beyond the bound is allowed: of n colours 1 % + 5 standard errors sqrt(0.0099 / n).
  const auto n = static_cast<double>(all.size());
  const auto beyond = static_cast<double>(all.end() - std::upper_bound(all.begin(), all.end(), 0.5));
  EXPECT_LE(beyond / n, 0.01 + 5 * std::sqrt(0.0099 / n));
  EXPECT_LT(all.back(), 5 * table.error.largest) << "colours at random find hardly worse than the middles of cells";
}

TEST(ColourTable, KeepsItsBoundOnColoursAtRandom) {
  Draws draw;
  Pixels in;
  for (int i = 0; i < 1000; ++i) {
    in.push_back({static_cast<float>(draw()), static_cast<float>(draw()), static_cast<float>(draw())});
  }
  EXPECT_TRUE(entropy_table().within_bound);
  EXPECT_LE(entropy_table().error.p99, 0.5);
  EXPECT_LE(entropy_table().error.mean, entropy_table().error.p99);
  expect_close(entropy_table(), *entropy_appearance().at({.white_cd_m2 = 0.5}), in);
  EXPECT_TRUE(compressive_table().within_bound);
  expect_close(compressive_table(), compressive, in);
}

TEST(ColourTable, KeepsItsBoundOnTheColoursOfAChart) {
  const auto map = *entropy_appearance().at({.white_cd_m2 = 0.5});
  const Spectrum daylight = *light_named("D65");
  const Matrix3 to_rgb = *inverse(rec709);
  Pixels in;
  for (const NamedSpectrum& patch : spectra_of(SpectrumSet::colorchecker)) {
    const Vector3 rgb = to_rgb * vector_of(*xyz_of_reflectance(patch.spectrum, daylight));
    for (const double light : {1.0, 0.1, 0.01}) {
      in.push_back(
          {static_cast<float>(light * rgb[0]), static_cast<float>(light * rgb[1]), static_cast<float>(light * rgb[2])});
    }
  }
  const Pixels out = shown(entropy_table(), in);
  for (std::size_t i = 0; i < in.size(); ++i) EXPECT_LT(difference(map, in[i], out[i]), 0.5) << i / 3;
}

TEST(ColourTable, RefinesUntilTheBoundOrTheLimit) {
  const auto map = *entropy_appearance().at({.white_cd_m2 = 0.5});
  const auto coarse = make_colour_table(map, {.error_bound = 20}), fine = make_colour_table(map, {.error_bound = 0.02});
  ASSERT_TRUE(coarse && fine);
  EXPECT_EQ(coarse->cells, 32);
  EXPECT_TRUE(fine->within_bound);
  EXPECT_GT(fine->cells, 32);
  EXPECT_LT(fine->error.mean, 0.5 * coarse->error.mean);
  const auto small = make_colour_table(compressive, {.error_bound = 1e-9, .largest_bytes = std::size_t{512} << 10});
  ASSERT_TRUE(small);
  EXPECT_FALSE(small->within_bound);
  EXPECT_EQ(small->cells, 16);
  EXPECT_EQ(small->levels_per_octave, 2) << "33 x 33 x 37 nodes of 16 bytes are more than 512 KiB";
  EXPECT_LE(small->node.size() * sizeof(float), std::size_t{512} << 10);
  EXPECT_GT(small->error.p99, 1e-9);
}

/// Largest step of the answer along a line of so many steps.
double steepest(const ColourTable& table, const Vector3& from, const Vector3& to, int steps) {
  Pixels in;
  for (int i = 0; i <= steps; ++i) {
    std::array<float, 3> colour{};
    for (int c = 0; c < 3; ++c) colour[c] = static_cast<float>(from[c] + i * (to[c] - from[c]) / steps);
    in.push_back(colour);
  }
  const Pixels out = shown(table, in);
  double most = 0;
  for (int i = 1; i <= steps; ++i) {
    for (int c = 0; c < 3; ++c) most = std::max(most, std::fabs(static_cast<double>(out[i][c]) - out[i - 1][c]));
  }
  return most;
}

// In steps a quarter as long the answer moves a quarter as far, where a jump would stay what it is.
void expect_no_jumps(const ColourTable& table, const Vector3& from, const Vector3& to) {
  const double coarse = steepest(table, from, to, 20'000), fine = steepest(table, from, to, 80'000);
  EXPECT_LT(fine, 0.3 * coarse + rounding * 0.1) << from[0] << " to " << to[0];
}

TEST(ColourTable, HasNoSeams) {
  for (const ColourTable* table : {&entropy_table(), &compressive_table()}) {
    expect_no_jumps(*table, {1, 0, 0}, {0, 1, 0});
    expect_no_jumps(*table, {0.3, 0.1, 0.9}, {0.9, 0.8, 0.05});
    expect_no_jumps(*table, {0, 0, 0}, {2, 3, 4});
    expect_no_jumps(*table, {0.5, -0.1, 0.3}, {-0.3, 0.6, -0.1});  // through the border of the table
    expect_no_jumps(*table, {0.3, -0.4, 0.1}, {0.3, 0.4, 0.1});    // and from negative luminance
  }
}

TEST(ColourTable, AcceptsValuesThatAreNotColours) {
  for (const ColourTable* table : {&entropy_table(), &compressive_table()}) {
    const Pixels in{{0, 0, 0},           {not_a_number, not_a_number, not_a_number},
                    {0.2f, 0.5f, 0},     {0.2f, 0.5f, not_a_number},
                    {-1, -1, -1},        {infinite, infinite, infinite},
                    {0, -infinite, 0},   {infinite, -infinite, 1},
                    {1e-38f, 1e-40f, 0}, {3e38f, 3e38f, 3e38f}};
    const Pixels out = shown(*table, in);
    for (const auto& pixel : out) {
      for (const float c : pixel) EXPECT_TRUE(std::isfinite(c));
    }
    for (int c = 0; c < 3; ++c) {
      EXPECT_EQ(out[0][c], 0);
      EXPECT_EQ(out[1][c], 0);
      EXPECT_EQ(out[2][c], out[3][c]);
      EXPECT_NEAR(out[4][c], -table->grey[c], rounding * table->grey[c]) << "grey, scaled";
    }
  }
}

TEST(ColourTable, EveryWidthGivesTheSamePixels) {
  const Pixels in = any_colours(16 * 37);
  const Pixels whole = shown(entropy_table(), in);
  for (const int width : {1, 2, 7, 16, 37}) {
    Pixels first(in.begin(), in.begin() + width * (static_cast<int>(in.size()) / width));
    const Pixels out = shown(entropy_table(), first, width);
    for (std::size_t i = 0; i < out.size(); ++i) ASSERT_EQ(out[i], whole[i]) << width;
  }
}

TEST(ColourTable, RefusesWhatNoTableCanBeMadeOf) {
  EXPECT_FALSE(make_colour_table(identity, {.limit = 0}));
  EXPECT_FALSE(make_colour_table(identity, {.limit = std::nan("")}));
  EXPECT_FALSE(make_colour_table(identity, {.limit = 2e6}));
  EXPECT_FALSE(make_colour_table(identity, {.error_bound = 0}));
  EXPECT_FALSE(make_colour_table(identity, {.largest_bytes = (std::size_t{512} << 10) - 1}));
  EXPECT_FALSE(make_colour_table(identity, {.largest_bytes = std::size_t{1} << 40}));
  EXPECT_FALSE(make_colour_table(identity, {.rgb_to_xyz = identity3()})) << "X and Z have no luminance";
  const Matrix3 in_line{{{1, 1, 1}, {1, 1, 1}, {1, 1, 2}}};
  EXPECT_FALSE(make_colour_table(identity, {.rgb_to_xyz = in_line}));
  const auto bad = make_colour_table([](const Xyz&) { return Xyz{std::nan(""), 0, 0}; }, {});
  ASSERT_FALSE(bad);
  EXPECT_EQ(bad.error().code, ErrorCode::invalid_argument);
  EXPECT_FALSE(make_colour_table([](const Xyz& c) { return Xyz{1e200 * c.x, c.y, c.z}; }, {})) << "no float";
  const Matrix3 to_rgb = *inverse(rec709);
  const auto holed = make_colour_table(
      [&](const Xyz& c) {  // not a number at the middle of one cell, fine at all nodes
        const Vector3 rgb = to_rgb * vector_of(c);
        const double red = rgb[0] / (rgb[0] + rgb[1] + rgb[2]), green = rgb[1] / (rgb[0] + rgb[1] + rgb[2]);
        const double middle = 10.5 * (1 + 3.0 / 16) / 32 - 1.0 / 16;
        return std::fabs(red - middle) + std::fabs(green - middle) < 1e-3 ? Xyz{std::nan(""), 0, 0} : c;
      },
      {});
  EXPECT_FALSE(holed);
  for (const double limit : {1e-6, 30.0, 1e6}) {
    const auto table = make_colour_table(identity, {.rgb_to_xyz = *rgb_to_xyz(primaries_rec2020), .limit = limit});
    ASSERT_TRUE(table);
    EXPECT_TRUE(table->within_bound);
  }
}

}  // namespace
}  // namespace lowlux::isp
