#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <cstring>
#include <limits>
#include <vector>

#include "denoise/temporal/temporal.h"
#include "denoise/temporal/temporal_thresholds.h"
#include "tests/denoise/draws.h"
#include "tests/denoise/frames.h"
#include "tests/reference/temporal_ref.h"
#include "tests/support/only_target.h"

namespace lowlux::temporal_test {
namespace {

using namespace denoise_testing;
using denoise::TemporalOptions;
using test::MeanOf;

constexpr double never = 1e-6;  // false alarms in what does not ask for them

Scene grey(double e) { return flat(e, e, e); }

/// A stream of one size, and what it last gave.
struct Stream {
  Stream(int width, int height, Camera of, TemporalOptions with = {})
      : camera(of),
        options(with),
        temporal(width, height, 1),
        mean(width, height),
        share((width + 1) / 2, (height + 1) / 2) {}

  double take(const Plane<float>& raw, double light = 1) {
    return temporal.run({raw.view(), camera.phase}, camera.noise(), light, options, mean.view(), share.view(), one);
  }
  double take(const Scene& scene, std::uint64_t seed, double light = 1) {
    return take(exposed(camera, scene, mean.width(), mean.height(), seed), light);
  }
  bool block_moved(int x, int y) { return share.at(4 * x, 4 * y) == 1.0f; }

