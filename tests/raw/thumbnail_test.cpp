#include "isp/raw/measure/thumbnail.h"

#include <gtest/gtest.h>

#include <cmath>

#include "isp/raw/black_point.h"
#include "tests/support/frames.h"

namespace lowlux::isp {
namespace {

Thumbnail thumbnail_of(RawFrame frame, int threads = 1) {
  PoolExecutor pool(threads);
  return make_thumbnail(frame, *choose_black(frame.raw, {BlackChoice::metadata}), pool);
}

TEST(Thumbnail, MeansOfEachColourForAllPhasesAndOddSizes) {
  for (int phase = 0; phase < 4; ++phase) {
    RawFrame frame;
    const auto p = static_cast<BayerPhase>(phase);
    frame.raw = test::bayer_frame(
        701, 403, p, [&](int x, int y) { return 100 + 1000 * (1 + static_cast<int>(colour_at(p, x, y))); });
    frame.raw.black_tag->pattern_dn = {100};
    const Thumbnail t = thumbnail_of(std::move(frame));
    EXPECT_LE(t.mean.width(), 256);
    for (int c = 0; c < 3; ++c) {
      // The last blocks are cut by the odd size: colours they do not hold are zero.
      for (int y = 0; y + 1 < t.mean.height(); ++y) {
        for (int x = 0; x + 1 < t.mean.width(); ++x) {
          EXPECT_NEAR(t.mean.plane[c].at(x, y), 1000 * (c + 1) / 3995.0, 1e-6);
        }
      }
    }
  }
}

TEST(Thumbnail, NegativeMeansSurvive) {
  RawFrame frame;
  frame.raw =
      test::bayer_frame(64, 64, BayerPhase::rggb, [](int x, int y) { return x < 32 ? 50 : (y < 32 ? 4095 : 4000); });
  frame.raw.black_tag->pattern_dn = {100};
  const Thumbnail t = thumbnail_of(std::move(frame));
  EXPECT_NEAR(t.mean.plane[1].at(0, 0), -50 / 3995.0, 1e-7);
}

TEST(Thumbnail, NoiseOfTheDarkestBlocksIsEstimatedWhereNothingTellsIt) {
  test::NormalDn normal(3);
  RawFrame frame;
  frame.raw = test::bayer_frame(2048, 512, BayerPhase::rggb, [&](int x, int) { return normal(300 + x, 9 + 0.02 * x); });
  const double estimate = thumbnail_of(std::move(frame)).black_noise_std * 4095;
  // The darkest twentieth has a deviation of 9 to 11; block means of 16 absolute differences scatter by 20 %.
  EXPECT_GT(estimate, 6);
  EXPECT_LT(estimate, 12);
}

TEST(Thumbnail, AMeasuredOrTaggedNoiseIsPreferred) {
  RawFrame frame;
  frame.raw = test::bayer_frame(64, 64, BayerPhase::rggb, [](int, int) { return 300; });
  frame.noise = NoiseProfile{.scale = {1e-4, 1e-4, 1e-4}, .offset = {4e-6, 4e-6, 4e-6}};
  BlackPoint black = *choose_black(frame.raw, {BlackChoice::metadata});
  InlineExecutor executor;
  EXPECT_NEAR(make_thumbnail(frame, black, executor).black_noise_std, 2e-3, 1e-9);
  black.noise_std_dn = {41, 40, 40, 40};
  EXPECT_NEAR(make_thumbnail(frame, black, executor).black_noise_std, 41 / 4095.0, 1e-9);
}

TEST(Thumbnail, AnyThreadCountGivesTheSameBytes) {
  const auto run = [&](int threads) {
    test::NormalDn normal(4);
    RawFrame frame;
    frame.raw = test::bayer_frame(777, 333, BayerPhase::gbrg, [&](int, int) { return normal(700, 100); });
    return thumbnail_of(std::move(frame), threads);
  };
  const Thumbnail one = run(1);
  for (const int threads : {2, 3, 7}) {
    const Thumbnail many = run(threads);
    for (int c = 0; c < 3; ++c) {
      EXPECT_EQ(
          std::memcmp(one.mean.plane[c].data(), many.mean.plane[c].data(), one.mean.plane[c].size() * sizeof(float)),
          0);
    }
  }
}

}  // namespace
}  // namespace lowlux::isp
