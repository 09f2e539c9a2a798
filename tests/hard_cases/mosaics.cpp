#include "tests/hard_cases/mosaics.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <memory>
#include <span>
#include <string>
#include <utility>

#include "isp/pipeline/live/live_pipeline.h"
#include "isp/pipeline/plan/plan_develop.h"
#include "isp/pipeline/render/pipeline.h"
#include "tests/reference/denoise_ref.h"

namespace lowlux::hard_cases {
namespace {

constexpr double no_number = std::numeric_limits<double>::quiet_NaN();
constexpr double largest_dn = 16383;  // of 14 bits

template <class T>
Plane<double> in_double(PlaneView<T> in) {
  Plane<double> out(in.width, in.height);
  for (int y = 0; y < in.height; ++y) {
    for (int x = 0; x < in.width; ++x) out.at(x, y) = static_cast<double>(in.at(x, y));
  }
  return out;
}

PerSite<double> black_of(const MosaicCase& c) {
  PerSite<double> out{};
  for (int site = 0; site < 4; ++site) out[site] = c.black_dn + c.gain_dn_per_e * c.noise.dark_mean_e[site];
  return out;
}

std::array<double, 3> dark_variance_e2(const MosaicCase& c) {
  std::array<double, 3> out = c.noise.variance_e2;
  for (double& v : out) v += c.noise.dark_mean_e[0] + 1 / (12 * c.gain_dn_per_e * c.gain_dn_per_e);
  return out;
}

/// What is saturated is so for the pipeline from 0.99 of white on.
double white_of(const MosaicCase& c) {
  const double saturation_e = *std::min_element(c.noise.saturation_e.begin(), c.noise.saturation_e.end());
  return std::min(largest_dn, black_of(c)[0] + c.gain_dn_per_e * saturation_e);
}

Vector3 neutral_of(const MosaicCase& c) {
  const auto& gain = c.options.white_gain;
  const double least = *std::min_element(gain.begin(), gain.end());
  return {least / gain[0], least / gain[1], least / gain[2]};
}

/// In codes of 14 bits.
RawFrame frame_of(const MosaicCase& c) {
  RawFrame frame;
  const int width = c.raw_e.width(), height = c.raw_e.height();
  frame.raw.dn = Plane<std::uint16_t>(width, height);
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      const double dn = c.black_dn + c.gain_dn_per_e * static_cast<double>(c.raw_e.at(x, y));
      frame.raw.dn.at(x, y) = static_cast<std::uint16_t>(std::lround(std::clamp(dn, 0.0, largest_dn)));
    }
  }
  const PerSite<double> black = black_of(c);
  frame.raw.phase = c.phase;
  frame.raw.active = frame.raw.default_crop = {0, 0, width, height};
  frame.raw.black_tag = BlackLevel{.rows = 2, .columns = 2, .pattern_dn = {black.begin(), black.end()}};
  frame.raw.white_dn.fill(white_of(c));
  const double scale = c.gain_dn_per_e / (white_of(c) - black[0]);
  frame.noise.emplace();
  frame.noise->scale.fill(scale);
  const auto variance_e2 = dark_variance_e2(c);
  for (int k = 0; k < 3; ++k) frame.noise->offset[k] = variance_e2[k] * scale * scale;
  frame.colour.calibrations = {{.cct_k = 6504, .xyz_to_camera = identity3()}};
  frame.colour.as_shot_neutral = neutral_of(c);
  frame.colour.source = CameraColour::Source::file_tags;
  return frame;
}

isp::LiveFacts facts_of(const MosaicCase& c) {
  isp::LiveFacts facts;
  facts.black_dn = black_of(c);
  isp::LiveNoise noise{.gain_dn = c.gain_dn_per_e};
  const auto variance_e2 = dark_variance_e2(c);
  for (int site = 0; site < 4; ++site) {
    const auto k = static_cast<std::size_t>(colour_at(c.phase, site & 1, site >> 1));
    noise.black_variance_dn2[site] = variance_e2[k] * c.gain_dn_per_e * c.gain_dn_per_e;
  }
  facts.noise = noise;
  facts.neutral = neutral_of(c);
  facts.denoise = {.mode = isp::LiveDenoise::Mode::level, .level = denoise::Level::standard};
  return facts;
}

isp::DevelopOptions options() {
  isp::DevelopOptions out{.exposure_ev = 0,
                          .tone = isp::ToneCurve::none,
                          .space = OutputSpace::camera,
                          .samples = SampleType::f32,
                          .find_defects = false};
  out.denoise = {.mode = isp::DenoiseChoice::Mode::level, .level = denoise::Level::standard};
  return out;
}

bool all_numbers(const SceneLinear& picture) {
  for (const Plane<float>& plane : picture.plane) {
    if (!std::all_of(plane.data(), plane.data() + plane.size(), [](float v) { return std::isfinite(v); })) return false;
  }
  return true;
}

Plane<double> nothing_of(const MosaicCase& c) {
  Plane<double> out(c.raw_e.width(), c.raw_e.height());
  std::fill_n(out.data(), out.size(), no_number);
  return out;
}

}  // namespace

MosaicCase case_of(const denoise_testing::Camera& camera, const denoise_testing::Scene& scene, int width, int height,
                   std::uint64_t seed) {
  MosaicCase out;
  out.raw_e = denoise_testing::exposed(camera, scene, width, height, seed);
  out.phase = camera.phase;
  out.noise = camera.noise();
  out.options.white_gain = camera.white_gain;
  return out;
}

