#include "calib/picture/picture_noise.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <functional>
#include <random>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "calib/picture/flat_samples.h"
#include "calib/picture/noise_samples.h"
#include "capture/file/dng_source.h"
#include "tests/support/frames.h"

namespace lowlux::calib::picture_noise_test {
namespace {

Result<PictureNoise> fit(const RawDn& raw, double black_dn, const PictureNoiseOptions& options = {}) {
  PoolExecutor executor(2);
  return fit_picture_noise(raw, {black_dn, black_dn, black_dn, black_dn}, options, executor);
}

RawTraces traces_of(const RawDn& raw) {
  PoolExecutor executor(2);
  return code_traces(raw, executor);
}

/// Sixteen steps of light in both directions (not in step with blocks of 8) with normal noise of a line, filtered by
/// `filter` before it is added.
RawDn stairs(int side, double gain, double offset_dn2, double black_dn,
             const std::function<double(const std::function<double()>&)>& noise_of) {
  std::mt19937 engine(5);
  std::normal_distribution<double> normal;
  const std::function<double()> draw = [&] { return normal(engine); };
  return test::bayer_frame(side, side, BayerPhase::rggb, [&](int x, int y) {
    const double mean = 20.0 * ((x / 70 + y / 70) % 16);
    const double v = black_dn + mean + std::sqrt(gain * mean + offset_dn2) * noise_of(draw);
    return std::clamp(static_cast<int>(std::lround(v)), 0, 4095);
  });
}

double white_noise(const std::function<double()>& draw) { return draw(); }

TEST(PictureNoiseOfStairs, IsTheLineTheyWereMadeWith) {
  const RawDn raw = stairs(1024, 0.8, 6, 100, white_noise);
  for (const PictureNoiseMethod method : {PictureNoiseMethod::ponomarenko, PictureNoiseMethod::foi}) {
    const auto found = fit(raw, 100, {.method = method});
    ASSERT_TRUE(found) << found.error().message;
    const double offset = 6 + 1.0 / 12;
    // Five standard errors and 1 % for what the choice of flat samples leaves (chosen shares are not corrected).
    EXPECT_NEAR(found->gain_dn_per_e.value, 0.8, 5 * found->gain_dn_per_e.standard_error + 0.008);
    EXPECT_NEAR(found->offset_dn2.value, offset, 5 * found->offset_dn2.standard_error + 0.01 * offset);
    EXPECT_LT(found->gain_dn_per_e.standard_error, 0.02 * 0.8);
    EXPECT_LT(found->reduced_chi_square, 2);
    EXPECT_TRUE(found->reasons.empty()) << found->reasons.front();
    EXPECT_TRUE(found->converged);
  }
}

TEST(PictureNoiseOfStairs, DoesNotDependOnTheNumberOfThreads) {
  const RawDn raw = stairs(512, 0.8, 6, 100, white_noise);
  InlineExecutor one;
  const auto a = fit(raw, 100), b = fit_picture_noise(raw, {100, 100, 100, 100}, {}, one);
  ASSERT_TRUE(a && b);
  EXPECT_EQ(a->gain_dn_per_e, b->gain_dn_per_e);
  EXPECT_EQ(a->offset_dn2, b->offset_dn2);
}

TEST(PictureNoiseOfStairs, IsFoundFromAPartOfTheSamples) {
  const auto found = fit(stairs(1024, 0.8, 6, 100, white_noise), 100, {.max_samples = 4000});
  ASSERT_TRUE(found) << found.error().message;
  EXPECT_NEAR(found->gain_dn_per_e.value, 0.8, 5 * found->gain_dn_per_e.standard_error + 0.008);
}

void expect_refused(const Result<PictureNoise>& found, ErrorCode code, const std::string& words) {
  ASSERT_FALSE(found);
  EXPECT_EQ(found.error().code, code);
  EXPECT_NE(found.error().message.find(words), std::string::npos) << found.error().message;
}

TEST(PictureNoise, RefusesWhatIsTooSmall) {
  const auto constant = [](int, int) { return 100; };
  for (const int side : {0, 1, 2, 30, 60}) {
    expect_refused(fit(test::bayer_frame(side, side, BayerPhase::rggb, constant), 0), ErrorCode::insufficient,
                   "larger image");
  }
}

TEST(PictureNoise, RefusesPicturesOfOneCode) {
  for (const int code : {0, 100, 4095, 65535}) {
    expect_refused(fit(test::bayer_frame(512, 512, BayerPhase::rggb, [&](int, int) { return code; }), 0),
                   ErrorCode::insufficient, "clipped");
  }
}

TEST(PictureNoise, RefusesOneLevel) {
  test::NormalDn noise(3);
  const RawDn raw = test::bayer_frame(512, 512, BayerPhase::rggb, [&](int, int) { return noise(500, 5); });
  expect_refused(fit(raw, 100), ErrorCode::insufficient, "too similar in brightness");
}

TEST(PictureNoise, RefusesAVarianceBelowZeroWithoutLight) {  // as a black level 40 DN too low makes it: 6 - 0.8 * 40
  expect_refused(fit(stairs(1024, 0.8, 6, 100, white_noise), 60), ErrorCode::insufficient, "is negative");
}

TEST(PictureNoise, RefusesTextureWithoutFlatParts) {
  std::mt19937 engine(1);
  std::uniform_int_distribution<int> block(100, 3000);
  std::vector<int> of(300 * 300);
  for (int& v : of) v = block(engine);
  const RawDn raw =  // patches of 6 x 6 pixels: no block of 16 x 16 is flat
      test::bayer_frame(512, 512, BayerPhase::rggb, [&](int x, int y) { return of[y / 6 * 300 + x / 6]; });
  EXPECT_FALSE(fit(raw, 50));
}

TEST(PictureNoise, RefusesArgumentsOutOfRange) {
  const RawDn raw = stairs(512, 0.8, 6, 100, white_noise);
  expect_refused(fit(raw, 5000), ErrorCode::invalid_argument, "black");
  expect_refused(fit(raw, -1), ErrorCode::invalid_argument, "black");
  expect_refused(fit(raw, NAN), ErrorCode::invalid_argument, "black");
  expect_refused(fit(raw, 100, {.max_samples = 0}), ErrorCode::invalid_argument, "most_samples");
  expect_refused(fit(raw, 100, {.max_samples = 10'000'001}), ErrorCode::invalid_argument, "most_samples");
  RawDn rgb = stairs(512, 0.8, 6, 100, white_noise);
  rgb.layout = SensorLayout::linear_rgb;
  expect_refused(fit(rgb, 100), ErrorCode::unsupported, "demosaicing");
}

TEST(PictureNoise, TellsFilteredNoise) {
  RawDn raw = stairs(1024, 0.8, 20, 100, white_noise);
  RawDn smooth = stairs(1024, 0.8, 20, 100, white_noise);
  for (int y = 2; y < 1022; ++y) {  // the mean of each pixel and its neighbours of the same site
    for (int x = 2; x < 1022; ++x) {
      const int sum =
          4 * raw.dn.at(x, y) + raw.dn.at(x - 2, y) + raw.dn.at(x + 2, y) + raw.dn.at(x, y - 2) + raw.dn.at(x, y + 2);
      smooth.dn.at(x, y) = static_cast<std::uint16_t>((sum + 4) / 8);
    }
  }
  PoolExecutor executor(2);
  for (const bool filtered : {false, true}) {
    NoiseSamples blocks = block_samples(filtered ? smooth : raw, {{100, 100, 100, 100}, 400'000}, executor);
    sort_by_surroundings(blocks);
    RawTraces traces;
    add_filter_trace(blocks, traces);
    EXPECT_EQ(traces.denoised, filtered) << traces.fine_to_coarse;
  }
}

TEST(CodeTraces, DetectTheStepOfTheCodes) {
  const RawDn raw = stairs(1024, 0.8, 6, 100, white_noise);
  EXPECT_EQ(traces_of(raw).code_step_dn, 1);
  RawDn coarse = stairs(1024, 0.8, 6, 100, white_noise);
  for (std::size_t i = 0; i < coarse.dn.size(); ++i) coarse.dn.data()[i] &= 0xfffc;
  const RawTraces traces = traces_of(coarse);
  EXPECT_EQ(traces.code_step_dn, 4);
  EXPECT_FALSE(traces.companded);
}

TEST(CodeTraces, DetectIncreasingSteps) {
  RawDn raw = stairs(1024, 0.8, 6, 100, white_noise);
  EXPECT_FALSE(traces_of(raw).companded);
  for (std::size_t i = 0; i < raw.dn.size(); ++i) {
    std::uint16_t& code = raw.dn.data()[i];
    if (code >= 256) code &= 0xfffc;
  }
  const RawTraces traces = traces_of(raw);
  EXPECT_TRUE(traces.companded);
  EXPECT_EQ(traces.code_step_dn, 1);
  EXPECT_EQ(traces.largest_step_dn, 4);
}

/// Flat areas of 16 levels further apart the brighter they are, as of a chart, with noise of variance `mean` DN^2:
/// codes between the levels are not in use.
RawDn separate_levels(int side) {
  std::mt19937 engine(5);
  std::normal_distribution<double> normal;
  return test::bayer_frame(side, side, BayerPhase::rggb, [&](int x, int y) {
    const int level = (x / 70 + y / 70) % 16;
    const double mean = 20.0 + 30 * level * level;
    return 100 + static_cast<int>(std::lround(mean + std::sqrt(mean) * normal(engine)));
  });
}

TEST(CodeTraces, UnusedCodesBetweenLevelsAreNoSteps) {
  RawDn raw = separate_levels(1024);
  const RawTraces fine = traces_of(raw);
  EXPECT_FALSE(fine.companded);
  EXPECT_EQ(fine.code_step_dn, 1);
  EXPECT_EQ(fine.largest_step_dn, 1);
  for (std::size_t i = 0; i < raw.dn.size(); ++i) {
    std::uint16_t& code = raw.dn.data()[i];
    if (code >= 2000) code &= 0xfff8;
  }
  const RawTraces coarse = traces_of(raw);
  EXPECT_TRUE(coarse.companded);
  EXPECT_EQ(coarse.code_step_dn, 1);
  EXPECT_EQ(coarse.largest_step_dn, 8);
}

/// Returns grid_excess by its definition, pixel by pixel.
double plain_grid_excess(const RawDn& raw) {
  double out = 0;
  for (const bool across_columns : {true, false}) {
    std::vector<double> sum(8), n(8);
    const int dx = across_columns ? 2 : 0, dy = 2 - dx;
    for (int y = 2 * dy; y < raw.active.height - dy; ++y) {
      for (int x = 2 * dx; x < raw.active.width - dx; ++x) {
        const auto at = [&](int i) -> int { return raw.dn.at(raw.active.x + x + i * dx, raw.active.y + y + i * dy); };
        const int phase = (across_columns ? x : y) / 2 % 8;
        sum[phase] += std::abs(at(-2) - 3 * at(-1) + 3 * at(0) - at(1));
        n[phase] += 1;
      }
    }
    for (int p = 0; p < 8; ++p) sum[p] /= std::max(n[p], 1.0);
    std::sort(sum.begin(), sum.end());
    if (sum[2] > 0 && sum[7] - sum[2] > 3 * (sum[4] - sum[0])) out = std::max(out, sum[7] / sum[2] - 1);
  }
  return out;
}

TEST(CodeTraces, GridExcessIsThatOfItsDefinitionAtEverySize) {
  std::mt19937 engine(1);
  std::uniform_real_distribution<double> log_side(std::log(1.0), std::log(300.0));
  int with_excess = 0;
  for (int i = 0; i < 200; ++i) {
    const int width = static_cast<int>(std::exp(log_side(engine))),
              height = static_cast<int>(std::exp(log_side(engine)));
    RawDn raw = test::bayer_frame(width + 3, height + 2, BayerPhase::rggb, [&](int x, int y) {
      return static_cast<int>(engine() % (i % 2 == 0 ? 65536 : 16)) / 2 + 9000 * ((x / 16 + y / 16) % 2);
    });
    raw.active = {3, 2, width, height};
    const double expected = plain_grid_excess(raw);
    EXPECT_EQ(traces_of(raw).grid_excess, expected) << width << " x " << height;
    with_excess += expected > 0 ? 1 : 0;
  }
  EXPECT_GT(with_excess, 20);
}

TEST(CodeTraces, DetectTheGridOfBlocks) {
  RawDn raw = stairs(1024, 0.8, 6, 100, white_noise);
  EXPECT_FALSE(traces_of(raw).block_grid);
  test::NormalDn level(9);
  std::vector<int> of(128 * 128);
  for (int& v : of) v = level(60, 15);
  for (int y = 0; y < 1024; ++y) {
    for (int x = 0; x < 1024; ++x) {  // each block of 16 x 16 pixels has a level of its own
      raw.dn.at(x, y) = static_cast<std::uint16_t>(raw.dn.at(x, y) + of[y / 16 * 128 + x / 16]);
    }
  }
  const RawTraces traces = traces_of(raw);
  EXPECT_TRUE(traces.block_grid) << traces.grid_excess;
}

TEST(PictureNoise, TellsThatCodesAreTooCoarseForTheNoise) {
  const auto fine = fit(stairs(1024, 0.05, 0.6, 100, white_noise), 100);
  ASSERT_TRUE(fine) << fine.error().message;
  EXPECT_FALSE(fine->under_dithered) << fine->darkest_noise_steps;
  const auto coarse = fit(stairs(1024, 0.05, 0.08, 100, white_noise), 100);
  ASSERT_TRUE(coarse) << coarse.error().message;
  EXPECT_TRUE(coarse->under_dithered) << coarse->darkest_noise_steps;
  EXPECT_NE(coarse->reasons.front().find("rounding hides part of it"), std::string::npos);
}

TEST(CompareWith, PutsTheProfileInOurUnits) {
  PictureNoise noise;
  noise.gain_dn_per_e = {0.5, 0.01};
  noise.offset_dn2 = {4, 0.1};
  const double range = 4000;
  const NoiseProfile same{{0.5 / range, 0.5 / range, 1.0 / range},
                          {4 / (range * range), 6 / (range * range), 4 / (range * range)}};
  const auto found = compare_with(same, noise, range);
  EXPECT_NEAR(found[0].gain_ratio, 1, 1e-12);
  EXPECT_NEAR(found[0].offset_ratio, 1, 1e-12);
  EXPECT_NEAR(found[0].chi_square, 0, 1e-12);
  EXPECT_TRUE(found[0].agrees);
  EXPECT_NEAR(found[1].chi_square, 400, 1e-6);  // 2 DN^2 at 0.1
  EXPECT_FALSE(found[1].agrees);
  EXPECT_NEAR(found[2].gain_ratio, 0.5, 1e-12);
  EXPECT_FALSE(found[2].agrees);
  EXPECT_EQ(compare_with({}, noise, range)[0].gain_ratio, 0);
  EXPECT_FALSE(compare_with({}, noise, range)[0].agrees);
}

TEST(CodeTracesOfRealRaws, FindTheStepOfFourInTheOpenIspRaw) {
  const auto frame = capture::read_raw(LOWLUX_TESTDATA "/raws/openisp_test_rggb10.dng");
  ASSERT_TRUE(frame) << frame.error().message;
  EXPECT_EQ(traces_of(frame->raw).code_step_dn, 4);
}

}  // namespace
}  // namespace lowlux::calib::picture_noise_test
