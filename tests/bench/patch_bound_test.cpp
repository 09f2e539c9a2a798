#include "isp/bench/scenes/patch_bound.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

namespace lowlux::isp {
namespace {

constexpr int patches = 8, side = patches * bound_patch_px;

/// Evenly lit patches of random colours.
BenchPicture chequered(std::uint32_t seed) {
  BenchPicture out{"patches", SceneLinear(side, side)};
  std::mt19937 random(seed);
  std::uniform_real_distribution<float> any(0.2F, 1.0F);
  for (auto& plane : out.linear.plane) {
    for (int y = 0; y < side; ++y) {
      for (int x = 0; x < side; ++x) {
        const bool first = x % bound_patch_px == 0 && y % bound_patch_px == 0;
        plane.at(x, y) = first ? any(random) : plane.at(x - x % bound_patch_px, y - y % bound_patch_px);
      }
    }
  }
  return out;
}

/// The mean of each patch's own sites, which is efficient where a site has more than a few electrons.
SceneLinear means_of(const DenoiseShot& shot) {
  SceneLinear out(side, side);
  for (int top = 0; top < side; top += bound_patch_px) {
    for (int left = 0; left < side; left += bound_patch_px) {
      std::array<double, 3> sum{}, count{};
      for (int y = top; y < top + bound_patch_px; ++y) {
        for (int x = left; x < left + bound_patch_px; ++x) {
          const auto c = static_cast<std::size_t>(colour_at(BayerPhase::rggb, x, y));
          sum[c] += (shot.raw_e.at(x, y) - shot.light.dark_e) * bench_white_gain[c] / shot.white_e;
          count[c] += 1;
        }
      }
      for (std::size_t c = 0; c < 3; ++c) {
        for (int y = top; y < top + bound_patch_px; ++y) {
          std::fill_n(out.plane[c].row(y) + left, bound_patch_px, static_cast<float>(sum[c] / count[c]));
        }
      }
    }
  }
  return out;
}

TEST(PatchBound, IsReachedByTheMeanOfEachPatch) {
  for (const DenoiseLight& light : {DenoiseLight{200, 2, 1.5}, DenoiseLight{20, 2, 1.5}, DenoiseLight{20, 200, 4}}) {
    double reached = 0, bound = 0;
    constexpr std::uint32_t shots = 20;
    for (std::uint32_t seed = 0; seed < shots; ++seed) {
      const BenchPicture picture = chequered(seed);
      const DenoiseShot shot = take(picture, light, seed);
      const PatchBound of(picture, shot);
      reached += std::pow(of.distance_uv(means_of(shot)), 2);
      bound += std::pow(of.bound_uv(), 2);
    }
    // Each square has a relative standard deviation of at most sqrt(2), as one along a line has; five standard errors,
    // and what the bound leaves out: the mean is within 1 % of it, the chromaticity's curvature adds less.
    EXPECT_NEAR(reached / bound, 1, 5 * std::sqrt(2.0 / (shots * patches * patches))) << name_of(light);
  }
}

TEST(PatchBound, TheDistanceIsOfColourAlone) {
  const BenchPicture picture = chequered(1);
  const DenoiseShot shot = take(picture, {20, 2, 1.5}, 1);
  const PatchBound of(picture, shot);
  EXPECT_LT(of.distance_uv(picture.linear), 1e-6);
  SceneLinear brighter(side, side), grey(side, side);
  for (std::size_t c = 0; c < 3; ++c) {
    for (std::size_t i = 0; i < brighter.plane[c].size(); ++i) {
      brighter.plane[c].data()[i] = 4 * picture.linear.plane[c].data()[i];
      grey.plane[c].data()[i] = 0.5F;
    }
  }
  EXPECT_LT(of.distance_uv(brighter), 1e-6);
  EXPECT_GT(of.distance_uv(grey), 10 * of.bound_uv());
}

TEST(PatchBound, FallsWithLightAndLeavesOutWhatIsTooDark) {
  BenchPicture picture = chequered(2);
  const auto bound = [&](const DenoiseLight& light) { return PatchBound(picture, take(picture, light, 1)).bound_uv(); };
  const double bright = bound({2000, 2, 1.5}), dim = bound({20, 2, 1.5});
  EXPECT_NEAR(dim / bright, 11, 1) << "sqrt(20 + 2 + 1.5^2) / 20 over sqrt(2000 + 2 + 1.5^2) / 2000, by colour";
  EXPECT_GT(bound({20, 200, 4}), 2 * dim);
  EXPECT_TRUE(std::isnan(bound({0.01, 200, 4})));
  for (auto& plane : picture.linear.plane) std::fill_n(plane.data(), plane.size() / 2, 0.0F);
  const DenoiseShot shot = take(picture, {20, 2, 1.5}, 1);
  const PatchBound of(picture, shot);
  EXPECT_TRUE(std::isfinite(of.bound_uv()));
  EXPECT_TRUE(std::isfinite(of.distance_uv(means_of(shot)))) << "patches without light have no chromaticity";
}

}  // namespace
}  // namespace lowlux::isp
