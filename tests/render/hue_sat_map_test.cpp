#include "isp/render/hue_sat_map.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <random>
#include <string>
#include <vector>

#include "isp/render/profile_tables.h"
#include "tests/reference/hue_sat_map_ref.h"

namespace lowlux::isp {
namespace {

HueSatMap random_map(std::mt19937& draw) {
  const auto whole = [&](int low, int high) { return std::uniform_int_distribution<int>(low, high)(draw); };
  HueSatMap out{whole(1, 12), whole(2, 8), whole(1, 5), whole(0, 1) == 1, {}};
  std::uniform_real_distribution<float> shift(-360, 360), factor(0, 2);
  for (int i = 0; i < out.hues * out.saturations * out.values; ++i) {
    const float value_factor = i % out.saturations == 0 ? 1 : factor(draw);
    out.node.insert(out.node.end(), {shift(draw), factor(draw), value_factor});
  }
  return out;
}

Vector3 changed(const HueSatMap& map, const Vector3& rgb) {
  float v[3] = {static_cast<float>(rgb[0]), static_cast<float>(rgb[1]), static_cast<float>(rgb[2])};
  apply_hue_sat_map(map, v);
  return {v[0], v[1], v[2]};
}

/// Returns a bound of the rounding, e being half an epsilon. Subtractions of floats have a relative error of e, so hue
/// is off by 9 e sixths, and its place on an axis by 3 hues e steps; the places of saturation and value by 2 and, after
/// the power of the encoding, 16 divisions e. A step of the table changes the hue by up to 12 sixths and the factors by
/// up to 2; a sixth of hue changes a channel by the value. That is at most 7: an encoded 1.13 (of 1.3), doubled and
/// decoded. Sums of up to 12 sixths, their reduction to the circle and the power add less than 100 e.
double tolerance(const HueSatMap& map) {
  const double e = std::numeric_limits<float>::epsilon() / 2;
  const double steps = e * (3 * map.hues + 2 * map.saturations + 16 * map.values);
  return 7 * ((12 + 2 + 2) * steps + 100 * e);
}

TEST(HueSatMap, EqualsTheOracleForRandomTablesAndColours) {
  std::random_device seeds;
  const auto seed = seeds();
  SCOPED_TRACE("seed " + std::to_string(seed));
  std::mt19937 draw(seed);
  std::uniform_real_distribution<float> channel(-0.2f, 1.3f);
  double largest = 0;
  for (int table = 0; table < 200; ++table) {
    const HueSatMap map = random_map(draw);
    for (int i = 0; i < 100; ++i) {
      const Vector3 rgb{channel(draw), channel(draw), channel(draw)};
      const Vector3 expected = reference::through_hue_sat_map(map, rgb), found = changed(map, rgb);
      for (std::size_t c = 0; c < 3; ++c) {
        const double error = std::fabs(found[c] - expected[c]);
        largest = std::max(largest, error / tolerance(map));
        ASSERT_LE(error, tolerance(map)) << table << " " << i << " " << c;
      }
    }
  }
  EXPECT_GT(largest, 1e-3) << "a bound far above every error tests nothing";
}

TEST(HueSatMap, HueIsACircle) {
  // Both sides of red lie between the last node and the first.
  HueSatMap map{4, 2, 1, false, {}};
  for (const float factor : {1.0f, 0.5f, 0.5f, 0.8f}) {
    map.node.insert(map.node.end(), {0, 1, 1, 0, 1, factor});
  }
  // A hue of 315 degrees, R = 1, B = 0.75: the mean of 270 and 0 degrees.
  EXPECT_NEAR(changed(map, {1, 0, 0.75})[0], 0.9, 1e-6);
  EXPECT_NEAR(changed(map, {1, 0.75, 0})[0], 0.75, 1e-6);
  EXPECT_NEAR(changed(map, {1, 1e-6, 0})[0], changed(map, {1, 0, 1e-6})[0], 1e-5);
  // Turns by a whole circle change nothing, by a third exchange the channels.
  for (const float turn : {-360.0f, 0.0f, 360.0f}) {
    const HueSatMap turned{1, 2, 1, false, {turn, 1, 1, turn, 1, 1}};
    const Vector3 out = changed(turned, {0.7, 0.2, 0.4});
    EXPECT_NEAR(out[0], 0.7, 2e-6);
    EXPECT_NEAR(out[1], 0.2, 2e-6);
    EXPECT_NEAR(out[2], 0.4, 2e-6);
  }
  const HueSatMap third{1, 2, 1, false, {120, 1, 1, 120, 1, 1}};
  const Vector3 out = changed(third, {0.7, 0.2, 0.4});
  EXPECT_NEAR(out[1], 0.7, 1e-6);
  EXPECT_NEAR(out[2], 0.2, 1e-6);
  EXPECT_NEAR(out[0], 0.4, 1e-6);
}

TEST(HueSatMap, NoiseBelowBlackStaysAndBrightGreysToo) {
  std::mt19937 draw(3);
  const HueSatMap map = random_map(draw);
  const Vector3 dark = changed(map, {-0.01, -0.02, -0.03});
  EXPECT_EQ(dark, (Vector3{-0.01f, -0.02f, -0.03f}));
  for (const double grey : {0.001, 0.5, 7.0}) {
    for (const double channel : changed(map, {grey, grey, grey})) EXPECT_NEAR(channel, grey, 1e-5 * grey);
  }
}

// The tags of a table, and what is wrong with them.
SourceTag tag_of(std::uint16_t id, std::uint16_t type, std::size_t size, const void* values, std::uint32_t count) {
  const auto* const bytes = static_cast<const std::byte*>(values);
  return {id, type, count, {bytes, bytes + size * count}};
}
SourceTag longs(std::uint16_t id, const std::vector<std::uint32_t>& values) {
  return tag_of(id, 4, 4, values.data(), static_cast<std::uint32_t>(values.size()));
}
SourceTag floats(std::uint16_t id, const std::vector<float>& values) {
  return tag_of(id, 11, 4, values.data(), static_cast<std::uint32_t>(values.size()));
}

const std::vector<float> warm{0, 1, 1, 5, 1.5, 0.5}, plain{0, 1, 1, 0, 1, 1};

TEST(ProfileTables, TwoMapsAreInterpolatedByTheirWeight) {
  std::vector<std::string> warnings;
  const SourceTags tags{.main = {longs(50937, {1, 2, 1}), floats(50938, plain), floats(50939, warm)}};
  const auto tables = read_profile_tables(tags, {.two_maps = true}, warnings);
  ASSERT_TRUE(tables && tables->high);
  const auto map = map_at(*tables, 0.25);
  EXPECT_EQ(map->node, (std::vector<float>{0, 1, 1, 1.25, 1.125, 0.875}));
  EXPECT_EQ(map_at(*tables, 1)->node, warm);
  EXPECT_TRUE(warnings.empty());
}

TEST(ProfileTables, IdentityIsLeftOutWithoutAWarning) {
  std::vector<std::string> warnings;
  const SourceTags tags{.main = {longs(50937, {1, 2, 1}), floats(50938, plain), longs(50981, {1, 2, 1}),
                                 // The factor of value at saturation 0 is 1 whatever the file states.
                                 floats(50982, {0, 1, 0.5, 0, 1, 1})}};
  EXPECT_EQ(read_profile_tables(tags, {.two_maps = false}, warnings), nullptr);
  EXPECT_EQ(read_profile_tables({}, {.two_maps = true}, warnings), nullptr);
  EXPECT_TRUE(warnings.empty());
}

TEST(ProfileTables, HostileTablesAreLeftOutWithOneWarning) {
  constexpr float nan = std::numeric_limits<float>::quiet_NaN(), inf = std::numeric_limits<float>::infinity();
  const std::vector<std::vector<std::uint32_t>> sizes{{0, 2, 1},    {361, 2, 1},        {1, 1, 1},          {1, 257, 1},
                                                      {1, 2, 0},    {1, 2, 257},        {360, 256, 256},    {1, 2},
                                                      {1, 2, 1, 1}, {1, 2, 0xFFFFFFFF}, {0x80000001, 2, 1}, {2, 2, 1}};
  std::vector<SourceTags> hostile;
  for (const auto& size : sizes) hostile.push_back({.main = {longs(50937, size), floats(50938, warm)}});
  const std::vector<std::vector<float>> values{{nan, 1, 1, 0, 1, 1},
                                               {0, -1, 1, 0, 1, 1},
                                               {0, 1, 1, 0, 1, -0.5f},
                                               {0, 1, 1, 0, inf, 1},
                                               {0, 1, nan, 0, 1, 1},
                                               {0, 1, 1, 361, 1, 1},
                                               {0, 1, 1, 0, 1},
                                               {0, 1, 1},
                                               {}};
  for (const auto& node : values) hostile.push_back({.main = {longs(50937, {1, 2, 1}), floats(50938, node)}});
  hostile.push_back({.main = {longs(50937, {1, 2, 1})}});
  hostile.push_back({.main = {floats(50938, warm)}});
  hostile.push_back({.main = {longs(50937, {1, 2, 1}), floats(50938, warm), longs(51107, {2})}});
  SourceTag cut = floats(50938, warm);
  cut.values.pop_back();
  hostile.push_back({.main = {longs(50937, {1, 2, 1}), cut}});
  for (std::size_t i = 0; i < hostile.size(); ++i) {
    std::vector<std::string> warnings;
    EXPECT_EQ(read_profile_tables(hostile[i], {.two_maps = false}, warnings), nullptr) << i;
    EXPECT_EQ(warnings.size(), 1u) << i;
  }
  // The second map is missing; the look table of the same profile is good, and stays.
  SourceTags half{.main = {longs(50937, {1, 2, 1}), floats(50938, warm), longs(50981, {1, 2, 1}), floats(50982, warm)}};
  std::vector<std::string> warnings;
  const auto tables = read_profile_tables(half, {.two_maps = true}, warnings);
  ASSERT_TRUE(tables);
  EXPECT_TRUE(!tables->low && !tables->high && tables->look);
  EXPECT_EQ(warnings.size(), 1u);
}

}  // namespace
}  // namespace lowlux::isp
