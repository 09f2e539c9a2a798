#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <algorithm>
#include <array>

#include "denoise/denoiser.h"
#include "denoise/temporal/temporal.h"
#include "isp/base/executor.h"
#include "tests/properties/draws.h"

namespace lowlux::denoise {
namespace {

using namespace properties;

RawNoise any_noise() {
  RawNoise noise;
  noise.dark_mean_e.fill(*rc::gen::inRange(0, 50));
  noise.variance_e2.fill(*rc::gen::inRange(0, 40) / 4.0);
  return noise;
}

Level any_level() { return *rc::gen::elementOf(all_levels); }

Plane<float> denoised(const Plane<float>& raw, BayerPhase phase, const RawNoise& noise, Level level,
                      Executor& executor) {
  Plane<float> out(raw.width(), raw.height());
  Denoiser(raw.width(), raw.height(), executor.width(), Level::best)
      .run({raw.view(), phase}, noise, {.level = level}, out.view(), {}, executor);
  return out;
}

RC_GTEST_PROP(DenoiserProperty, AnythingBecomesFiniteAndAnyThreadsMakeTheSame, ()) {
  const auto raw = any_plane(size_between(2, 80), size_between(2, 60), -10, 100, 9);
  const BayerPhase phase = any_phase();
  const RawNoise noise = any_noise();
  const Level level = any_level();
  InlineExecutor one;
  PoolExecutor three(3);
  const auto out = denoised(raw, phase, noise, level, one);
  RC_ASSERT(all_finite(out));
  RC_ASSERT(largest_difference(out, denoised(raw, phase, noise, level, three)) == 0);
}

RC_GTEST_PROP(DenoiserProperty, AnEvenGreyStaysAsItIs, ()) {
  const int width = size_between(2, 90), height = size_between(2, 60);
  const auto signal_e = static_cast<float>(*rc::gen::inRange(0, 500));
  const RawNoise noise = any_noise();
  Plane<float> raw(width, height);
  std::fill_n(raw.data(), raw.size(), signal_e + static_cast<float>(noise.dark_mean_e[0]));
  InlineExecutor one;
  const auto out = denoised(raw, any_phase(), noise, any_level(), one);
  for (std::size_t i = 0; i < out.size(); ++i) {
    RC_ASSERT(std::abs(out.data()[i] - signal_e) < 1e-3F);  // e-: float transforms of values up to 550
  }
}

RC_GTEST_PROP(TemporalProperty, TheFirstFrameIsItselfAndAStillSceneStays, ()) {
  const auto raw = any_plane(size_between(2, 70), size_between(2, 50), -5, 200);
  const RawElectronsView view{raw.view(), any_phase()};
  const RawNoise noise = any_noise();
  TemporalMean mean(raw.width(), raw.height(), 1);
  Plane<float> out(raw.width(), raw.height());
  InlineExecutor one;
  for (int frame = 0; frame < 4; ++frame) {
    const double moved = mean.run(view, noise, 1, {}, out.view(), {}, one);
    RC_ASSERT(moved == (frame == 0 ? 1 : 0));
    RC_ASSERT(largest_difference(out, raw) < (frame == 0 ? 1e-9 : 1e-3));  // e-: means of equal floats up to 200
  }
}

RC_GTEST_PROP(TemporalProperty, AnythingStaysFinite, ()) {
  const int width = size_between(2, 70), height = size_between(2, 50);
  const RawNoise noise = any_noise();
  const BayerPhase phase = any_phase();
  TemporalMean mean(width, height, 1);
  Plane<float> out(width, height), share((width + 1) / 2, (height + 1) / 2);
  InlineExecutor one;
  for (int frame = 0; frame < 3; ++frame) {
    const auto raw = any_plane(width, height, -5, 200, 7);
    const double light = *rc::gen::element(1.0, 0.25, 1e-7, 3e5);
    const double moved = mean.run({raw.view(), phase}, noise, light, {}, out.view(), share.view(), one);
    RC_ASSERT(moved >= 0 && moved <= 1);
    RC_ASSERT(all_finite(out));
    for (std::size_t i = 0; i < share.size(); ++i) RC_ASSERT(share.data()[i] > 0 && share.data()[i] <= 1);
  }
}

}  // namespace
}  // namespace lowlux::denoise
