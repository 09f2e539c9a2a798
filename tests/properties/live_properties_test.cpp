#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <algorithm>
#include <cstdint>
#include <optional>
#include <utility>
#include <variant>

#include "isp/pipeline/live/live_pipeline.h"
#include "isp/pipeline/plan/plan_develop.h"
#include "tests/pipeline/live_frames.h"
#include "tests/properties/draws.h"

namespace lowlux::isp {
namespace {

using namespace properties;
using namespace live_testing;

Plane<std::uint8_t> picture_of(LivePipeline& live) {
  Plane<std::uint8_t> out(3 * live.decided().width, live.decided().height);
  live.render(RowSink{[](void* context, int, int y, const std::uint8_t* rgb, int width) {
                        std::copy_n(rgb, 3 * width, static_cast<Plane<std::uint8_t>*>(context)->row(y));
                      },
                      &out});
  return out;
}

bool equal(const Plane<std::uint8_t>& a, const Plane<std::uint8_t>& b) {
  return a.width() == b.width() && a.height() == b.height() && std::equal(a.data(), a.data() + a.size(), b.data());
}

/// A night scene, and a camera whose noise is the one that known() tells.
RawFrame any_frame() {
  denoise_testing::Camera taken = camera;
  taken.phase = any_phase();
  return test::night_frame(taken, denoise_testing::waves(any_decade(0, 3.3)), size_between(20, 150),
                           size_between(20, 110), *rc::gen::arbitrary<std::uint32_t>());
}

std::optional<denoise::Level> any_level() {
  return *rc::gen::element<std::optional<denoise::Level>>(std::nullopt, denoise::Level::draft,
                                                          denoise::Level::standard);
}

/// As developing has it of the same facts, the frame not being checked against its model.
Plane<std::uint8_t> developed(const RawFrame& frame, std::optional<denoise::Level> level, Executor& executor) {
  DevelopOptions options;
  options.find_defects = false;
  options.denoise.mode = level ? DenoiseChoice::Mode::level : DenoiseChoice::Mode::off;
  if (level) options.denoise.level = *level;
  options.denoise.line_noise = false;
  auto plan = plan_develop(frame, options, executor);
  RC_ASSERT(plan.has_value());
  plan->noise_reduction.options.variance_scale.fill(1);
  Picture picture = make_picture(*plan);
  Pipeline(executor).render(frame, *plan, picture);
  return std::get<Encoded8>(std::move(picture)).codes;
}

RC_GTEST_PROP(LiveProperty, AFrameIsRenderedAsDevelopingRendersIt, ()) {
  const RawFrame frame = any_frame();
  const auto level = any_level();
  PoolExecutor executor(size_between(1, 3));
  LiveSetup setup = setup_of(frame);
  setup.max_demosaic = DemosaicMethod::residual_median;
  const auto live = live_of(setup, executor);
  LiveFacts facts = known();
  if (level) facts.denoise = {.mode = LiveDenoise::Mode::level, .level = *level};
  const bool repeated = *rc::gen::arbitrary<bool>();  // a frame before, forgotten, changes nothing
  if (repeated) {
    read(*live, frame);
    RC_ASSERT(live->plan(facts).has_value());
    picture_of(*live);
    live->reset();
  }
  read(*live, frame);
  RC_ASSERT(live->plan(facts).has_value());
  RC_ASSERT(equal(picture_of(*live), developed(frame, level, executor)));
}

// The work of a frame is limited by LiveDenoise::most, as a budget does it.
RC_GTEST_PROP(LiveProperty, ALimitOfTheLevelIsTheFrameThatWasAskedForSo, ()) {
  const RawFrame frame = any_frame();
  const auto limit = any_level();
  InlineExecutor one;
  const auto render = [&](const LiveDenoise& denoise) {
    const auto live = live_of(setup_of(frame), one);
    read(*live, frame);
    LiveFacts facts = known();
    facts.denoise = denoise;
    RC_ASSERT(live->plan(facts).has_value());
    const bool is_limit = live->decided().noise_reduction.level == limit;
    RC_ASSERT(is_limit);
    return picture_of(*live);
  };
  LiveDenoise limited{.mode = LiveDenoise::Mode::level, .level = denoise::Level::standard};
  limited.most = limit;
  LiveDenoise asked{.mode = limit ? LiveDenoise::Mode::level : LiveDenoise::Mode::off};
  if (limit) asked.level = *limit;
  RC_ASSERT(equal(render(limited), render(asked)));
}

RC_GTEST_PROP(LiveProperty, AnyThreadsMakeTheSameOfAnyFrames, ()) {
  const RawFrame first = any_frame();
  LiveSetup setup = setup_of(first);
  setup.temporal = *rc::gen::arbitrary<bool>();
  InlineExecutor one;
  PoolExecutor three(3);
  const auto a = live_of(setup, one), b = live_of(setup, three);
  for (int i = 0; i < 3; ++i) {
    RawFrame frame = test::night_frame(camera, denoise_testing::waves(20), setup.width, setup.height, 1);
    frame.raw.dn = any_codes(setup.width, setup.height, *rc::gen::element(600, 2000, 16383));
    for (LivePipeline* const live : {a.get(), b.get()}) {
      read(*live, frame);
      LiveFacts facts;  // the noise is the frame's own
      facts.black_dn = known().black_dn;
      RC_ASSERT(live->plan(facts).has_value());
    }
    RC_ASSERT(equal(picture_of(*a), picture_of(*b)));
  }
}

}  // namespace
}  // namespace lowlux::isp
