#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include "denoise/check/noise_check.h"
#include "denoise/lines/line_noise.h"
#include "isp/base/executor.h"
#include "tests/hard_cases/mosaics.h"
#include "tests/support/executors.h"
#include "tests/support/numbers.h"

// Section 9 of the denoising specification, number by number.
namespace lowlux::hard_cases {
namespace {

using test::inf;
using test::one_thread;

using denoise_testing::Camera;
using denoise_testing::flat;

constexpr std::string_view denoise_group = "Noise reduction";

// No cell weighs more than twice in the mean, so that it changes by one standard error at most, one standard deviation
// of it: see denoiser_properties_test.cpp. Three times that.
constexpr Bound mean_bound{3, any_draw};
constexpr MosaicBounds mean_bounds{mean_bound, mean_bound, mean_bound, mean_bound};
constexpr std::string_view mean_oracle =
    "closed form: the mean stays; three standard errors, borders being counted twice";

Camera with_dark(double dark_e, double read_noise_e) {
  return {.dark_e = {dark_e, dark_e, dark_e, dark_e}, .read_noise_e = read_noise_e};
}

TEST(HardCaseDenoise1, LightFarBelowTheDarkChargeIsNotRectified) {
  HardCase row({denoise_group, "9.1 less than 1 e- over 200 e- of dark", mean_oracle, "standard errors of the mean"});
  const MosaicCase c = case_of(with_dark(200, 4), flat(0.3, 0.3, 0.3), 256, 192, 61);
  measure(row, c, mean_bounds, change_of_means(c));
}

TEST(HardCaseDenoise2, AColourWhoseGainIsAboveThreeHasAThresholdOfItsOwn) {
  HardCase row({denoise_group, "9.2 white balance of blue 4.5",
                "closed form: noise of a flat falls tenfold in every colour",
                "residual over raw noise of the worst colour"});
  Camera camera = with_dark(2, 1.5);
  camera.white_gain = {1.6, 1, 4.5};
  const MosaicCase c = case_of(camera, flat(20 / 1.6, 20, 20 / 4.5), 256, 192, 62);
  measure(row, c, {0.1, 0.1, 0.1, 0.1}, [&](PlaneView<const double> out) {
    const auto mean = denoise_testing::colour_means(out, c.phase);
    std::array<double, 3> square{}, sites{};
    for (int y = 0; y < out.height; ++y) {
      for (int x = 0; x < out.width; ++x) {
        const auto k = static_cast<std::size_t>(colour_at(c.phase, x, y));
        square[k] += std::pow(out.at(x, y) - mean[k], 2);
        sites[k] += 1;
      }
    }
    double worst = 0;
    for (int k = 0; k < 3; ++k) {
      keep_worst(worst, std::sqrt(square[k] / sites[k] / (20 / camera.white_gain[k] + 2 + 1.5 * 1.5)));
    }
    return worst;
  });
}

TEST(HardCaseDenoise3, AnOversubtractedPedestalMovesTheMeanAndNothingElse) {
  MosaicCase c = case_of(with_dark(2, 1.5), flat(1, 1, 1), 256, 192, 63);
  c.options.rho = inf;
  for (std::size_t i = 0; i < c.raw_e.size(); ++i) c.raw_e.data()[i] -= 60;
  {
    HardCase row(
        {denoise_group, "9.3 local means below 0: 60 e- too much black", mean_oracle, "standard errors of the mean"});
    // Without light the prior of streams makes colours neutral: each gets the mean of all, five standard errors more.
    measure(row, c, {mean_bound, mean_bound, mean_bound, mean_bound.value + 5}, change_of_means(c));
  }
  HardCase said({denoise_group, "9.3 the same is reported", "what was built in", "remarks that are missing"});
  said.on(Path::reference, 0, [&](Denormals m) {
    const auto check = in_mode(m, [&] { return denoise::check_noise({c.raw_e.view(), c.phase}, c.noise, one_thread); });
    const auto remarks = denoise::remarks_on(check);
    return !remarks.empty() && remarks[0].finding == denoise::NoiseFinding::black_suspicious ? 0.0 : 1.0;
  });
  said.none(levels, "checked before").none(instruction_sets, scalar_code);
  said.on(Path::file, 0, [&](Denormals m) { return warns_of(c, m, "black") ? 0.0 : 1.0; });
  said.none(Path::live, "streams are not checked against their model");
}

TEST(HardCaseDenoise4, ALightNextToTheDarkLeavesItAsAFlat) {
  HardCase row({denoise_group, "9.4 variances 1 : 540 within a block",
                "truth of the scene; bound: 0.15 of the noise of the dark side, what a flat keeps",
                "rms error of the dark side over the noise of the light"});
  const auto edge = [](int x, int) {
    const double e = x < 128 ? 5 : 3500;
    return std::array{e, e, e};
  };
  const MosaicCase c = case_of(with_dark(2, 1.5), edge, 256, 192, 64);
  const double kept = 0.15 * std::sqrt((5 + 2 + 1.5 * 1.5) / 3502);
  measure(row, c, {kept, kept, kept, kept}, [](PlaneView<const double> out) {
    double square = 0;
    for (int y = 0; y < 192; ++y) {
      for (int x = 96; x < 128; ++x) square += std::pow(out.at(x, y) - 5, 2) / (192 * 32);
    }
    return std::sqrt(square / 3502);
  });
}

// Of coefficients of noise, 6.3e-5 lie beyond four standard deviations: they leave 0.034 of it.
TEST(HardCaseDenoise5, GreensShareTheirParameters) {
  HardCase row({denoise_group, "9.5 flat greens show no maze",
                "closed form: noise of G1 - G2 beyond four deviations, 0.034; half more, borders being counted twice",
                "residual over raw noise of G1 - G2"});
  const MosaicCase c = case_of(with_dark(20, 1.5), flat(20, 20, 20), 256, 192, 65);
  measure(row, c, {0.05, 0.05, 0.05, 0.05}, [](PlaneView<const double> out) {
    double square = 0;
    for (int y = 0; y < 192; y += 2) {
      for (int x = 0; x < 256; x += 2) square += std::pow(out.at(x + 1, y) - out.at(x, y + 1), 2) / (128 * 96);
    }
    return std::sqrt(square / (2 * 42.25));
  });
}

TEST(HardCaseDenoise5, SaturatedFramesAreNeutral) {
  HardCase row({denoise_group, "9.5 every site saturated",
                "closed form: the largest value of a cell, balanced, in all sites", "relative"});
  MosaicCase c{.raw_e = Plane<float>(150, 97)};
  std::fill_n(c.raw_e.data(), c.raw_e.size(), 1000.0f);
  c.noise = {.variance_e2 = {4, 4, 4}, .saturation_e = {1000, 1000, 1000}};
  c.options.white_gain = {2, 1, 1.5};
  // A live code is 1/16 e-, and rounded.
  measure(row, c, {double_sums, float_sums, float_sums, 1.5 / 32 / 1000}, [&](PlaneView<const double> out) {
    double worst = 0;
    for (int y = 0; y < out.height; ++y) {
      for (int x = 0; x < out.width; ++x) {
        const double gain = c.options.white_gain[static_cast<std::size_t>(colour_at(c.phase, x, y))];
        keep_worst(worst, std::abs(out.at(x, y) * gain / 2000 - 1));
      }
    }
    return worst;
  });
}

TEST(HardCaseDenoise6, AStarOfOneCellKeepsItsFlux) {
  HardCase row({denoise_group, "9.6 a star of one cell, 12 times its noise",
                "what was measured; five standard errors of the background, mean of 48 sites", "relative flux"});
  MosaicCase c = case_of(with_dark(2, 1.5), flat(20, 20, 20), 128, 96, 66);
  for (const auto& [x, y] : {std::pair{60, 40}, {61, 40}, {60, 41}, {61, 41}}) c.raw_e.at(x, y) += 60;
  row.none(Path::reference, "the plain double has no search for stars");
  // Four sites of some 80 e-, each of which keeps what it has above its background, and that is replaced.
  const double bound = 5 * std::sqrt(4 * 24.25 / 48) / (4 * 80);
  measure(row, c, {-1, bound, bound, bound}, [&](PlaneView<const double> out) {
    double kept = 0, measured = 0;
    for (const auto& [x, y] : {std::pair{60, 40}, {61, 40}, {60, 41}, {61, 41}}) {
      kept += out.at(x, y);
      measured += static_cast<double>(c.raw_e.at(x, y)) - 2;
    }
    return std::abs(kept / measured - 1);
  });
}

TEST(HardCaseDenoise7, OddSizesAndBordersAreThoseOfTheReference) {
  HardCase row({denoise_group, "9.7 borders of 37 x 29, 2 x 2, 3 x 5, every phase",
                "plain double; 600 float operations add up to 1.5e-6 of the largest value",
                "relative to the largest value"});
  std::vector<MosaicCase> cases;
  cases.reserve(4);
  for (const auto& [width, height, phase] : {std::tuple{37, 29, BayerPhase::rggb},
                                             {2, 2, BayerPhase::grbg},
                                             {3, 5, BayerPhase::gbrg},
                                             {131, 37, BayerPhase::bggr}}) {
    Camera camera = with_dark(10, 1.5);
    camera.phase = phase;
    camera.white_gain = {1.9, 1, 1.4};
    cases.push_back(case_of(camera, denoise_testing::waves(20), width, height, 68));
    cases.back().options.keep_point_sources = false;
  }
  const auto against = [&](denoise::Level level) {
    return [&, level](Denormals m) {
      double worst = 0;
      for (const MosaicCase& c : cases) {
        const double scale = *std::max_element(c.raw_e.data(), c.raw_e.data() + c.raw_e.size()) * 1.9;
        const Plane<double> expected = by_reference(c, level, Denormals::kept);
        keep_worst(worst, largest_difference(by_denoiser(c, level, m), expected) / scale);
      }
      return worst;
    };
  };
  for (std::size_t i = 0; i < levels.size(); ++i) row.on(levels[i], float_sums, against(denoise::all_levels[i]));
  row.on_each_set(float_sums, against(denoise::Level::high));
  const auto evens = [&](const PathRun& run) {
    double worst = 0;
    for (const auto& [width, height] : {std::pair{37, 29}, {2, 2}, {3, 5}}) {
      MosaicCase c = case_of(with_dark(0, 0), flat(0, 0, 0), width, height, 1);
      std::fill_n(c.raw_e.data(), c.raw_e.size(), 100.0f);
      keep_worst(worst, distance_from(100)(run(c).view()) / 100);
    }
    return worst;
  };
  measure(row, {double_sums, -1, float_sums, 0}, evens);  // constants come back; 100 e- is a code of streams
}

TEST(HardCaseDenoise8, CodesOf35ElectronsKeepTheirMean) {
  HardCase row(
      {denoise_group, "9.8 codes of 35 e-, not dithered",
       "closed form: the mean stays; three standard errors, borders being counted twice, and half a code of 8.8 "
       "e- (live), 47 of them",
       "standard errors of the mean"});
  MosaicCase c = case_of(with_dark(0, 4), flat(100, 100, 100), 256, 192, 68);
  c.gain_dn_per_e = 0.028334;
  for (std::size_t i = 0; i < c.raw_e.size(); ++i) {
    float& e = c.raw_e.data()[i];
    e = static_cast<float>(std::round(static_cast<double>(e) * c.gain_dn_per_e) / c.gain_dn_per_e);
  }
  c.noise.variance_e2.fill(16 + 1 / (12 * c.gain_dn_per_e * c.gain_dn_per_e));
  // A live code is a quarter of the file's; what is flat is rounded one way.
  const double live = 0.125 / c.gain_dn_per_e / std::sqrt(220 / (256 * 192 / 2.0)) + mean_bound.value;
  measure(row, c, {mean_bound, mean_bound, mean_bound, live}, change_of_means(c));
}

// The mean of 2 x 2 sites of one colour: (1 - z1)(1 - z2) / 2 times (1 + z1)(1 + z2) / 4 leaves 1/16 of the variance.
// Details two cells apart go with each other by -1/2 each way, which makes the error of their mean square 3/2 of white
// noise's, sqrt(2 / 48) for each block. They go with those by which the blocks are chosen, too: a twentieth less is
// left.
TEST(HardCaseDenoise8, WhatWasDenoisedBeforeIsFound) {
  HardCase row({denoise_group, "9.8 denoised before: means of 2 x 2",
                "closed form: 1/16 of the diagonal variance; five standard errors, and how blocks are chosen",
                "relative"});
  const MosaicCase white = case_of(with_dark(0, 20), flat(0, 0, 0), 512, 384, 69);
  MosaicCase c = case_of(with_dark(0, 20), flat(0, 0, 0), 510, 382, 69);
  for (int y = 0; y < 382; ++y) {
    for (int x = 0; x < 510; ++x) {
      const auto& n = white.raw_e;
      c.raw_e.at(x, y) = (n.at(x, y) + n.at(x + 2, y) + n.at(x, y + 2) + n.at(x + 2, y + 2)) / 4;
    }
  }
  const double error = 1.5 * std::sqrt(2 / (48 * std::floor(0.1 * 31 * 23)));
  row.on(Path::reference, 0.05 + 5 * error, [&](Denormals m) {
    const auto check = in_mode(m, [&] { return denoise::check_noise({c.raw_e.view(), c.phase}, c.noise, one_thread); });
    return std::abs(check.measured_over_model[0].value_or(inf) * 16 - 1);
  });
  row.none(levels, "checked before").none(instruction_sets, scalar_code);
  row.on(Path::file, 0, [&](Denormals m) { return warns_of(c, m, "noise") ? 0.0 : 1.0; });
  row.none(Path::live, "streams are not checked against their model");
}

double rms_of_rows(PlaneView<const double> out) {
  double mean = 0, square = 0;
  for (int y = 0; y < out.height; ++y) {
    double sum = 0;
    for (int x = 0; x < out.width; ++x) sum += out.at(x, y);
    mean += sum / out.width / out.height;
    square += std::pow(sum / out.width, 2) / out.height;
  }
  return std::sqrt(square - mean * mean);
}

TEST(HardCaseDenoise9, RowNoiseOfOneElectronIsTakenOffBefore) {
  HardCase row({denoise_group, "9.9 1 e- of row noise",
                "its own prediction, and the noise of a row's mean; five standard errors above", "e- rms of rows"});
  MosaicCase c = case_of(with_dark(2, 1.5), flat(20, 20, 20), 256, 256, 70);
  std::vector<float> offset(256);
  normal_row({.seed = 71, .purpose = draw_purpose::row_noise}, 0, 0, 0, offset);
  for (int y = 0; y < 256; ++y) {
    for (int x = 0; x < 256; ++x) c.raw_e.at(x, y) += offset[y];
  }
  const auto found = denoise::line_offsets_of_frame(std::as_const(c.raw_e).view(), denoise::Lines::rows);
  ASSERT_TRUE(found) << found.error().message;
  MosaicCase without = c.with_values(c.raw_e.clone());
  denoise::subtract_lines(*found, without.raw_e.view());
  // An rms of 256 rows is good to 1 / sqrt(512).
  const double bound = (1 + 5 / std::sqrt(512)) * std::hypot(found->residual_std_e, std::sqrt(24.25 / 256));
  measure(row, without, {bound, bound, -1, -1}, rms_of_rows);
  measure(row, c, {-1, -1, bound, -1}, rms_of_rows);
  row.none(Path::live, "lines of streams stay (live_pipeline.h)");
}

}  // namespace
}  // namespace lowlux::hard_cases
