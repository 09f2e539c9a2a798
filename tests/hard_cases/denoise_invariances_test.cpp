#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <limits>
#include <numbers>
#include <utility>
#include <vector>

#include "denoise/temporal/temporal.h"
#include "tests/hard_cases/mosaics.h"
#include "tests/reference/temporal_ref.h"
#include "tests/support/numbers.h"

// Section 10 of the denoising specification, and what 9.11 and 9.12 ask of threads and of values.
namespace lowlux::hard_cases {
namespace {

using denoise_testing::Camera;
using denoise_testing::flat;
using denoise_testing::waves;
using test::inf;

constexpr std::string_view denoise_invariances_group = "Noise reduction: invariances", hard_cases = "Noise reduction";

// Values of up to 200 e-.
constexpr Bound double_sums_e{200 * double_sums.value, rounding}, float_sums_e{200 * float_sums.value, rounding};

Camera with_dark(double dark_e, double read_noise_e) {
  return {.dark_e = {dark_e, dark_e, dark_e, dark_e}, .read_noise_e = read_noise_e};
}

TEST(HardCaseInvariance, ConstantFramesKeepTheirMeans) {
  HardCase row({denoise_invariances_group, "10 flats of 0.1 to 200 e- keep their means",
                "closed form: the gain of a mean is 1; three standard errors, borders being counted twice",
                "standard errors of the mean"});
  constexpr Bound bound{3, any_draw};
  measure(row, {bound, bound, bound, bound}, [](const PathRun& run) {
    double worst = 0;
    for (const auto& [signal_e, dark_e] : {std::array{0.1, 2.0}, {4.0, 200.0}, {200.0, 2.0}}) {
      const MosaicCase c = case_of(with_dark(dark_e, 1.5), flat(signal_e, signal_e, signal_e), 144, 112, 81);
      keep_worst(worst, change_of_means(c)(run(c).view()));
    }
    return worst;
  });
}

TEST(HardCaseInvariance, OneUnitIsAsGoodAsAnother) {
  HardCase row({denoise_invariances_group, "10 another unit: all gains times eight, codes halved",
                "the same in the first unit", "e-"});
  const auto change = [&](const PathRun& run, std::uint64_t seed, double gain_factor, double code_factor) {
    MosaicCase c = case_of(with_dark(5, 1.5), waves(30), 200, 150, seed);
    c.gain_dn_per_e = 8;
    for (std::size_t i = 0; i < c.raw_e.size(); ++i) c.raw_e.data()[i] = std::round(4 * c.raw_e.data()[i]) / 4;
    c.options.white_gain = {2, 1, 1.5};
    MosaicCase other = c.with_values(c.raw_e.clone());
    for (double& gain : other.options.white_gain) gain *= gain_factor;
    other.gain_dn_per_e *= code_factor;
    other.black_dn *= code_factor;
    // Rounding to codes is added to the variance; the sum is the same.
    const double rounding_e2 = 1 / (12 * std::pow(c.gain_dn_per_e, 2));
    for (double& variance : other.noise.variance_e2) variance -= rounding_e2 * (1 / std::pow(code_factor, 2) - 1);
    return largest_difference(run(c), run(other));
  };
  // A power of two changes no rounding.
  measure(row, {0, 0, -1, -1}, [&](const PathRun& run) { return change(run, 82, 8, 1); });
  // Live mosaics have codes of 1/32 and 1/16 e-.
  measure(row, {-1, -1, float_sums_e, float_sums_e.value + 1.0 / 32}, [&](const PathRun& run) {
    double worst = 0;
    for (const std::uint64_t seed : {82, 112, 113, 114}) keep_worst(worst, change(run, seed, 1, 0.5));
    return worst;
  });
}

TEST(HardCaseInvariance, ExchangeOfRedAndBlueCommutes) {
  HardCase row({denoise_invariances_group, "10 red and blue exchanged with their parameters",
                "the same before; kernels: the same bits", "e-"});
  MosaicCase c = case_of({.dark_e = {5, 6, 6, 9}}, waves(30), 203, 150, 83);
  c.options.white_gain = {2, 1, 1.5};
  MosaicCase other = c.with_values(c.raw_e.clone());
  other.phase = BayerPhase::bggr;
  other.options.white_gain = {1.5, 1, 2};
  measure(row, {double_sums_e, 0, 0, 0}, [&](const PathRun& run) { return largest_difference(run(c), run(other)); });
}

TEST(HardCaseInvariance, DarkChargeActsThroughTheVarianceOnly) {
  HardCase row({denoise_invariances_group, "10 64 e- more of values and dark, less of read noise squared",
                "the same without; float sums", "e-"});
  // Values of 1/1024 e-, to which 64 e- are added exactly: rounding would change choices of thresholds and of the
  // nearest places of `best` in some draws.
  MosaicCase c = case_of(with_dark(40, 10), waves(50), 200, 150, 84);
  for (std::size_t i = 0; i < c.raw_e.size(); ++i) c.raw_e.data()[i] = std::round(1024 * c.raw_e.data()[i]) / 1024;
  MosaicCase more = c.with_values(c.raw_e.clone());
  for (std::size_t i = 0; i < more.raw_e.size(); ++i) more.raw_e.data()[i] += 64;
  for (double& dark : more.noise.dark_mean_e) dark += 64;
  for (double& variance : more.noise.variance_e2) variance -= 64;
  measure(row, {double_sums_e, float_sums_e, -1, -1},
          [&](const PathRun& run) { return largest_difference(run(c), run(more)); });
  // The pipelines' white moves with black, and with it the fraction that an electron is of it.
  measure(row, {-1, -1, float_sums_e, float_sums_e.value + 1.0 / 16},
          [&](const PathRun& run) { return largest_difference(run(c), run(more)); });
}

std::pair<double, double> chromaticity(const std::array<double, 3>& mean) {
  const double sum = mean[0] + mean[1] + mean[2];
  return {mean[0] / sum, mean[2] / sum};
}

TEST(HardCaseInvariance, TwiceTheDarkDoesNotMoveTheMeanChromaticity) {
  HardCase row({denoise_invariances_group, "10 twice the dark charge, subtracted: chromaticity",
                "closed form: that of the light", "standard errors of the ratio"});
  measure(row, {5, 5, 5, 5}, [](const PathRun& run) {
    double worst = 0;
    for (const double dark_e : {20.0, 40.0}) {
      const MosaicCase c = case_of(with_dark(dark_e, 1.5), flat(12, 6, 3), 256, 192, 85);
      const auto got = chromaticity(denoise_testing::colour_means(run(c).view(), c.phase));
      const auto truth = chromaticity({12, 6, 3});
      const double error = std::sqrt((12 + dark_e + 2.25) / (256 * 192 / 4.0)) / 21 * std::numbers::sqrt2;
      keep_worst(worst, std::abs(got.first - truth.first) / error);
      keep_worst(worst, std::abs(got.second - truth.second) / error);
    }
    return worst;
  });
}

// Eight frames: one that starts, two that follow, light that changes by the exposure's whole range and back.
template <class Mean>
void eight_frames(const Camera& camera, const Mean& take) {
  const std::array light{1.0, 1.0, 1.0, 1e-6, 1e6, 1.0, 0.25, 4.0};
  double e = 400;
  for (std::size_t i = 0; i < light.size(); ++i) {
    e *= light[i];
    take(denoise_testing::exposed(camera, flat(e, e, e), 130, 70, 90 + i), light[i]);
  }
}

/// Of the codes that the stream has, dark charge in the pedestal; live mosaics have codes of 1/16 e-.
double live_against_reference(const Camera& camera, Denormals mode) {
  const double dark_e = camera.dark_e[0], variance_e2 = dark_e + std::pow(camera.read_noise_e, 2) + 1.0 / (12 * 16);
  MosaicCase c{.raw_e = Plane<float>(130, 70), .phase = camera.phase, .noise = camera.noise()};
  LiveMeans live(c, mode);
  reference::TemporalMean expected;
  const double saturation_e = 0.99 * (16383 - c.black_dn - c.gain_dn_per_e * dark_e) / c.gain_dn_per_e;
  const denoise::RawNoise noise{.variance_e2 = {variance_e2, variance_e2, variance_e2},
                                .saturation_e = {saturation_e, saturation_e, saturation_e}};
  double worst = 0;
  eight_frames(camera, [&](const Plane<float>& raw, double light) {
    Plane<float> signal(130, 70);
    for (std::size_t i = 0; i < raw.size(); ++i) {
      c.raw_e.data()[i] = std::round(4 * raw.data()[i]) / 4;
      signal.data()[i] = c.raw_e.data()[i] - static_cast<float>(dark_e);
    }
    expected.run({signal.view(), camera.phase}, noise, light, {});
    keep_worst(worst, largest_difference(live.take(c, light), expected.mean_e));
  });
  return worst;
}

TEST(HardCaseTemporal, MeansOverFramesAreThoseOfTheReference) {
  HardCase row({denoise_invariances_group, "means over frames whose light changes by 1e-6 and 1e6",
                "plain double; two roundings in float of 1e6 times 0.1 e- of noise", "e-"});
  const Camera camera = with_dark(5, 2);
  // A frame in the dark weighs 1/32 and has noise of 3 e-, up to five times that.
  const double bound = 2 * 0x1p-24 * 1e6 * 5 * 3 / 32;
  const auto run = [&](Denormals mode) {
    reference::TemporalMean expected;
    denoise::TemporalMean temporal(130, 70, 2);
    PoolExecutor pool(2);
    test::ExecutorInMode executor(pool, mode);
    Plane<float> mean(130, 70);
    double worst = 0;
    eight_frames(camera, [&](const Plane<float>& raw, double light) {
      expected.run({raw.view(), camera.phase}, camera.noise(), light, {});
      in_mode(mode, [&] {
        temporal.run({raw.view(), camera.phase}, camera.noise(), light, {}, mean.view(), {}, executor);
      });
      for (std::size_t i = 0; i < mean.size(); ++i) {
        keep_worst(worst, std::abs(static_cast<double>(mean.data()[i]) - expected.mean_e.data()[i]));
      }
    });
    return worst;
  };
  row.on(Path::reference, 0, [&](Denormals mode) {
    reference::TemporalMean kept, other;
    double worst = 0;
    eight_frames(camera, [&](const Plane<float>& raw, double light) {
      kept.run({raw.view(), camera.phase}, camera.noise(), light, {});
      in_mode(mode, [&] { other.run({raw.view(), camera.phase}, camera.noise(), light, {}); });
      keep_worst(worst, largest_difference(kept.mean_e, other.mean_e));
    });
    return worst;
  });
  row.none(levels, "applies to previous frames, not to levels").on_each_set(bound, run);
  row.none(Path::file, "a file is one frame");
  row.on(Path::live, bound + 1.0 / 16, [&](Denormals mode) { return live_against_reference(camera, mode); });
}

TEST(HardCaseDenoise11, ThreadsDoNotChangeABit) {
  HardCase row({hard_cases, "9.11 one thread, two, seven", "the same on one thread", "samples that differ"});
  const MosaicCase c = case_of(with_dark(5, 1.5), denoise_testing::waves(20), 203, 150, 72);
  const auto differing = [&](const std::function<Plane<double>(int threads)>& run) {
    const Plane<double> one = run(1);
    double count = 0;
    for (const int threads : {2, 7}) {
      const Plane<double> many = run(threads);
      for (std::size_t i = 0; i < one.size(); ++i) count += one.data()[i] == many.data()[i] ? 0 : 1;
    }
    return count;
  };
  const auto fast = [&](denoise::Level level) {
    return [&, level](Denormals m) { return differing([&](int n) { return by_denoiser(c, level, m, n); }); };
  };
  row.none(Path::reference, "has one thread only");
  for (std::size_t i = 0; i < levels.size(); ++i) row.on(levels[i], 0, fast(denoise::all_levels[i]));
  row.on_each_set(0, fast(denoise::Level::high));
  row.on(Path::file, 0, [&](Denormals m) { return differing([&](int n) { return by_file(c, m, n); }); });
  row.on(Path::live, 0, [&](Denormals m) { return differing([&](int n) { return by_live(c, m, n); }); });
}

TEST(HardCaseDenoise12, FramesOfOneValueGiveThatValue) {
  HardCase row({hard_cases, "9.12 frames of one value: 0, -50, 4095, 1e9, -1e9 e-",
                "closed form: the value; float sums", "relative"});
  const auto of = [](const std::vector<float>& values) {
    return [values](const PathRun& run) {
      double worst = 0;
      for (const float e : values) {
        MosaicCase c = case_of(with_dark(0, 2), flat(0, 0, 0), 150, 97, 1);
        c.options.rho = inf;
        std::fill_n(c.raw_e.data(), c.raw_e.size(), e);
        const double scale = std::max(1.0, std::abs(static_cast<double>(e)));
        keep_worst(worst, distance_from(static_cast<double>(e))(run(c).view()) / scale);
      }
      return worst;
    };
  };
  measure(row, {double_sums, float_sums, -1, -1}, of({0, -50, 4095, 1e9f, -1e9f}));
  measure(row, {-1, -1, float_sums, 0}, of({0, -50, 3950}));  // what codes hold, those of streams exactly
}

TEST(HardCaseDenoise12, SitesThatAreNoNumbersLeaveNone) {
  HardCase row({hard_cases, "9.12 sites that are NaN or infinite", "finite out for whatever is in",
                "sites that are not finite"});
  MosaicCase c = case_of(with_dark(5, 1.5), flat(20, 20, 20), 150, 97, 73);
  c.raw_e.at(0, 0) = std::numeric_limits<float>::quiet_NaN();
  c.raw_e.at(149, 96) = -std::numeric_limits<float>::infinity();
  c.raw_e.at(75, 50) = std::numeric_limits<float>::quiet_NaN();
  c.raw_e.at(20, 60) = std::numeric_limits<float>::infinity();
  measure(row, c, {0, 0, -1, -1}, [](PlaneView<const double> out) {
    double count = 0;
    for (int y = 0; y < out.height; ++y) {
      for (int x = 0; x < out.width; ++x) count += std::isfinite(out.at(x, y)) ? 0 : 1;
    }
    return count;
  });
  row.none(pipelines, "codes are numbers");
}

}  // namespace
}  // namespace lowlux::hard_cases