  Camera camera;
  TemporalOptions options;
  denoise::TemporalMean temporal;
  InlineExecutor one;
  Plane<float> mean, share;
};

/// Share of still blocks that move, over tiles of 8 x 8 blocks: alarms come with some beside them, tiles hardly do.
void count_alarms(Stream& stream, MeanOf& alarms) {
  for (int y = 0; y + 64 <= stream.mean.height(); y += 64) {
    for (int x = 0; x + 64 <= stream.mean.width(); x += 64) {
      double moved = 0;
      for (int block = 0; block < 64; ++block)
        moved += stream.block_moved(x / 8 + block % 8, y / 8 + block / 8) ? 1 : 0;
      alarms.add(moved / 64);
    }
  }
}

/// Relative to what was asked for, that is. Two moments make a gamma variable of a sum; what its third and fourth and
/// the noise of the variances do beyond that grows towards few electrons. A block that was taken to move wrongly starts
/// from an unusual frame, and is likelier to do so again: a fifth more in the long run.
struct AlarmCase {
  double mean_e, max_at_first, most_later;
};

TEST(TemporalFalseAlarms, OfStillFramesAreThoseAskedFor) {
  const bool night = std::getenv("LOWLUX_NIGHTLY") != nullptr;
  for (const double rate : {0.01, 0.1}) {
    for (const AlarmCase& light : {AlarmCase{0.5, 1.4, 1.5}, {4, 1.1, 1.3}, {100, 1.1, 1.3}, {1e4, 1.1, 1.3}}) {
      MeanOf second, eighth;
      Stream stream(512, 512, {.read_noise_e = 2}, {.false_alarm = rate});
      for (std::uint64_t run = 0; run < (night ? 20 : 2); ++run) {
        stream.temporal.reset();
        for (std::uint64_t frame = 0; frame < 8; ++frame) {
          stream.take(grey(light.mean_e), 1000 + 8 * run + frame);
          if (frame == 1) count_alarms(stream, second);
          if (frame == 7) count_alarms(stream, eighth);
        }
      }
      EXPECT_GT(second.mean() + 5 * second.standard_error(), 0.9 * rate) << light.mean_e;
      EXPECT_LT(second.mean() - 5 * second.standard_error(), light.max_at_first * rate) << light.mean_e;
      EXPECT_GT(eighth.mean() + 5 * eighth.standard_error(), 0.9 * rate) << light.mean_e;
      EXPECT_LT(eighth.mean() - 5 * eighth.standard_error(), light.most_later * rate) << light.mean_e;
      if (night) {
        std::printf("rate %g, %g e-: second frame %.3f +- %.3f of it, eighth %.3f +- %.3f\n", rate, light.mean_e,
                    second.mean() / rate, second.standard_error() / rate, eighth.mean() / rate,
                    eighth.standard_error() / rate);
      }
    }
  }
}

/// Returns the share after one more still frame.
double next_share(double share, const TemporalOptions& options) {
  const double weight = std::max(share / (1 + share), 1.0 / options.max_frames);
  return (1 - weight) * (1 - weight) * share + weight * weight;
}

/// Takes frames, and adds for each tile of 8 x 8 blocks the share of blocks that areas were found to differ in: they do
/// not start anew, and their share in the frame that follows is not the next one.
/// @param scene_of  scene of each frame, counted from 0
template <class SceneOf>
void count_area_alarms(Stream& stream, int frames, std::uint64_t seed, MeanOf& alarms, const SceneOf& scene_of) {
  const int across = stream.mean.width() / 64, down = stream.mean.height() / 64;
  std::vector<double> larger(static_cast<std::size_t>(across * down));
  Plane<float> before(stream.share.width(), stream.share.height());
  for (int n = 0; n < frames; ++n) {
    std::copy_n(stream.share.data(), stream.share.size(), before.data());
    stream.take(scene_of(n), seed + static_cast<std::uint64_t>(n));
    for (int y = 0; n > 1 && y < 8 * down; ++y) {
      for (int x = 0; x < 8 * across; ++x) {
        const double share = static_cast<double>(stream.share.at(4 * x, 4 * y));
        const double expected = next_share(static_cast<double>(before.at(4 * x, 4 * y)), stream.options);
        larger[static_cast<std::size_t>(y / 8 * across + x / 8)] += share < 1 && share > expected + 1e-5 ? 1 : 0;
      }
    }
  }
  for (const double of_tile : larger) alarms.add(of_tile / 64 / (frames - 2));
}

// Each block lies in four areas. Those of a tile hardly depend on those of others.
TEST(TemporalFalseAlarms, OfAreasOfStillFramesAreNotMoreThanAskedFor) {
  struct Case {
    double rate;
    int frames;
  };
  for (const Case of : {Case{0.01, 3}, Case{0.1, 3}, Case{0.1, 9}, Case{TemporalOptions{}.false_alarm, 30}}) {
    for (const double mean_e : {4.0, 100.0, 1e4}) {
      Stream stream(1024, 1024, {.read_noise_e = 2}, {.false_alarm = of.rate});
      MeanOf alarms;
      count_area_alarms(stream, of.frames, 1500, alarms, [mean_e](int) { return grey(mean_e); });
      std::printf("rate %g, %g e-, %d frames: %.3f +- %.3f of it\n", of.rate, mean_e, of.frames,
                  alarms.mean() / of.rate, alarms.standard_error() / of.rate);
      EXPECT_GT(alarms.mean(), 0);
      EXPECT_LT(alarms.mean() - 5 * alarms.standard_error(), of.rate) << mean_e;
    }
  }
}

// A fifth of a standard deviation makes a step of 3 in a block of 64 sites, and of 41 in an area of 1024: the square of
// the change is added to the relative variance. Most of the frame does not change.
TEST(TemporalMotion, OfAreasBelowTheThresholdOfBlocksIsInTheVariance) {
  const double mean_e = 100, changed = 0.2, after = mean_e + changed * std::sqrt(mean_e + 4);
  Stream stream(1024, 256, {.read_noise_e = 2}, {.false_alarm = never});
  const Scene scene = [=](int x, int) {
    return x < 128 ? std::array{after, after, after} : std::array{mean_e, mean_e, mean_e};
  };
  for (std::uint64_t n = 0; n < 16; ++n) stream.take(grey(mean_e), 4200 + n);
  EXPECT_LT(stream.take(scene, 4300), 0.01) << "no block sees it";
  stream.take(scene, 4301);
  const double before = 1.0 / 17 + changed * changed, expected = before / (1 + before);
  MeanOf share, still;
  for (int y = 0; y < stream.share.height(); ++y) {
    for (int x = 0; x < stream.share.width(); ++x) {
      if (x < 52 || x >= 80) (x < 52 ? share : still).add(static_cast<double>(stream.share.at(x, y)));
    }
  }
  EXPECT_NEAR(share.mean(), expected, 0.1 * expected) << "the largest of four areas";
  EXPECT_NEAR(still.mean(), 1.0 / 18, 1e-3);
}

// Every second block is saturated, and one starts anew: the change is as large as its sites that count show, and the
// block has nothing of the mean that differs.
TEST(TemporalMotion, OfAreasIsThatOfTheSitesThatCountInBlocksThatDoNotStartAnew) {
  const double mean_e = 100, changed = 0.3, sigma = std::sqrt(mean_e + 4);
  Stream stream(1024, 256, {.read_noise_e = 2}, {.false_alarm = never});
  auto noise = stream.camera.noise();
  noise.saturation_e = {1000, 1000, 1000};
  const auto take = [&](bool moves, std::uint64_t seed) {
    const Scene scene = [=](int x, int y) {
      const double step = x / 8 == 4 && y / 8 == 5 ? 5 : x < 128 ? changed : 0;
      const double e = (x / 8 + y / 8) % 2 == 0 ? 3000 : mean_e + (moves ? step * sigma : 0);
      return std::array{e, e, e};
    };
    const auto raw = exposed(stream.camera, scene, 1024, 256, seed);
    return stream.temporal.run({raw.view(), stream.camera.phase}, noise, 1, stream.options, stream.mean.view(),
                               stream.share.view(), stream.one);
  };
  for (std::uint64_t n = 0; n < 16; ++n) take(false, 4400 + n);
  take(true, 4500);
  EXPECT_TRUE(stream.block_moved(4, 5));
  take(true, 4501);
  EXPECT_EQ(stream.share.at(4 * 4, 4 * 5), 0.5f) << "of two frames";
  const double before = 1.0 / 17 + changed * changed, expected = before / (1 + before);
  MeanOf share;
  for (int y = 0; y < 32; ++y) {
    for (int x = 0; x < 13; ++x) {
      if (x != 4 || y != 5) share.add(static_cast<double>(stream.share.at(4 * x, 4 * y)));
    }
  }
  EXPECT_NEAR(share.mean(), expected, 0.1 * expected);
}

// Tables: normal quantiles, and chi-square of 3 degrees of freedom at 5 % (7.815) and 0.1 % (16.266). With `alone` a
// and `beside` b, a + (b - a) (1 - (1 - a)^8) is the rate.
TEST(TemporalThresholds, AreThoseOfTables) {
  for (const double rate : {1e-6, 1e-3, 0.5}) {
    const auto at = denoise::motion_thresholds(rate);
    const auto rate_of = [](double z) { return 1 - std::pow(1 - std::erfc(z / std::sqrt(2)) / 2, 2); };
    const double a = rate_of(at.alone.z), b = rate_of(at.beside.z);
    EXPECT_NEAR(b, std::cbrt(rate), 1e-9);
    EXPECT_NEAR((a + (b - a) * (1 - std::pow(1 - a, 8))) / rate, 1, 1e-6);  // digits left of 1 - p
    for (const auto& one : {at.alone, at.beside}) {
      const double x = 3 * one.few * std::pow(1 - 2.0 / 27 + one.z * std::sqrt(2.0 / 27), 3);
      const double tail = std::erfc(std::sqrt(x / 2)) + std::sqrt(2 * x / 3.14159265358979) * std::exp(-x / 2);
      EXPECT_NEAR(tail / (std::erfc(one.z / std::sqrt(2)) / 2), 1, 1e-6);
    }
  }
}

struct Error {
  MeanOf error;  // of all sites [e-]
  double share = 0;
};

Error error_of(const Stream& stream, double truth_e) {
  Error out;
  for (std::size_t i = 0; i < stream.mean.size(); ++i)
    out.error.add(static_cast<double>(stream.mean.data()[i]) - truth_e);
  out.share = static_cast<double>(stream.share.data()[0]);
  return out;
}

// A variance of n samples of kurtosis 3 + g has a relative standard error of sqrt((2 + g) / n); of a mean of Poisson
// and normal draws g is below 1 / mean_e. A site where frames below 0 are clipped would show in the mean.
TEST(TemporalMean, OfNFramesHasOneNthOfTheVarianceAndNoBias) {
  for (const double mean_e : {0.0, 0.5, 4.0, 400.0}) {
    Stream stream(256, 256, {.dark_e = {3, 2, 2, 1}, .read_noise_e = 2}, {.false_alarm = never});
    const double sites = 256 * 256, kurtosis = 1;
    for (int n = 1; n <= 16; ++n) {
      const double moved = stream.take(grey(mean_e), 2000 + static_cast<std::uint64_t>(n));
      if (n > 1) {
        EXPECT_LE(moved, 2.0 / 1024) << "tails beyond those of a gamma variable";
      }
      const auto got = error_of(stream, mean_e + 2);
      const double variance = (mean_e + 2 + 4) / n;
      EXPECT_NEAR(got.share, 1.0 / n, 1e-5) << "floats";
      // Dark charge differs between red and blue: 0.5 e-^2 that no averaging removes.
      EXPECT_NEAR((got.error.variance() - 0.5) / variance, 1,
                  5 * std::sqrt((2 + kurtosis) / sites) * (1 + 0.5 / variance));
      EXPECT_NEAR(got.error.mean(), 0, 5 * std::sqrt(variance / sites)) << mean_e << " " << n;
    }
  }
}

TEST(TemporalMean, ForgetsAtTheRateOfItsOption) {
  Stream stream(128, 128, {.read_noise_e = 2}, {.false_alarm = never, .max_frames = 4});
  for (std::uint64_t n = 0; n < 40; ++n) stream.take(grey(20), 3000 + n);
  const auto got = error_of(stream, 20);
  EXPECT_NEAR(got.share, 1.0 / 7, 1e-5);  // k / (2 - k) of k = 1 / 4; (1 - k)^40 is left of the start
  EXPECT_NEAR(got.error.variance() / 24 * 7, 1, 5 * std::sqrt(3.0 / (128 * 128)));
}

// At 1 sigma, 64 of the noncentral chi-square of 3 degrees of freedom is left of 57 (after 8 frames): 1e-5 stay below
// 18. The texture has no step: 61 + 4 * 57, of deviation 11 to 23.
TEST(TemporalMotion, IsSeenInStepsOfOneAndTexturesOfTwoSigma) {
  for (const bool texture : {false, true}) {
    for (const double mean_e : {4.0, 100.0}) {
      const double sigma = std::sqrt(mean_e + 4);
      Stream stream(256, 256, {.read_noise_e = 2});
      for (std::uint64_t n = 0; n < 8; ++n) stream.take(grey(mean_e + 2 * sigma), 4000 + n);
      stream.take(
          [&](int x, int y) {
            const double changed = texture ? ((x / 2 + y / 2) % 2 == 0 ? 2 : -2) : 1;
            const double e = mean_e + 2 * sigma + (x < 128 ? changed * sigma : 0);
            return std::array{e, e, e};
          },
          4100);
      double moved = 0, still = 0;
      for (int i = 0; i < 32 * 32; ++i) (i % 32 < 16 ? moved : still) += stream.block_moved(i % 32, i / 32) ? 1 : 0;
      EXPECT_GT(moved, 0.99 * 512) << texture << " " << mean_e;
      EXPECT_LT(still, 0.05 * 512) << "a tenth of those beside moved ones: 32 of 512";
    }
  }
}

/// Mean of what a bar leaves 1..20 sites behind itself, less 5 standard errors [e-]: 60 sites wide, `steps` standard
/// deviations brighter than 20 e-, and moving by 3 sites for each frame.
std::array<double, 20> trail_e(double steps, bool compensate) {
  const double mean_e = 20, sigma = std::sqrt(24);
  Stream stream(384, 256, {.read_noise_e = 2}, {.compensate_motion = compensate});
  std::array<MeanOf, 20> trail;
  for (int frame = 0; frame < 40; ++frame) {
    const int right = 100 + 3 * frame;
    stream.take(
        [&](int x, int) {
          const double e = mean_e + (x >= right - 60 && x < right ? steps * sigma : 0);
          return std::array{e, e, e};
        },
        5000 + static_cast<std::uint64_t>(frame));
    if (frame < 20) continue;
    for (int i = 0; i < 20; ++i) {
      for (int y = 0; y < 256; ++y) trail[i].add(static_cast<double>(stream.mean.at(right - 61 - i, y)) - mean_e);
    }
  }
  std::array<double, 20> out{};
  for (int i = 0; i < 20; ++i) out[i] = std::abs(trail[i].mean()) - 5 * trail[i].standard_error();
  return out;
}

// What a bar leaves behind stays below the raw noise of a site, whatever its contrast; what is clearly seen leaves
// nothing. Where its motion is compensated by whole cells, the next site has up to a quarter of the contrast.
TEST(TemporalMotion, LeavesNoTrailAboveTheNoise) {
  for (const double steps : {0.5, 1.0, 2.0, 4.0, 16.0}) {
    for (const bool compensate : {false, true}) {
      const auto trail = trail_e(steps, compensate);
      for (int i = 0; i < 20; ++i) {
        const double limit = compensate && i == 0 ? std::max(0.6, 0.25 * steps) : steps < 4 ? 0.6 : 0.02;
        EXPECT_LT(trail[i], limit * std::sqrt(24)) << steps << " sigma, " << i + 1 << " sites behind, " << compensate;
      }
    }
  }
}

// Twice the light: the mean is scaled, its variance 4 times that of before. With s of before, s' = 4 s 14 / 24.
TEST(TemporalLight, ScalesMeanAndVarianceShare) {
  Stream stream(256, 256, {.dark_e = {3, 3, 3, 3}, .read_noise_e = 2}, {.false_alarm = never});
  for (std::uint64_t n = 0; n < 8; ++n) stream.take(grey(7), 6000 + n);
  stream.camera.dark_e = {6, 6, 6, 6};
  EXPECT_EQ(stream.take(grey(14), 6100, 2), 0);
  const double before = 1.0 / 8 * 4 * (7 + 3 + 4) / (14 + 6 + 4), share = before / (1 + before);
  const auto got = error_of(stream, 14 + 6);
  EXPECT_NEAR(got.share, share, 0.01) << "by means of blocks: their deviation is sqrt(14 / 8 / 16) of 14";
  EXPECT_NEAR(got.error.mean(), 0, 5 * std::sqrt(24 * share / 65536));
  EXPECT_NEAR(got.error.variance() / 24, share, 5 * share * std::sqrt(3.0 / 65536) + 0.01 * share);
}

// Lamps that flicker by 1 % (rms) change what stands still by 0.06 to 0.11 standard deviations, which areas do not take
// for motion. The error of the mean is the noise of 1 / n of a frame and what is left of the flicker. Blocks that start
// anew add 0.14 of it, without the test of areas too; areas that were compared as they are would add 0.14 more.
TEST(TemporalLight, ThatFlickersIsNotMotionOfAreas) {
  constexpr std::uint32_t seed = 4600;
  constexpr int frames = 24;
  const auto light_e = [](int x, int y) { return std::array{40.0, 80.0, 100.0, 120.0}[(x / 64 + 2 * (y / 64)) % 4]; };
  const auto flicker = [](int n) {  // at a phase drawn at random
    const std::uint32_t word = words_at({.seed = seed}, static_cast<std::uint32_t>(n), 0)[0];
    return 0.01 * std::sqrt(2) * std::sin(2 * 3.14159265358979 * word / 4294967296.0);
  };
  Stream stream(512, 512, {.read_noise_e = 2}, {.compensate_motion = false});
  MeanOf alarms;
  count_area_alarms(stream, frames, seed, alarms, [&](int n) {
    return [of_frame = flicker(n), light_e](int x, int y) {
      const double e = (1 + of_frame) * light_e(x, y);
      return std::array{e, e, e};
    };
  });
  EXPECT_LT(alarms.mean() - 5 * alarms.standard_error(), stream.options.false_alarm) << "seed " << seed;
  double left = 0;
  for (int n = 0; n < frames; ++n) left += flicker(n) / frames;
  double error = 0, expected = 0;  // over the variance of raw values
  for (int y = 0; y < 512; ++y) {
    for (int x = 0; x < 512; ++x) {
      const double e = light_e(x, y), variance = e + 4;
      error += std::pow(static_cast<double>(stream.mean.at(x, y)) - e, 2) / variance;
      expected += 1.0 / frames + left * left * e * e / variance;
    }
  }
  std::printf("seed %u: areas that differ %.5f, error %.3f of that expected\n", seed, alarms.mean(), error / expected);
  EXPECT_LT(error / expected, 1.2) << "seed " << seed;
}

TEST(TemporalMean, StartsAnewAfterResetAndWithAnotherSizePhaseOrLightBeyondBounds) {
  Stream stream(64, 48, {});
  EXPECT_EQ(stream.take(grey(20), 7000), 1);
  EXPECT_LT(stream.take(grey(20), 7001), 0.1);
  stream.temporal.reset();
  EXPECT_EQ(stream.take(grey(20), 7002), 1);
  stream.camera.phase = BayerPhase::gbrg;
  EXPECT_EQ(stream.take(grey(20), 7003), 1);
  EXPECT_LT(stream.take(grey(20), 7004), 0.1);
  EXPECT_LT(stream.take(grey(20), 7004, 1.001), 0.1);
  EXPECT_EQ(stream.take(grey(20), 7004, 1.1e6), 1);
  EXPECT_EQ(stream.take(grey(20), 7004, 0.9e-6), 1);
  const auto small = exposed(stream.camera, grey(20), 40, 30, 7005);
  Plane<float> out(40, 30);
  EXPECT_EQ(stream.temporal.run({small.view(), stream.camera.phase}, stream.camera.noise(), 1, {}, out.view(), {},
                                stream.one),
            1);
  EXPECT_EQ(std::memcmp(out.data(), small.data(), small.size() * sizeof(float)), 0);
}

/// Largest difference to the reference [e-] over some frames with motion, light that changes, and saturation. Frames of
/// 64 pixels each way have their motion compensated.
double difference(int width, int height, BayerPhase phase) {
  Stream stream(width, height, {.phase = phase, .dark_e = {3, 1, 2, 4}, .read_noise_e = 1.5}, {.false_alarm = 0.05});
  reference::TemporalMean plain;
  double worst = 0;
  for (int frame = 0; frame < 6; ++frame) {
    const double light = frame == 3 ? 2 : 1;
    const Scene scene = [frame](int x, int y) {
      const double e =
          (frame < 3 ? 10 : 20) * (1 + x % 5) + (std::abs(x - 9 * frame) < 5 ? 60 : 0) + (y == 3 ? 200 : 0);
      return std::array{e, 2 * e, 0.5 * e};
    };
    auto raw = exposed(stream.camera, scene, width, height, 8000 + static_cast<std::uint64_t>(frame));
    raw.at(1, 1) = frame == 2 ? std::numeric_limits<float>::quiet_NaN() : 1e30f;
    auto noise = stream.camera.noise();
    noise.saturation_e = {180, 200, 150};
    const double moved = stream.temporal.run({raw.view(), phase}, noise, light, stream.options, stream.mean.view(),
                                             stream.share.view(), stream.one);
    EXPECT_EQ(moved, plain.run({raw.view(), phase}, noise, light, stream.options)) << width << " x " << height;
    for (std::size_t i = 0; i < stream.mean.size(); ++i) {
      worst = std::max(worst, std::abs(static_cast<double>(stream.mean.data()[i]) - plain.mean_e.data()[i]) /
                                  std::max(1000.0, std::abs(plain.mean_e.data()[i])));
    }
    for (std::size_t i = 0; i < stream.share.size(); ++i) {
      EXPECT_NEAR(static_cast<double>(stream.share.data()[i]), plain.variance_fraction.data()[i],
                  std::min(width, height) < 64 ? 1e-5 : 1e-4)
          << "a rounded cell may differ by a unit";
    }
  }
  return worst;
}

TEST(TemporalMean, AgreesWithTheReferenceAtAnySizeAndPhase) {
  for (const auto phase : {BayerPhase::rggb, BayerPhase::grbg, BayerPhase::gbrg, BayerPhase::bggr}) {
    for (const auto& size :
         {std::array{2, 2}, {3, 5}, {8, 8}, {9, 2}, {127, 17}, {128, 24}, {261, 35}, {64, 64}, {149, 107}}) {
      const double digits = std::min(size[0], size[1]) < 64 ? 1e-6 : 1e-5;  // weights differ with rounded cells
      EXPECT_LT(difference(size[0], size[1], phase), digits) << "of 1000 e-: a digit of floats, added up over 6 frames";
    }
  }
}

TEST(TemporalSaturation, IsPassedAsItIsAndHidesNoMotion) {
  Stream stream(64, 64, {});
  auto noise = stream.camera.noise();
  noise.saturation_e = {1000, 1000, 1000};
  const auto take = [&](const Plane<float>& raw) {
    return stream.temporal.run({raw.view(), stream.camera.phase}, noise, 1, {.false_alarm = never}, stream.mean.view(),
                               stream.share.view(), stream.one);
  };
  Plane<float> high(64, 64), dark = exposed(stream.camera, grey(20), 64, 64, 9000);
  for (std::size_t i = 0; i < high.size(); ++i) high.data()[i] = 1000.0f + static_cast<float>(i % 7);
  take(high);
  EXPECT_EQ(take(high), 0);
  EXPECT_EQ(std::memcmp(stream.mean.data(), high.data(), high.size() * sizeof(float)), 0);
  for (std::size_t i = 0; i < high.size(); i += 2) high.data()[i] = 3000;  // where it ends is chance
  EXPECT_EQ(take(high), 0);
  EXPECT_EQ(take(dark), 1) << "saturated in the mean alone";
  EXPECT_EQ(take(high), 1) << "saturated in the frame alone";
}

TEST(TemporalMean, OfAnyNumbersIsFinite) {
  Stream stream(70, 50, {.read_noise_e = 0});
  const std::array odd{std::numeric_limits<float>::quiet_NaN(),
                       std::numeric_limits<float>::infinity(),
                       -std::numeric_limits<float>::infinity(),
                       3e38f,
                       -3e38f,
                       1e-45f,
                       0.0f,
                       -5.0f};
  for (std::uint32_t frame = 0; frame < 12; ++frame) {
    auto raw = exposed(stream.camera, grey(0), 70, 50, 9100 + frame);
    for (int i = 0; i < 3500; ++i) {
      const auto words = words_at({.seed = 9200 + frame}, static_cast<std::uint32_t>(i), 0);
      if (words[0] % 4 != 0) raw.data()[i] = odd[words[1] % odd.size()];
    }
    stream.take(raw, std::array{1.0, 1e6, 1e-6, 1.0, 1e300, 1e-300}[frame % 6]);
    for (std::size_t i = 0; i < raw.size(); ++i) ASSERT_LE(std::abs(stream.mean.data()[i]), 1e9f);
    for (std::size_t i = 0; i < stream.share.size(); ++i) {
      ASSERT_GT(stream.share.data()[i], 0);
      ASSERT_LE(stream.share.data()[i], 1);
    }
  }
}

/// The last mean of some frames with things that move.
Plane<float> last_of(int threads) {
  constexpr int width = 333, height = 211;
  const Camera camera{.dark_e = {3, 3, 3, 3}};
  PoolExecutor pool(threads);
  denoise::TemporalMean temporal(width, height, threads);
  Plane<float> out(width, height), share((width + 1) / 2, (height + 1) / 2);
  for (int frame = 0; frame < 4; ++frame) {
    const auto raw = exposed(
        camera,
        [frame](int x, int y) {
          const double e = 20 + ((x + 7 * frame) % 50 < 12 && y % 40 < 25 ? 30 : 0);
          return std::array{e, e, e};
        },
        width, height, 9300 + static_cast<std::uint64_t>(frame));
    temporal.run({raw.view(), camera.phase}, camera.noise(), frame == 2 ? 1.1 : 1, {}, out.view(), share.view(), pool);
  }
  return out;
}

TEST(TemporalThreads, GiveTheSameBits) {
  const auto one = last_of(1);
  for (const int threads : {2, 3, 7}) {
    const auto some = last_of(threads);
    EXPECT_EQ(std::memcmp(one.data(), some.data(), one.size() * sizeof(float)), 0) << threads;
  }
}

TEST(TemporalTargets, GiveTheSameBits) {
  const auto best = last_of(1);
  for (const std::int64_t target : test::kernel_targets()) {
    const test::OnlyTarget only(target);
    const auto out = last_of(1);
    EXPECT_EQ(std::memcmp(best.data(), out.data(), out.size() * sizeof(float)), 0) << hwy::TargetName(target);
  }
}

}  // namespace
}  // namespace lowlux::temporal_test
