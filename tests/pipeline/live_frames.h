#pragma once

#include <gtest/gtest.h>

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <utility>

#include "isp/pipeline/live/live_pipeline.h"
#include "tests/pipeline/night_frames.h"

/// What the tests of live frames share: the stream that night_frame's frames make, and what is known of them.
namespace lowlux::isp::live_testing {

inline constexpr denoise_testing::Camera camera{.phase = BayerPhase::gbrg, .read_noise_e = 2};
inline constexpr double black_dn2 = test::night_gain_dn_per_e * test::night_gain_dn_per_e * 4 + 1.0 / 12;

/// The stream that test::night_frame's frames make: 14 bits in 16, all active.
inline LiveSetup setup_of(const RawFrame& frame) {
  LiveSetup setup;
  setup.format = {.bits = 14, .phase = frame.raw.phase};
  setup.width = frame.raw.dn.width();
  setup.height = frame.raw.dn.height();
  setup.active = frame.raw.active;
  setup.colour = frame.colour;
  return setup;
}

inline LiveFacts known() {
  LiveFacts facts;
  facts.black_dn = {test::night_black_dn, test::night_black_dn, test::night_black_dn, test::night_black_dn};
  facts.noise = LiveNoise{test::night_gain_dn_per_e, {black_dn2, black_dn2, black_dn2, black_dn2}};
  facts.neutral = Vector3{0.5, 1, 0.625};
  facts.denoise.mode = LiveDenoise::Mode::off;
  return facts;
}

inline std::unique_ptr<LivePipeline> live_of(LiveSetup setup, Executor& executor) {
  auto live = LivePipeline::make(std::move(setup), executor);
  EXPECT_TRUE(live) << live.error().message;
  return *std::move(live);
}

inline void read(LivePipeline& live, const RawFrame& frame) {
  live.read(std::as_bytes(std::span(frame.raw.dn.data(), frame.raw.dn.size())),
            2 * static_cast<std::size_t>(frame.raw.dn.width()), {}, true);
}

inline RawFrame night(const denoise_testing::Scene& scene, std::uint64_t seed = 1, int width = 130, int height = 94) {
  return test::night_frame(camera, scene, width, height, seed);
}

}  // namespace lowlux::isp::live_testing
