#include "tests/hard_cases/rendering.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include "isp/pipeline/develop.h"
#include "isp/pipeline/live/live_pipeline.h"
#include "tests/reference/raw_to_rgb_ref.h"
#include "tests/support/raw_frames.h"

namespace lowlux::hard_cases {
namespace {

/// 40503 is coprime to 65536: values in no order.
Plane<float> scattered(int width, int height, float scale) {
  Plane<float> out(width, height);
  for (std::size_t i = 0; i < out.size(); ++i) {
    const double share = static_cast<double>((i * 40503U ^ i >> 3) % 65536U) / 65536;
    out.data()[i] = scale * static_cast<float>(1.8 * share - 0.3);
  }
  return out;
}

double largest_term(const RenderedCase& c) {
  double row = 0;
  for (int i = 0; i < 3; ++i) {
    double sum = 0;
    for (int j = 0; j < 3; ++j) sum += std::abs(static_cast<double>(c.transform.matrix[3 * i + j]));
    row = std::max(row, sum);
  }
  const float gain = *std::max_element(c.gain.begin(), c.gain.end());
  // Malvar's filters reach 1.5 times the largest value.
  return row * static_cast<double>(gain) * static_cast<double>(c.scale) * 1.5 * 1.5;
}

/// 15000 DN of range over 512, this neutral, every pixel at so much of it.
RawFrame neutral_frame(const std::array<double, 3>& neutral, double share) {
  RawFrame frame = test::plain_frame(64, 48);
  frame.raw.black_tag->pattern_dn = {512};
  frame.raw.white_dn.fill(15512);
  for (int y = 0; y < 48; ++y) {
    for (int x = 0; x < 64; ++x) {
      const double value = share * neutral[static_cast<std::size_t>(colour_at(BayerPhase::rggb, x, y))];
      frame.raw.dn.at(x, y) = static_cast<std::uint16_t>(std::lround(512 + 15000 * value));
    }
  }
  // The camera's primaries are those of XYZ, seen through filters of this density.
  frame.colour.calibrations = {
      {.cct_k = 6504,
       .xyz_to_camera = {{{neutral[0] / 0.9505, 0, 0}, {0, neutral[1], 0}, {0, 0, neutral[2] / 1.089}}}}};
  frame.colour.as_shot_neutral = neutral;
  return frame;
}

}  // namespace

double linear_error(const RenderedCase& c, Denormals mode) {
  const Plane<float> mosaic = scattered(c.width, c.height, c.scale);
  const isp::SignedMosaic in{mosaic.view(), BayerPhase::gbrg, c.gain};
  PoolExecutor pool(2);
  test::ExecutorInMode executor(pool, mode);
  SceneLinear out(c.width, c.height);
  in_mode(mode, [&] { isp::RawToRgb(c.width, 2).linear(in, c.transform, out.view(), executor); });
  const reference::LinearisedMosaic exact = reference::linearised(in);
  double worst = 0;
  for (int y = 0; y < c.height; ++y) {
    for (int x = 0; x < c.width; ++x) {
      const auto expected = reference::transformed(reference::malvar(exact, x, y), c.transform);
      for (int k = 0; k < 3; ++k) {
        keep_worst(worst, std::abs(static_cast<double>(out.plane[k].at(x, y)) - expected[k]));
      }
    }
  }
  return worst / largest_term(c);
}

double codes_of_100_megapixels(Denormals mode) {
  constexpr int width = 10000;
  std::vector<std::uint16_t> row(width);
  for (int x = 0; x < width; ++x) row[x] = static_cast<std::uint16_t>((x * 40503U) % 16384U);
  const auto mosaic = [&](int height) {
    return isp::DnMosaic{
        {row.data(), width, height, 0}, BayerPhase::rggb, {{512, 512, 512, 512}, {6e-5f, 6e-5f, 6e-5f, 6e-5f}}};
  };
  const ToneTable tone = reference::srgb_tone_table();
  PoolExecutor pool(2);
  test::ExecutorInMode executor(pool, mode);
  isp::RawToRgb kernel(width, 2);
  Plane<std::uint8_t> few(3 * width, 6);
  struct Count {
    const Plane<std::uint8_t>& few;
    int height;
    std::atomic<std::int64_t> wrong{0}, rows{0};
  } count{few, 10000, {}, {}};
  in_mode(mode, [&] {
    kernel.rgb8(mosaic(6), {}, tone, few.view(), executor);
    kernel.rows8(mosaic(count.height), {}, tone,
                 {[](void* context, int, int y, const std::uint8_t* rgb, int n) {
                    auto& c = *static_cast<Count*>(context);
                    ++c.rows;
                    if (y < 2 || y >= c.height - 2) return;
                    if (!std::equal(rgb, rgb + 3 * n, c.few.row(2 + y % 2))) ++c.wrong;
                  },
                  &count},
                 executor);
  });
  return static_cast<double>(count.wrong + std::abs(count.rows - count.height));
}

double neutral_through_file(const std::array<double, 3>& neutral, Denormals mode) {
  const isp::DevelopOptions options{.exposure_ev = 0,
                                    .tone = isp::ToneCurve::none,
                                    .space = OutputSpace::linear_srgb,
                                    .samples = SampleType::f32,
                                    .find_defects = false};
  PoolExecutor pool(2);
  test::ExecutorInMode executor(pool, mode);
  const auto developed =
      in_mode(mode, [&, frame = neutral_frame(neutral, 0.8)] { return isp::develop(frame, options, executor); });
  EXPECT_TRUE(developed) << developed.error().message;
  if (!developed) return NAN;
  double wrong = 0;
  for (const Plane<float>& plane : std::get<SceneLinear>(developed->picture).plane) {
    for (std::size_t i = 0; i < plane.size(); ++i) {
      wrong += std::abs(static_cast<double>(plane.data()[i]) / 0.8 - 1) <= 1e-5 ? 0 : 1;
    }
  }
  return wrong;
}

double neutral_through_live(const std::array<double, 3>& neutral, Denormals mode) {
  const RawFrame frame = neutral_frame(neutral, 0.8);
  isp::LiveSetup setup;
  setup.format = {.bits = 14};
  setup.width = 64;
  setup.height = 48;
  setup.active = frame.raw.active;
  setup.white_dn = 15512;
  setup.colour = frame.colour;
  isp::LiveFacts facts{.black_dn = PerSite<double>{512, 512, 512, 512}};
  facts.neutral = Vector3(neutral);
  facts.exposure_ev = 0;
  facts.denoise.mode = isp::LiveDenoise::Mode::off;
  PoolExecutor pool(2);
  test::ExecutorInMode executor(pool, mode);
  return in_mode(mode, [&] {
    auto live = isp::LivePipeline::make(setup, executor);
    EXPECT_TRUE(live) << live.error().message;
    if (!live) return double{NAN};
    (*live)->read(std::as_bytes(std::span(frame.raw.dn.data(), frame.raw.dn.size())), 128, facts, true);
    EXPECT_TRUE((*live)->plan(facts));
    std::array<double, 2> wrong{};  // of the threads
    (*live)->render({[](void* context, int thread, int, const std::uint8_t* rgb, int n) {
                       for (int x = 0; x < 3 * n; x += 3) {
                         const bool grey = rgb[x] == rgb[x + 1] && rgb[x] == rgb[x + 2] && rgb[x] > 150;
                         static_cast<double*>(context)[thread] += grey ? 0 : 1;
                       }
                     },
                     wrong.data()});
    return wrong[0] + wrong[1];
  });
}

double sizes_through_file(Denormals mode) {
  InlineExecutor one;
  double wrong = 0;
  for (const auto& [width, height] :
       {std::pair{1, 1}, {1, 7}, {7, 1}, {1, 5000}, {5000, 1}, {2, 2}, {3, 3}, {33, 31}}) {
    const RawFrame frame = test::plain_frame(width, height);
    const auto developed = in_mode(mode, [&] { return isp::develop(frame, {}, one); });
    if (developed) {
      wrong += developed->plan.width == width && developed->plan.height == height ? 0 : 1;
    } else {
      wrong += developed.error().message.empty() ? 1 : 0;
    }
  }
  return wrong;
}

}  // namespace lowlux::hard_cases