Plane<double> by_reference(const MosaicCase& c, denoise::Level level, Denormals mode) {
  denoise::DenoiseOptions options = c.options;
  options.level = level;
  return in_mode(mode, [&] { return reference::denoise({c.raw_e.view(), c.phase}, c.noise, options).signal_e; });
}

Plane<double> by_denoiser(const MosaicCase& c, denoise::Level level, Denormals mode, int threads) {
  denoise::DenoiseOptions options = c.options;
  options.level = level;
  PoolExecutor pool(threads);
  test::ExecutorInMode executor(pool, mode);
  Plane<float> out(c.raw_e.width(), c.raw_e.height());
  in_mode(mode, [&] {
    denoise::Denoiser(out.width(), out.height(), threads, level)
        .run({c.raw_e.view(), c.phase}, c.noise, options, out.view(), {}, executor);
  });
  return in_double(out.view());
}

Plane<double> by_file(const MosaicCase& c, Denormals mode, int threads) {
  PoolExecutor pool(threads);
  test::ExecutorInMode executor(pool, mode);
  const RawFrame frame = frame_of(c);
  return in_mode(mode, [&] {
    auto plan = isp::plan_develop(frame, options(), executor);
    EXPECT_TRUE(plan) << plan.error().message;
    if (!plan) return nothing_of(c);
    plan->noise_reduction.options.rho = c.options.rho;
    isp::Pipeline pipeline(executor);
    Picture picture = isp::make_picture(*plan);
    pipeline.render(frame, *plan, picture);
    if (!all_numbers(std::get<SceneLinear>(picture))) return nothing_of(c);
    return in_double(pipeline.signal(frame, *plan));
  });
}

bool warns_of(const MosaicCase& c, Denormals mode, std::string_view word) {
  PoolExecutor pool(2);
  test::ExecutorInMode executor(pool, mode);
  const auto plan = in_mode(mode, [&, frame = frame_of(c)] { return isp::plan_develop(frame, options(), executor); });
  EXPECT_TRUE(plan) << plan.error().message;
  return plan && std::any_of(plan->warnings.begin(), plan->warnings.end(),
                             [&](const std::string& text) { return text.find(word) != std::string::npos; });
}

namespace {

isp::LiveSetup setup_of(const MosaicCase& c) {
  isp::LiveSetup setup;
  setup.format = {.bits = 14, .phase = c.phase};
  setup.width = c.raw_e.width();
  setup.height = c.raw_e.height();
  setup.active = {0, 0, setup.width, setup.height};
  setup.white_dn = white_of(c);
  setup.colour.calibrations = {{.cct_k = 6504, .xyz_to_camera = identity3()}};
  return setup;
}

/// Takes one frame in. False, and the test fails, where nothing could be planned.
bool take(isp::LivePipeline& live, const MosaicCase& c, const isp::LiveFacts& facts, PlaneView<std::uint16_t> codes) {
  const RawFrame frame = frame_of(c);
  const std::span dn(frame.raw.dn.data(), frame.raw.dn.size());
  live.read(std::as_bytes(dn), 2 * static_cast<std::size_t>(codes.width), {}, true);
  const Result<void> planned = live.plan(facts);
  EXPECT_TRUE(planned) << planned.error().message;
  if (planned) live.render_mosaic(codes);
  return planned.has_value();
}

Plane<double> signal_of(const MosaicCase& c, PlaneView<const std::uint16_t> codes) {
  Plane<double> out(codes.width, codes.height);
  const PerSite<double> black = black_of(c);
  for (int y = 0; y < codes.height; ++y) {
    for (int x = 0; x < codes.width; ++x) {
      out.at(x, y) = (codes.at(x, y) / 4.0 - black[site_of(x, y)]) / c.gain_dn_per_e;
    }
  }
  return out;
}

}  // namespace

Plane<double> by_live(const MosaicCase& c, Denormals mode, int threads) {
  PoolExecutor pool(threads);
  test::ExecutorInMode executor(pool, mode);
  Plane<std::uint16_t> codes(c.raw_e.width(), c.raw_e.height());
  const bool done = in_mode(mode, [&] {
    auto live = isp::LivePipeline::make(setup_of(c), executor);
    EXPECT_TRUE(live) << live.error().message;
    return live && take(**live, c, facts_of(c), codes.view());
  });
  return done ? signal_of(c, codes.view()) : nothing_of(c);
}

struct LiveMeans::State {
  explicit State(Denormals of) : executor(pool, of), mode(of) {}
  PoolExecutor pool{2};
  test::ExecutorInMode executor;
  Denormals mode;
  std::unique_ptr<isp::LivePipeline> live;
  double exposure_s = 1;
};

LiveMeans::LiveMeans(const MosaicCase& first, Denormals mode) : state_(std::make_unique<State>(mode)) {
  isp::LiveSetup setup = setup_of(first);
  setup.temporal = true;
  state_->live = in_mode(mode, [&] { return *isp::LivePipeline::make(setup, state_->executor); });
}

LiveMeans::~LiveMeans() = default;

Plane<double> LiveMeans::take(const MosaicCase& c, double light) {
  isp::LiveFacts facts = facts_of(c);
  facts.denoise = {.mode = isp::LiveDenoise::Mode::off};
  facts.exposure_s = state_->exposure_s *= light;
  Plane<std::uint16_t> codes(c.raw_e.width(), c.raw_e.height());
  const bool done = in_mode(state_->mode, [&] { return hard_cases::take(*state_->live, c, facts, codes.view()); });
  return done ? signal_of(c, codes.view()) : nothing_of(c);
}

}  // namespace lowlux::hard_cases
