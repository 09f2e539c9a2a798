#include "denoise/nl_bayes.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "denoise/denoiser.h"
#include "tests/denoise/frames.h"
#include "tests/reference/denoise_ref.h"

namespace lowlux {
namespace {

using namespace denoise_testing;
using denoise::DenoiseOptions;
using denoise::Level;

struct Outputs {
  Plane<float> signal, residual, confidence;
};

Outputs denoised(const Camera& camera, const Plane<float>& raw, const DenoiseOptions& options) {
  const int columns = (raw.width() + 1) / 2, rows = (raw.height() + 1) / 2;
  Outputs out{Plane<float>(raw.width(), raw.height()), Plane<float>(columns, rows), Plane<float>(columns, rows)};
  InlineExecutor one;
  denoise::Denoiser(raw.width(), raw.height(), 1, options.level)
      .run({raw.view(), camera.phase}, camera.noise(), options, out.signal.view(),
           {out.residual.view(), out.confidence.view()}, one);
  return out;
}

template <class A, class B>
double largest_difference(const Plane<A>& a, const Plane<B>& b) {
  double worst = 0;
  for (std::size_t i = 0; i < a.size(); ++i) {
    worst = std::max(worst, std::abs(static_cast<double>(a.data()[i]) - static_cast<double>(b.data()[i])));
  }
  return worst;
}

struct Case {
  int width, height;
  BayerPhase phase;
  double mean_e;
};

class NlBayesAgainstReference : public testing::TestWithParam<Case> {};

// Float rounding as in denoiser_test.cpp, 5e-6 of the largest value; the inverse loses up to its condition's root,
// which is the ratio of the signal's spread to the noise, below 10 here. The frames have no two patches whose distances
// differ by less than rounding: a group of 32 would change by one.
TEST_P(NlBayesAgainstReference, AgreesWithinFloatRounding) {
  const Case c = GetParam();
  const Camera camera{.phase = c.phase, .dark_e = {10, 12, 11, 9}, .read_noise_e = 1.5};
  const auto raw = exposed(camera, waves(c.mean_e), c.width, c.height, 7);
  const DenoiseOptions options{.level = Level::best, .white_gain = {1.9, 1, 1.4}, .keep_point_sources = false};
  const auto got = denoised(camera, raw, options);
  const auto expected = reference::denoise({raw.view(), camera.phase}, camera.noise(), options);
  const double scale = 1.9 * static_cast<double>(*std::max_element(raw.data(), raw.data() + raw.size()));
  EXPECT_LT(largest_difference(got.signal, expected.signal_e), 5e-5 * scale);
  EXPECT_LT(largest_difference(got.residual, expected.residual_variance), 5e-5 * scale);
  EXPECT_LT(largest_difference(got.confidence, expected.chroma_confidence), 1e-3);
}

INSTANTIATE_TEST_SUITE_P(Frames, NlBayesAgainstReference,
                         testing::Values(Case{64, 48, BayerPhase::rggb, 20}, Case{128, 64, BayerPhase::gbrg, 2},
                                         Case{2, 2, BayerPhase::rggb, 20}, Case{32, 16, BayerPhase::bggr, 200},
                                         Case{131, 37, BayerPhase::grbg, 20}));

double rms_error(const Plane<float>& got, const Camera& camera, const Scene& scene) {
  double sum = 0;
  for (int y = 0; y < got.height(); ++y) {
    for (int x = 0; x < got.width(); ++x) {
      sum += std::pow(static_cast<double>(got.at(x, y)) - mean_e(camera, scene, x, y), 2);
    }
  }
  return std::sqrt(sum / static_cast<double>(got.size()));
}

/// Cloth: threads with hard edges that repeat, in two colours.
Scene cloth(double mean) {
  return [mean](int x, int y) {
    const double thread = ((x + y / 3) / 5 + y / 7) % 2 == 0 ? 1.4 : 0.6, e = mean * thread;
    return std::array{e, e, e * (x > 120 ? 0.6 : 1.2)};
  };
}

TEST(NlBayes, IsNearerToRepeatingTextureThanHigh) {
  for (const auto& [mean, dark_e] : {std::array{200.0, 2.0}, {20.0, 2.0}, {20.0, 200.0}}) {
    const Camera camera{.dark_e = {dark_e, dark_e, dark_e, dark_e}};
    const auto raw = exposed(camera, cloth(mean), 240, 200, 71);
    const double high = rms_error(denoised(camera, raw, {.level = Level::high}).signal, camera, cloth(mean));
    const double best = rms_error(denoised(camera, raw, {.level = Level::best}).signal, camera, cloth(mean));
    EXPECT_LT(best, 0.95 * high) << mean << " over " << dark_e;
  }
}

// As ConstantFramesKeepTheirMeans of denoiser_properties_test.cpp: the coarsest level keeps the mean, of whose 384 x
// 256 cells the outermost 64 weigh 0.75 and the next 1.25: 0.25 sqrt(256 / 384 + 256 / 256) = 0.32 standard errors.
// Five times that for each.
TEST(NlBayes, KeepsTheMeansOfConstantFrames) {
  for (const auto& [signal_e, dark_e] : {std::array{0.1, 2.0}, {4.0, 200.0}, {200.0, 2.0}}) {
    const Camera camera{.dark_e = {dark_e, dark_e, dark_e, dark_e}};
    const auto raw = exposed(camera, flat(signal_e, signal_e, signal_e), 768, 512, 72);
    const auto out = denoised(camera, raw, {.level = Level::best, .rho = std::numeric_limits<double>::infinity()});
    const auto before = colour_means(raw.view(), camera.phase), after = colour_means(out.signal.view(), camera.phase);
    for (int k = 0; k < 3; ++k) {
      const double sites = 768 * 512 / (k == 1 ? 2.0 : 4.0);
      EXPECT_NEAR(after[k], before[k] - dark_e, 5 * 0.32 * std::sqrt((signal_e + dark_e + 2.25) / sites));
    }
  }
}

TEST(NlBayes, GivesNumbersForWhateverValues) {
  const Camera camera{.dark_e = {2, 2, 2, 2}, .read_noise_e = 0};
  auto raw = exposed(camera, cloth(5), 83, 70, 74);
  for (int y = 0; y < 70; ++y) {
    for (int x = 40; x < 83; ++x) raw.at(x, y) = raw.at(x, y) > 6 ? 1e30f : -1e30f;
  }
  raw.at(60, 30) = std::numeric_limits<float>::quiet_NaN();
  const int columns = 42, rows = 35;
  for (const double saturation_e : {4.0, 1e8, std::numeric_limits<double>::infinity()}) {
    for (const auto& gain : {std::array{1e3, 1e-3, 1.0}, std::array{1e-3, 1e3, 1e3}}) {
      auto noise = camera.noise();
      noise.saturation_e = {saturation_e, saturation_e, saturation_e};
      Plane<float> signal(83, 70), residual(columns, rows), confidence(columns, rows);
      InlineExecutor one;
      denoise::Denoiser(83, 70, 1, Level::best)
          .run({raw.view(), camera.phase}, noise, {.level = Level::best, .white_gain = gain}, signal.view(),
               {residual.view(), confidence.view()}, one);
      for (std::size_t i = 0; i < signal.size(); ++i) ASSERT_TRUE(std::isfinite(signal.data()[i]));
      for (std::size_t i = 0; i < residual.size(); ++i) {
        ASSERT_TRUE(std::isfinite(residual.data()[i]));
        ASSERT_GE(residual.data()[i], 0);
        ASSERT_TRUE(confidence.data()[i] >= 0 && confidence.data()[i] <= 1);
      }
    }
  }
}

/// Predicted over true root mean square of luma's error on flat frames.
double predicted_over_true(const Camera& camera, double signal_e) {
  double predicted = 0, square = 0;
  for (const std::uint64_t seed : {73, 74}) {
    const auto raw = exposed(camera, flat(signal_e, signal_e, signal_e), 768, 384, seed);
    const auto out = denoised(camera, raw, {.level = Level::best});
    for (int y = 0; y < 192; ++y) {
      for (int x = 0; x < 384; ++x) {
        const auto at = [&](int i, int j) { return static_cast<double>(out.signal.at(2 * x + i, 2 * y + j)); };
        square += std::pow(0.2 * (at(0, 0) + at(1, 1)) + 0.3 * (at(1, 0) + at(0, 1)) - signal_e, 2);
        predicted += static_cast<double>(out.residual.at(x, y));
      }
    }
  }
  return std::sqrt(predicted / square);
}

// What is left are some hundred independent blotches, a few of them by far the largest: the true error differs by a
// quarter from one frame to the next.
TEST(NlBayes, KnowsWhatItLeavesOfTheNoiseOfFlatFrames) {
  for (const auto& [signal_e, dark_e] : {std::array{0.2, 2.0}, {20.0, 200.0}}) {
    const Camera camera{.dark_e = {dark_e, dark_e, dark_e, dark_e}};
    const double ratio = predicted_over_true(camera, signal_e);
    EXPECT_GT(ratio, 0.75) << signal_e << " over " << dark_e;
    EXPECT_LT(ratio, 1.25) << signal_e << " over " << dark_e;
  }
}

}  // namespace
}  // namespace lowlux
