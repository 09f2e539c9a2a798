#include <gtest/gtest.h>

#include <cstring>

#include "denoise/denoiser.h"
#include "denoise/temporal/temporal.h"
#include "tests/denoise/against_reference.h"
#include "tests/support/frame_sizes.h"

namespace lowlux {
namespace {

using namespace denoise_testing;
using denoise::Level;
using test::drawn_size;
using test::FrameSize;

constexpr std::uint64_t seed = 20261123;

Plane<float> frame_of(const Camera& camera, FrameSize size, std::uint32_t index) {
  return exposed(camera, waves(20), size.width, size.height, seed + index);
}

/// Levels in turn; the best, whose reference takes twenty times as long, every eighth time and on fewer pixels.
Level level_of(std::uint32_t index) {
  if (index % 8 == 7) return Level::best;
  return denoise::all_levels[index / 2 % 3];
}

TEST(DenoiserSizes, AgreeWithTheReferenceAtAnyWidthAndHeight) {
  for (std::uint32_t i = 0; i < test::drawn_sizes(64); ++i) {
    const Level level = level_of(i);
    const FrameSize size = drawn_size(seed, i, 2, level == Level::best ? 20'000 : 80'000);
    SCOPED_TRACE("seed " + std::to_string(seed) + ", size " + std::to_string(i) + ": " + size.text());
    const Camera camera{.phase = static_cast<BayerPhase>(i % 4), .dark_e = {10, 12, 11, 9}};
    compare(camera, frame_of(camera, size, i),
            {.level = level, .white_gain = {1.9, 1, 1.4}, .keep_point_sources = false});
  }
}

// The widths of cameras' frames, all rows of which are alike to the denoiser; and their heights as widths of columns.
TEST(DenoiserSizes, AgreeWithTheReferenceAtTheWidthsAndHeightsOfCameras) {
  const Camera camera{.phase = BayerPhase::grbg, .dark_e = {2, 2, 2, 2}};
  std::uint32_t i = 0;
  for (const auto& [name, size] : test::camera_sizes) {
    SCOPED_TRACE(name);
    ++i;
    compare(camera, frame_of(camera, {size.width, 10}, i), {.level = level_of(i % 6), .keep_point_sources = false});
    compare(camera, frame_of(camera, {10, size.height}, i), {.level = level_of(i % 6), .keep_point_sources = false});
  }
}

// One denoiser for frames of many sizes, as in a batch: what it did before leaves no trace.
TEST(DenoiserSizes, DoNotDependOnTheFramesDoneBefore) {
  const Camera camera{.dark_e = {3, 3, 3, 3}};
  auto noise = camera.noise();
  noise.saturation_e.fill(45);
  InlineExecutor one;
  denoise::Denoiser used(test::max_drawn_side, test::max_drawn_side / 20, 1, Level::best);
  for (std::uint32_t i = 0; i < test::drawn_sizes(16); ++i) {
    FrameSize size = drawn_size(seed + 1, 2 * i, 2, 60'000);
    size.height = std::min(size.height, test::max_drawn_side / 20);
    const denoise::DenoiseOptions options{.level = level_of(i)};
    const auto raw = frame_of(camera, size, i);
    Plane<float> first(size.width, size.height), again(size.width, size.height);
    denoise::Denoiser fresh(size.width, size.height, 1, Level::best);
    fresh.run({raw.view(), camera.phase}, noise, options, first.view(), {}, one);
    used.run({raw.view(), camera.phase}, noise, options, again.view(), {}, one);
    ASSERT_EQ(std::memcmp(first.data(), again.data(), first.size() * sizeof(float)), 0) << i << ": " << size.text();
  }
}

}  // namespace
}  // namespace lowlux
