#include "isp/render/highlights.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <random>
#include <vector>

#include "isp/base/matrix3.h"
#include "tests/support/executors.h"

namespace lowlux::isp {
namespace {

/// Green saturates first, as with most cameras in daylight.
constexpr std::array<float, 3> saturation{2.0f, 1.0f, 1.6f};

struct Lamp {
  const char* name;
  Vector3 colour;  // white-balanced camera RGB at the centre
  double radius_px;
};

/// Lamps of known colour: a core and a halo as lenses make it, over an ambient light of its own colour.
const std::vector<Lamp>& lamps() {
  static const std::vector<Lamp> all{{"white", {6, 6, 6}, 7},          {"sodium", {9, 4, 0.9}, 8},
                                     {"green signal", {0.6, 5, 2}, 6}, {"blue neon", {1, 2.2, 8}, 6},
                                     {"red signal", {8, 0.9, 0.5}, 6}, {"small white", {3, 3, 3}, 2.5},
                                     {"bulb", {14, 8, 4}, 7}};
  return all;
}

double profile(double r, double radius) {
  const double halo = 1 + r * r / (9 * radius * radius);
  return 0.9 * std::exp(-0.5 * r * r / (radius * radius)) + 0.1 / (halo * halo);
}

constexpr int side = 128;

/// Returns the light of one lamp in the middle of an image.
SceneLinear light_of(const Lamp& lamp) {
  SceneLinear out(side, side);
  for (int y = 0; y < side; ++y) {
    for (int x = 0; x < side; ++x) {
      const double p = profile(std::hypot(x - 64, y - 64), lamp.radius_px);
      const Vector3 ambient{0.004, 0.005, 0.007};
      for (int c = 0; c < 3; ++c) out.plane[c].at(x, y) = static_cast<float>(ambient[c] + lamp.colour[c] * p);
    }
  }
  return out;
}

SceneLinear saturated(const SceneLinear& light) {
  SceneLinear out(light.width(), light.height());
  for (std::size_t c = 0; c < 3; ++c) {
    std::transform(light.plane[c].data(), light.plane[c].data() + light.plane[c].size(), out.plane[c].data(),
                   [&](float v) { return std::min(v, saturation[c]); });
  }
  return out;
}

SceneLinear copy_of(const SceneLinear& in) {
  SceneLinear out;
  for (int c = 0; c < 3; ++c) out.plane[c] = in.plane[c].clone();
  return out;
}

SceneLinear rebuilt(const SceneLinear& in, Executor& executor = test::one_thread) {
  SceneLinear out = copy_of(in);
  reconstruct_highlights(out.view(), saturation, executor);
  return out;
}

bool is_saturated(const SceneLinear& in, int x, int y) {
  for (std::size_t c = 0; c < 3; ++c) {
    if (in.plane[c].at(x, y) >= saturation[c]) return true;
  }
  return false;
}

struct Errors {
  double light = 0;   // root mean square of the difference in all channels
  double colour = 0;  // root mean square of the difference of R / (R + G + B) and B / (R + G + B)
};

/// Compares pixels with a saturated channel with the truth. @param clip  the level at which an image is cut, or
/// infinity
Errors errors_of(const SceneLinear& image, const SceneLinear& truth, const SceneLinear& in, float clip) {
  Errors out;
  int n = 0;
  for (int y = 0; y < side; ++y) {
    for (int x = 0; x < side; ++x) {
      if (!is_saturated(in, x, y)) continue;
      Vector3 is{}, should{};
      for (int c = 0; c < 3; ++c) {
        is[c] = std::min(image.plane[c].at(x, y), clip), should[c] = truth.plane[c].at(x, y);
        out.light += (is[c] - should[c]) * (is[c] - should[c]);
      }
      const double is_sum = is[0] + is[1] + is[2], should_sum = should[0] + should[1] + should[2];
      for (const int c : {0, 2}) out.colour += std::pow(is[c] / is_sum - should[c] / should_sum, 2);
      ++n;
    }
  }
  EXPECT_GT(n, 20);
  return {std::sqrt(out.light / (3 * n)), std::sqrt(out.colour / (2 * n))};
}

TEST(ReconstructHighlights, LampsComeNearerToTheirLightAndColourThanByClipping) {
  for (const Lamp& lamp : lamps()) {
    const SceneLinear truth = light_of(lamp), in = saturated(truth), out = rebuilt(in);
    const Errors clip = errors_of(in, truth, in, 1.0f), found = errors_of(out, truth, in, INFINITY);
    std::printf("  %-13s light: clipped %.3f, rebuilt %.3f; colour: clipped %.4f, rebuilt %.4f\n", lamp.name,
                clip.light, found.light, clip.colour, found.colour);
    EXPECT_LT(found.light, 0.85 * clip.light) << lamp.name;
    // White lamps are white when clipped; rebuilt they keep the tint of the ambient light in their halo, below 1 %.
    EXPECT_LT(found.colour, std::max(0.5 * clip.colour, 0.01)) << lamp.name;
  }
}

TEST(ReconstructHighlights, WhiteLampsDoNotTurnMagenta) {
  for (const Lamp& lamp : lamps()) {
    if (lamp.colour[0] != lamp.colour[1]) continue;
    const SceneLinear truth = light_of(lamp), in = saturated(truth), out = rebuilt(in);
    for (int y = 0; y < side; ++y) {
      for (int x = 0; x < side; ++x) {
        if (!is_saturated(in, x, y)) continue;
        const double green = out.plane[1].at(x, y);
        EXPECT_NEAR(out.plane[0].at(x, y) / green, 1, 0.03);  // unchanged, red would be up to twice green
        EXPECT_NEAR(out.plane[2].at(x, y) / green, 1, 0.03);
      }
    }
  }
}

TEST(ReconstructHighlights, LightRisesTowardsTheCentreWithoutRings) {
  for (const Lamp& lamp : lamps()) {
    const SceneLinear out = rebuilt(saturated(light_of(lamp)));
    for (int c = 0; c < 3; ++c) {
      for (int x = 1; x <= 64; ++x) {
        // Pixels of a place differ from the next by the light's slope; a ring would be a step back.
        EXPECT_GE(out.plane[c].at(x, 64), 0.99f * out.plane[c].at(x - 1, 64)) << lamp.name << " " << c << " " << x;
      }
    }
  }
}

TEST(ReconstructHighlights, NothingIsLoweredAndUnsaturatedPixelsKeepTheirBits) {
  std::mt19937 random(11);
  std::uniform_real_distribution<float> any(-0.1f, 2.5f);
  SceneLinear in(67, 45);
  for (auto& plane : in.plane) {
    for (std::size_t i = 0; i < plane.size(); ++i) plane.data()[i] = any(random);
  }
  in = saturated(in);
  const SceneLinear out = rebuilt(in);
  for (int y = 0; y < 45; ++y) {
    for (int x = 0; x < 67; ++x) {
      bool near = false;
      for (std::size_t c = 0; c < 3; ++c) near = near || in.plane[c].at(x, y) > 0.95f * saturation[c];
      for (int c = 0; c < 3; ++c) {
        ASSERT_TRUE(std::isfinite(out.plane[c].at(x, y)));
        ASSERT_GE(out.plane[c].at(x, y), in.plane[c].at(x, y)) << "seed 11";
        if (near) continue;
        ASSERT_EQ(out.plane[c].at(x, y), in.plane[c].at(x, y)) << "seed 11";
      }
    }
  }
}

TEST(ReconstructHighlights, AWindowOfNothingButWhiteIsNeutral) {
  SceneLinear in(64, 64);  // hard edges: nothing around says which colour it has
  for (std::size_t c = 0; c < 3; ++c) {
    std::fill_n(in.plane[c].data(), in.plane[c].size(), 0.001f);
    for (int y = 16; y < 48; ++y) std::fill_n(in.plane[c].row(y) + 16, 32, saturation[c]);
  }
  const SceneLinear out = rebuilt(in);
  for (int c = 0; c < 3; ++c) EXPECT_NEAR(out.plane[c].at(32, 32), 2.0, 1e-5);
}

TEST(ReconstructHighlights, ThreadsChangeNothing) {
  const SceneLinear in = saturated(light_of(lamps()[1]));
  PoolExecutor three(3);
  const SceneLinear one = rebuilt(in), several = rebuilt(in, three);
  for (int c = 0; c < 3; ++c) {
    for (std::size_t i = 0; i < one.plane[c].size(); ++i) ASSERT_EQ(one.plane[c].data()[i], several.plane[c].data()[i]);
  }
}

}  // namespace
}  // namespace lowlux::isp
