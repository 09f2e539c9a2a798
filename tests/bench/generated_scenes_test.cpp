#include "isp/bench/scenes/generated_scenes.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <set>
#include <string_view>
#include <utility>

namespace lowlux::isp {
namespace {

constexpr SceneSize small{192, 128};

bool same(const SceneLinear& a, const SceneLinear& b) {
  for (std::size_t c = 0; c < 3; ++c) {
    if (!std::equal(a.plane[c].data(), a.plane[c].data() + a.plane[c].size(), b.plane[c].data())) return false;
  }
  return true;
}

float largest(const SceneLinear& image) {
  float out = 0;
  for (const Plane<float>& plane : image.plane) {
    out = std::max(out, *std::max_element(plane.data(), plane.data() + plane.size()));
  }
  return out;
}

TEST(GeneratedScenes, ArePureFunctionsOfNameAndSeedInRange) {
  std::set<std::string_view> names;
  for (const GeneratedSet& set : generated_sets()) {
    EXPECT_TRUE(names.insert(set.name).second) << set.name;
    const BenchPicture a = set.scene(small, 2001), again = set.scene(small, 2001), other = set.scene(small, 2002);
    EXPECT_TRUE(same(a.linear, again.linear)) << set.name;
    EXPECT_FALSE(same(a.linear, other.linear)) << set.name;
    EXPECT_EQ(a.linear.width(), small.width);
    for (const Plane<float>& plane : a.linear.plane) {
      const float least = *std::min_element(plane.data(), plane.data() + plane.size());
      EXPECT_GT(least, 0) << set.name;
    }
    EXPECT_EQ(largest(a.linear) > 1.0001F, set.saturates) << set.name;  // float sums of the lens
  }
}

TEST(GeneratedScenes, TuningAndHeldOutSeedsDiffer) {
  EXPECT_EQ(seeds_of(PictureSet::all).size(),
            seeds_of(PictureSet::tuning).size() + seeds_of(PictureSet::held_out).size());
  for (const std::uint64_t seed : seeds_of(PictureSet::held_out)) {
    EXPECT_EQ(std::ranges::count(seeds_of(PictureSet::tuning), seed), 0);
  }
}

TEST(GeneratedScenes, EdgesHoldTheFractionOfThePixelThatIsCovered) {
  const SceneLinear edges = edges_scene(small, 5, 0).linear;
  for (int edge = edge_pitch_px; edge < small.width; edge += edge_pitch_px) {
    // One fraction for all channels; 1e-3: of channels that differ by more than 0.05, float.
    double fraction = -1;
    for (const Plane<float>& plane : edges.plane) {
      const double left = plane.at(edge - 2, 3), middle = plane.at(edge - 1, 90), right = plane.at(edge, 3);
      if (std::abs(right - left) < 0.05) continue;
      const double found = (middle - left) / (right - left);
      if (fraction >= 0) {
        EXPECT_NEAR(found, fraction, 1e-3);
      }
      fraction = found;
      EXPECT_TRUE(found >= 0 && found <= 1);
    }
  }
}

TEST(GeneratedScenes, LampsAre30To10000TimesTheirSurroundings) {
  const SceneLinear lamps = lamps_scene({960, 960}, 7, 0).linear;
  EXPECT_GT(largest(lamps), 1000 * lamp_ground);
  EXPECT_LE(largest(lamps), 10000 * lamp_ground * 1.00001);
  const Plane<float>& green = lamps.plane[1];
  const auto dark = std::count(green.data(), green.data() + green.size(), static_cast<float>(lamp_ground));
  EXPECT_GT(static_cast<double>(dark), 0.9 * static_cast<double>(green.size()));
}

/// Correlation of the logarithms of red and green over the pixels, and the number of leaves that would give the same
/// error if all had one area.
struct Correlation {
  double value;
  double leaves;
};

Correlation correlation_of(const SceneLinear& image) {
  std::map<std::pair<float, float>, double> areas;
  double n = 0, r = 0, g = 0, rr = 0, gg = 0, rg = 0;
  for (std::size_t i = 0; i < image.plane[0].size(); ++i, ++n) {
    const float red = image.plane[0].data()[i], green = image.plane[1].data()[i];
    areas[{red, green}] += 1;
    const double a = std::log(red), b = std::log(green);
    r += a, g += b, rr += a * a, gg += b * b, rg += a * b;
  }
  double squares = 0;
  for (const auto& [colour, area] : areas) squares += area * area;
  const double covariance = rg / n - r / n * g / n;
  return {covariance / std::sqrt((rr / n - r / n * r / n) * (gg / n - g / n * g / n)), n * n / squares};
}

TEST(GeneratedScenes, ChannelsOfTextureAreCorrelatedAsStated) {
  for (const double s : {0.0, 0.3, 0.9}) {
    const Leaves how{
        .min_radius_px = 0.7, .max_radius_px = 5, .pixels_per_leaf = 1, .chroma = 0, .shared = s, .lens_px = 0};
    const Correlation found = correlation_of(leaves_scene({384, 256}, 11, how).picture.linear);
    const double expected = s * s / (s * s + (1 - s) * (1 - s));
    EXPECT_GT(found.leaves, 1000);
    EXPECT_NEAR(found.value, expected, 5 * (1 - expected * expected) / std::sqrt(found.leaves)) << s;
  }
}

}  // namespace
}  // namespace lowlux::isp
