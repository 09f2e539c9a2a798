#include <gtest/gtest.h>

#include <cstdint>
#include <span>
#include <string>

#include "tests/adapter/stage_frames.h"
#include "tests/support/frame_sizes.h"
#include "tests/support/ramp_frame.h"

/// The stage at any frame size, against the truth.
namespace lowlux {
namespace {

using namespace stage_testing;
using test::FrameSize;
using test::Ramp;

constexpr std::uint64_t seed = 20261124;
constexpr double black_dn = 512, gain_dn_per_e = 4;

lowlux_stage_params params_of(std::uint32_t index, const Ramp& ramp) {
  auto out = no_params();
  out.valid = LOWLUX_STAGE_HAS_BLACK | LOWLUX_STAGE_HAS_COLOUR_GAINS | LOWLUX_STAGE_HAS_DENOISE |
              LOWLUX_STAGE_HAS_NOISE | LOWLUX_STAGE_HAS_EXPOSURE_VALUE;
  for (float& black : out.black_level) black = black_dn;
  out.colour_gains[0] = static_cast<float>(1 / Ramp::neutral[0]);
  out.colour_gains[1] = static_cast<float>(1 / Ramp::neutral[2]);
  out.denoise = index % 2 == 0 ? LOWLUX_STAGE_DENOISE_FAST : LOWLUX_STAGE_DENOISE_HIGH_QUALITY;
  out.noise_gain = gain_dn_per_e;
  out.noise_read = static_cast<float>(gain_dn_per_e * ramp.read_noise_e);
  return out;
}

void expect_truth(std::uint32_t index, FrameSize size) {
  SCOPED_TRACE("seed " + std::to_string(seed) + ", size " + std::to_string(index) + ": " + size.text());
  const Ramp ramp{size, static_cast<BayerPhase>(index % 4)};
  auto settings = plain_settings(2);
  settings.most_denoise = index % 4 < 2 ? LOWLUX_STAGE_LEVEL_STANDARD : LOWLUX_STAGE_LEVEL_HIGH;
  settings.memory_limit = std::uint64_t{4} << 30;
  Rig rig(settings, names_of_bayer(14, ramp.phase), size.width, size.height, LOWLUX_STAGE_BAYER16);
  ASSERT_EQ(rig.configured, LOWLUX_STAGE_OK) << rig.error();
  const auto codes = ramp.codes(gain_dn_per_e, black_dn, seed + index);
  const auto bytes = std::as_bytes(std::span(codes.data(), codes.size()));
  const lowlux_stage_source source{bytes.data(), bytes.size(), 2 * static_cast<std::size_t>(size.width), -1};
  const auto params = params_of(index, ramp);
  ASSERT_EQ(lowlux_stage_process(rig.stage.get(), &source, &rig.picture, &params, &rig.result, &rig.statistics),
            LOWLUX_STAGE_OK)
      << rig.error();
  EXPECT_GT(rig.result.level, LOWLUX_STAGE_LEVEL_NONE);
  const std::size_t stride = rig.out.stride[0] / 2;
  expect_means_of(ramp, [&](int x, int y) {
    const double code = rig.wide(static_cast<std::size_t>(y) * stride + static_cast<std::size_t>(x)) / 4.0;
    return (code - black_dn) / gain_dn_per_e;
  });
}

TEST(StageSizes, CleanMosaicsAreTheTruthInTheMean) {
  for (std::uint32_t i = 0; i < test::drawn_sizes(40); ++i) expect_truth(i, test::drawn_size(seed, i, 2, 150'000));
}

// The exact width or height of each camera; tests/pipeline/frame_sizes_test.cpp has whole frames.
TEST(StageSizes, CleanMosaicsOfCamerasWidthsAndHeightsAreTheTruthInTheMean) {
  std::uint32_t i = 0;
  for (const auto& [name, size] : test::camera_sizes) {
    SCOPED_TRACE(name);
    expect_truth(++i, {size.width, 30});
    expect_truth(++i, {30, size.height});
  }
}

}  // namespace
}  // namespace lowlux
