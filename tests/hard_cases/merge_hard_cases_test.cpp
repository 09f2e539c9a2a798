#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "tests/hard_cases/hard_case.h"
#include "tests/merge/drizzle_frames.h"
#include "tests/pipeline/merge/merge_bursts.h"

// Several frames of one scene.
namespace lowlux::hard_cases {
namespace {

using test::Burst;

constexpr std::string_view merge_group = "Merging";

/// States why the other paths are not measured.
void none_but_file(HardCase& row, std::string_view reference = "is the reference itself") {
  row.none(Path::reference, reference).none(levels, "noise reduction comes after");
  row.none(instruction_sets, scalar_code).none(Path::live, "streams are not merged");
}

TEST(HardCaseMerge, PlainMean) {
  HardCase row({merge_group, "plain mean of 1 to 9 frames at rest", "plain double", "codes of 16 bits"});
  none_but_file(row);
  row.on(Path::file, {1.01, "codes are rounded at random"}, [](Denormals m) {
    double worst = 0;
    for (const int count : {1, 2, 9}) {
      const Burst burst{.width = 61, .height = 47, .mean_e = 300};
      const auto merged =
          in_mode(m, [&] { return burst.merged(count, {.robust = false, .alignment = isp::MergeAlignment::none}); });
      std::vector<double> mean_e(61 * 47);
      for (int k = 0; k < count; ++k) {
        const RawFrame frame = burst.frame(k);
        for (std::size_t i = 0; i < mean_e.size(); ++i) {
          mean_e[i] += (frame.raw.dn.data()[i] - test::night_black_dn) / test::night_gain_dn_per_e / count;
        }
      }
      const double code_e = test::night_full_e() / (65535 - merged.frame.raw.black_tag->pattern_dn[0]);
      for (int y = 0; y < 47; ++y) {
        for (int x = 0; x < 61; ++x) {
          const auto i = static_cast<std::size_t>(y) * 61 + static_cast<std::size_t>(x);
          keep_worst(worst, std::fabs(Burst::signal_e(merged.frame, x, y) - mean_e[i]) / code_e);
        }
      }
    }
    return worst;
  });
}

/// Returns the variance of the best mean of the exposures that do not saturate at a signal.
double best_variance_e2(const std::vector<double>& lights, double signal_e) {
  double weight = 0;
  for (const double light : lights) {
    if (light * signal_e < 0.85 * test::night_full_e()) weight += light * light / (light * signal_e + 4 + 1.0 / 192);
  }
  return 1 / weight;
}

TEST(HardCaseMerge, BracketOf24Ev) {
  HardCase row({merge_group, "bracket of 24 EV, in floating-point samples: means of bands of 0.01 to 1.5e7 e-",
                "closed form: standard errors of the best weights", "standard errors"});
  none_but_file(row, "the reference is a closed form");
  row.on(Path::file, 5, [](Denormals m) {
    const std::vector<double> lights{4096, 256, 16, 1, 1.0 / 16, 1.0 / 256, 1.0 / 4096};
    Burst burst{.width = 1024, .height = 64};
    burst.scene = [](double x, double, int) { return 0.01 * std::pow(10, 9.18 * x / 1023); };
    burst.light = [&](int index) { return lights[static_cast<std::size_t>(index)]; };
    const auto merged = in_mode(m, [&] {
      return burst.merged(static_cast<int>(lights.size()), {.alignment = isp::MergeAlignment::none, .reference = 0});
    });
    EXPECT_TRUE(merged.frame.raw.is_float());
    const double white_e = std::exp2(merged.baseline_exposure_ev) / lights[0] * test::night_full_e();
    double worst = 0;
    for (int x0 = 0; x0 < 1024; x0 += 32) {
      double error = 0;
      for (int x = x0; x < x0 + 32; ++x) {
        const double std_e = std::sqrt(best_variance_e2(lights, burst.truth_e(x, 0)));
        for (int y = 0; y < 64; ++y)
          error += (Burst::signal_e(merged.frame, x, y, white_e) - burst.truth_e(x, y)) / std_e;
      }
      keep_worst(worst, std::fabs(error) / std::sqrt(32.0 * 64));
    }
    return worst;
  });
}

TEST(HardCaseMerge, Drizzle) {
  HardCase row({merge_group, "drizzle of drops of 0.1 to 1 px on pixels of 1 to 1/3 px",
                "plain double: overlaps of all drops and pixels", "relative to the largest value"});
  none_but_file(row);
  row.on(Path::file, {3e-6, rounding}, [](Denormals m) {
    star_testing::Draw draw(26);
    double worst = 0;
    for (const merge::DrizzleOptions options : {merge::DrizzleOptions{1, 1}, {1.37, 0.6}, {3, 0.1}, {2, 0.5}}) {
      constexpr int width = 31, height = 23;
      const int columns = static_cast<int>(std::ceil(width * options.scale));
      const int rows = static_cast<int>(std::ceil(height * options.scale));
      star_testing::DrizzleReference expected(columns, rows);
      merge::Drizzle drizzle(width, height, options);
      InlineExecutor one;
      for (int k = 0; k < 5; ++k) {
        const double dx = draw.uniform(-4, 4), dy = draw.uniform(-4, 4);
        Plane<float> frame(width, height);
        for (std::size_t i = 0; i < frame.size(); ++i) frame.data()[i] = static_cast<float>(draw.uniform(-5, 100));
        expected.add(frame, BayerPhase::rggb, 0, dx, dy, options, 1 / 6.5);
        const auto motion = star_testing::moved(width, height, 0, dx, dy);
        in_mode(m, [&] {
          return drizzle.add({.frame = star_testing::view(frame), .motion = motion, .level_e = {2.5, 2.5, 2.5, 2.5}},
                             one);
        });
      }
      const merge::DrizzleImage image = in_mode(m, [&] { return drizzle.finish(one); });
      for (std::size_t c = 0; c < 3; ++c) {
        for (int y = 0; y < rows; ++y) {
          for (int x = 0; x < columns; ++x) {
            const auto k =
                static_cast<std::size_t>(y) * static_cast<std::size_t>(columns) + static_cast<std::size_t>(x);
            if (expected.weight[c][k] < 0.01) continue;  // a corner of a drop: its place is rounded to 1e-6 px
            const double mean = expected.value[c][k] / expected.weight[c][k];
            keep_worst(worst, std::fabs(image.value_e(static_cast<int>(c)).at(x, y) - mean) / 100);
          }
        }
      }
    }
    return worst;
  });
}

}  // namespace
}  // namespace lowlux::hard_cases
