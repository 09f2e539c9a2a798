// Clean raws of frames that are no mosaics.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <numeric>
#include <random>
#include <span>
#include <string>
#include <utility>

#include "isp/pipeline/finished/clean_raw.h"
#include "isp/pipeline/finished/residual_profile.h"
#include "isp/pipeline/render/pixel_noise_reducer.h"
#include "tests/denoise/frames.h"
#include "tests/pipeline/pixel_frames.h"
#include "tests/support/as_floats.h"
#include "tests/support/executors.h"

namespace lowlux::isp {
namespace {

using denoise::Level;
using denoise_testing::flat;
using pixel_testing::at;
using pixel_testing::developed;
using pixel_testing::full_e;
using pixel_testing::layouts;
using pixel_testing::lines;
using pixel_testing::options_of;
using pixel_testing::pixel_frame;
using pixel_testing::read_e;
using test::one_thread;
using test::two_threads;

RawFrame cleaned(const RawFrame& frame, Level level, Executor& executor = one_thread) {
  Result<CleanRaw> out = clean_raw(frame, options_of(at(level)), executor);
  EXPECT_TRUE(out) << out.error().message;
  return std::move(out->frame);
}

/// Mean and variance of the samples of a colour [e-] that are `border` pixels or more from the border.
std::pair<double, double> moments(const RawFrame& frame, int colour, int border) {
  const RawDn& raw = frame.raw;
  const int samples = planes_of(raw);
  const double black = raw.black_tag->pattern_dn[0], e_per_dn = full_e / (raw.white_dn[0] - black);
  double sum = 0, squares = 0;
  int count = 0;
  for (int y = border; y < raw.active.height - border; ++y) {
    for (int x = border; x < raw.active.width - border; ++x, ++count) {
      const double dn = with_samples(
          raw, [&](const auto& values) { return static_cast<double>(values.at(samples * x + colour, y)); });
      sum += e_per_dn * (dn - black);
      squares += std::pow(e_per_dn * (dn - black), 2);
    }
  }
  return {sum / count, squares / count - sum / count * sum / count};
}

// Two ways to one image, for drawn sizes, light and levels: a clean raw that is developed without noise reduction, or
// noise reduction while developing. They differ by the rounding of codes, up to one either way. Saturated pixels, from
// 0.99 of white on, are white exactly in a clean raw; in an image noise reduction may take them down by their noise.
TEST(CleanPixels, AreWhatDevelopDoes) {
  const auto seed = static_cast<std::uint32_t>(std::random_device{}());
  std::mt19937 draw(seed);
  std::uniform_real_distribution<double> log_size(0, std::log(300)), log_light(std::log(1), std::log(9000));
  const double min_saturated = 0.99 - 5 / std::sqrt(pixel_testing::full_e);
  for (int i = 0; i < 12; ++i) {
    const int width = i == 0 ? 1 : static_cast<int>(std::exp(log_size(draw)));
    const int height = i <= 1 ? 1 : static_cast<int>(std::exp(log_size(draw)));
    const double mean_e = std::exp(log_light(draw));
    const Level level = denoise::all_levels[static_cast<std::size_t>(i) % 4];
    for (const SensorLayout layout : layouts) {
      SCOPED_TRACE("seed " + std::to_string(seed) + ", " + std::to_string(width) + " x " + std::to_string(height) +
                   ", " + std::to_string(mean_e) + " e-, layout " + std::to_string(static_cast<int>(layout)));
      RawFrame frame = pixel_frame(layout, lines(mean_e), width, height, seed);
      if (i % 3 == 2) test::make_floats(frame.raw);
      const RawFrame clean = cleaned(frame, level), other = cleaned(frame, level, two_threads);
      ASSERT_EQ(clean.raw.layout, layout);
      ASSERT_EQ(clean.raw.is_float(), frame.raw.is_float());
      ASSERT_EQ(clean.raw.active, frame.raw.active);
      const double code = clean.raw.is_float() ? 0 : 1 / (clean.raw.white_dn[0] - clean.raw.black_tag->pattern_dn[0]);
      if (layout == SensorLayout::linear_rgb && !clean.raw.is_float()) {  // as small as negative samples allow
        const double black = clean.raw.black_tag->pattern_dn[0];
        const std::uint16_t least = *std::min_element(clean.raw.dn.data(), clean.raw.dn.data() + clean.raw.dn.size());
        EXPECT_TRUE(black == 16 || (black > 16 && least <= 17)) << black << ", least code " << least;
      }
      const auto one = std::get<SceneLinear>(developed(clean, {}).picture);
      const auto two = std::get<SceneLinear>(developed(frame, at(level)).picture);
      for (std::size_t c = 0; c < 3; ++c) {
        for (std::size_t k = 0; k < one.plane[c].size(); ++k) {
          const auto from_clean = static_cast<double>(one.plane[c].data()[k]);
          const auto at_once = static_cast<double>(two.plane[c].data()[k]);
          ASSERT_TRUE(std::isfinite(from_clean));
          if (from_clean >= 1) {
            ASSERT_GE(at_once, min_saturated);
          } else {
            ASSERT_NEAR(from_clean, at_once, 1.01 * code + 1e-6 * (1 + std::fabs(at_once)));
          }
        }
      }
      const bool same = with_samples(clean.raw, [&](const auto& a) {
        return with_samples(other.raw, [&](const auto& b) {
          for (int y = 0; y < a.height; ++y) {
            if (!std::equal(a.row(y), a.row(y) + a.width, b.row(y))) return false;
          }
          return true;
        });
      });
      EXPECT_TRUE(same) << "two threads";
    }
  }
}

// The mean of four flats of 256 x 256 pixels has a standard error of 0.05 % at 20 e-. The profile's line is the
// variance of a flat, as for mosaics (TheNoiseProfileIsThatOfTheCleanCodes, whose limits these are).
TEST(CleanPixels, FlatsKeepTheirMeanAndStateTheirNoise) {
  const auto check = [](SensorLayout layout, const std::array<double, 3>& mean_e, Level level) {
    std::array<double, 3> mean{}, measured{}, stated{};
    for (std::uint64_t seed = 1; seed <= 4; ++seed) {
      const RawFrame clean =
          cleaned(pixel_frame(layout, flat(mean_e[0], mean_e[1], mean_e[2]), 272, 272, 30 + seed), level);
      for (int c = 0; c < planes_of(clean.raw); ++c) {
        const auto [mean_of_one, variance] = moments(clean, c, 8);
        mean[c] += mean_of_one / 4;
        measured[c] += variance;
        stated[c] += (clean.noise->scale[c] * mean_e[c] / full_e + clean.noise->offset[c]) * full_e * full_e;
      }
    }
    const bool monochrome = layout == SensorLayout::monochrome;
    for (int c = 0; c < (monochrome ? 1 : 3); ++c) {
      const std::string what = std::string(denoise::name_of(level)) + (monochrome ? " monochrome " : " ") +
                               std::to_string(mean_e[0]) + ' ' + std::to_string(c);
      EXPECT_NEAR(mean[c] / mean_e[c], 1, 0.002) << what;
      const double ratio = std::sqrt(stated[c] / measured[c]);
      RecordProperty("stated over measured " + what, std::to_string(ratio));
      EXPECT_GT(ratio, monochrome ? 0.85 : 0.9) << what;
      EXPECT_LT(ratio, 1.1) << what;
    }
  };
  for (const SensorLayout layout : layouts) {
    for (const double mean_e : {20.0, 200.0, 2000.0}) check(layout, {mean_e, mean_e, mean_e}, Level::draft);
  }
  check(SensorLayout::linear_rgb, {100, 200, 50}, Level::draft);
  for (const Level level : {Level::standard, Level::high, Level::best}) {
    check(SensorLayout::linear_rgb, {200, 200, 200}, level);
  }
}

/// Variance of luma 0.2 R + 0.6 G + 0.2 B, or of the one colour, of a clean flat [e-^2], `border` pixels from its ends.
double luma_variance_e2(const RawFrame& clean, int border) {
  const RawDn& raw = clean.raw;
  const int samples = planes_of(raw);
  const double e_per_dn = full_e / (raw.white_dn[0] - raw.black_tag->pattern_dn[0]);
  double sum = 0, squares = 0;
  int count = 0;
  for (int y = border; y < raw.active.height - border; ++y) {
    for (int x = border; x < raw.active.width - border; ++x, ++count) {
      const std::uint16_t* const dn = raw.dn.row(y) + samples * x;
      const double luma = e_per_dn * (samples == 1 ? dn[0] : 0.2 * dn[0] + 0.6 * dn[1] + 0.2 * dn[2]);
      sum += luma;
      squares += luma * luma;
    }
  }
  return squares / count - sum / count * sum / count;
}

// Limits are those of the stated noise above, as the map is its origin.
TEST(CleanPixels, MapsHoldTheNoiseOfLumaOfEachPixel) {
  constexpr int side = 272, border = 8;
  for (const SensorLayout layout : layouts) {
    for (const double mean_e : {20.0, 200.0, 2000.0}) {
      SCOPED_TRACE(std::to_string(static_cast<int>(layout)) + ' ' + std::to_string(mean_e));
      double mapped = 0, measured = 0;
      for (std::uint64_t seed = 1; seed <= 4; ++seed) {
        const RawFrame frame = pixel_frame(layout, flat(mean_e, mean_e, mean_e), side, side, 60 + seed);
        DenoiseChoice choice = at(Level::draft);
        choice.maps = true;
        const Result<CleanRaw> clean = clean_raw(frame, options_of(choice), one_thread);
        ASSERT_TRUE(clean) << clean.error().message;
        const Plane<float>& map = clean->maps.residual_variance_e2;
        ASSERT_EQ(map.width(), side);
        ASSERT_EQ(map.height(), side);
        mapped += std::accumulate(map.data(), map.data() + map.size(), 0.0) / static_cast<double>(map.size());
        measured += luma_variance_e2(clean->frame, border);
      }
      EXPECT_GT(std::sqrt(mapped / measured), 0.85);
      EXPECT_LT(std::sqrt(mapped / measured), 1.15);
    }
  }
}

TEST(CleanPixels, MapsOfImagesAreThoseOfCleanRawsTimesTheSquareOfGains) {
  for (const SensorLayout layout : layouts) {
    RawFrame frame = pixel_frame(layout, lines(100), 97, 63, 3);
    DenoiseChoice choice = at(Level::high);
    EXPECT_TRUE(developed(frame, choice).noise_maps.chroma_confidence.empty());
    choice.maps = true;
    const Result<CleanRaw> clean = clean_raw(frame, options_of(choice), one_thread);
    ASSERT_TRUE(clean) << clean.error().message;
    const NoiseMaps plain = developed(frame, choice).noise_maps;
    GainMap twice{.bottom = 63, .right = 97, .planes = 3};
    twice.gain = {2};
    frame.corrections.gain_maps = {twice};
    const NoiseMaps gained = developed(frame, choice).noise_maps;
    ASSERT_EQ(plain.residual_variance_e2.size(), clean->maps.residual_variance_e2.size());
    ASSERT_EQ(plain.chroma_confidence.width(), 97);
    for (std::size_t i = 0; i < plain.residual_variance_e2.size(); ++i) {
      ASSERT_EQ(plain.residual_variance_e2.data()[i], clean->maps.residual_variance_e2.data()[i]);
      ASSERT_EQ(gained.residual_variance_e2.data()[i], 4 * plain.residual_variance_e2.data()[i]);
      ASSERT_GE(plain.chroma_confidence.data()[i], 0);
      ASSERT_LE(plain.chroma_confidence.data()[i], 1);
    }
  }
}

TEST(CleanPixels, BlackStaysSignedAndSaturationStaysWhite) {
  for (const SensorLayout layout : layouts) {
    const RawFrame black = cleaned(pixel_frame(layout, flat(0, 0, 0), 96, 64, 2), Level::standard);
    const auto [least, most] = std::minmax_element(black.raw.dn.data(), black.raw.dn.data() + black.raw.dn.size());
    EXPECT_LT(*least, black.raw.black_tag->pattern_dn[0]);
    EXPECT_GT(*least, 0);
    EXPECT_GT(*most, black.raw.black_tag->pattern_dn[0]);
    for (int c = 0; c < planes_of(black.raw); ++c) {
      EXPECT_NEAR(moments(black, c, 0).first, 0, 5 * read_e / std::sqrt(96 * 64));
    }
    RawFrame frame = pixel_frame(layout, flat(20, 20, 20), 96, 64, 1);
    std::fill_n(frame.raw.dn.data(), frame.raw.dn.size(), static_cast<std::uint16_t>(frame.raw.white_dn[0]));
    const RawFrame white = cleaned(frame, Level::high);
    EXPECT_TRUE(std::all_of(white.raw.dn.data(), white.raw.dn.data() + white.raw.dn.size(),
                            [](std::uint16_t dn) { return dn == 65535; }));
  }
}

TEST(CleanPixels, MetadataRemainAndAppliedCorrectionsAreRemoved) {
  for (const SensorLayout layout : layouts) {
    RawFrame frame = pixel_frame(layout, flat(20, 20, 20), 96, 64, 1);
    frame.raw.active = {16, 2, 80, 60};
    frame.raw.default_crop = {4, 6, 70, 50};
    frame.raw.info.make = "Maker";
    frame.raw.info.orientation = Orientation::rotate_90;
    frame.raw.from_x_trans = layout == SensorLayout::linear_rgb;
    frame.corrections.defects = {{3, 3, 1, 1}};
    frame.corrections.radial_gains = {{.k = {0.1, 0, 0, 0, 0}}};
    frame.source_tags = std::make_shared<const SourceTags>();
    const RawFrame clean = cleaned(frame, Level::draft);
    EXPECT_EQ(clean.raw.active, (Rect{0, 0, 80, 60}));
    EXPECT_EQ(clean.raw.default_crop, frame.raw.default_crop);
    EXPECT_EQ(clean.raw.info.make, "Maker");
    EXPECT_EQ(clean.raw.info.orientation, Orientation::rotate_90);
    EXPECT_FALSE(clean.raw.from_x_trans);
    EXPECT_EQ(clean.raw.black_tag->samples, planes_of(frame.raw));
    EXPECT_TRUE(clean.corrections.defects.empty());
    EXPECT_EQ(clean.corrections.radial_gains.size(), 1U);
    EXPECT_EQ(clean.source_tags, frame.source_tags);
    EXPECT_EQ(clean.colour.as_shot_neutral, frame.colour.as_shot_neutral);
    EXPECT_TRUE(clean.noise && clean.noise->reduced);
  }
}

TEST(CleanPixels, UnknownNoiseIsAnError) {
  for (const SensorLayout layout : layouts) {
    RawFrame frame = pixel_frame(layout, flat(20, 20, 20), 32, 24, 1);
    frame.noise.reset();
    DenoiseChoice automatic{.mode = DenoiseChoice::Mode::automatic, .always = true};
    for (const DenoiseChoice& choice : {at(Level::draft), automatic}) {
      const auto out = clean_raw(frame, options_of(choice), one_thread);
      ASSERT_FALSE(out);
      EXPECT_EQ(out.error().code, ErrorCode::insufficient);
      EXPECT_NE(out.error().message.find("noise is unknown"), std::string::npos);
      EXPECT_NE(out.error().message.find("--noise"), std::string::npos);
      EXPECT_EQ(out.error().message.find("--profile"), std::string::npos) << "refused for pixels of all colours";
    }
  }
}

// Maps of tiles are those of the whole frame where the tiles' pixels are (PixelNoise.TilesAgreeWithTheWhole).
TEST(CleanPixels, MapsOfTilesAgreeWithThoseOfTheWhole) {
  constexpr int width = 421, height = 389;
  NoiseReduction how;
  how.level = Level::standard;
  how.noise.variance_e2 = {4, 2, 4};
  how.cell_e = std::array<double, 3>{1, 0.5, 1};
  std::array<NoiseMaps, 2> maps;
  NoiseReducer noise(two_threads);
  for (std::size_t i = 0; i < 2; ++i) {
    std::array<Plane<float>, 3> pixels;
    for (std::size_t c = 0; c < 3; ++c) pixels[c] = denoise_testing::exposed({}, lines(50), width, height, c + 1);
    PixelNoiseReducer(two_threads, i == 0 ? TileLimits{}.side_px : 256).run(pixels, how, noise, &maps[i]);
  }
  for (std::size_t c = 0; c < 3; ++c) {
    const Plane<float>&whole = maps[0].site_variance_e2[c], &tiled = maps[1].site_variance_e2[c];
    ASSERT_EQ(whole.width(), width);
    ASSERT_EQ(whole.height(), height);
    double sum = 0, difference = 0;
    for (std::size_t i = 0; i < whole.size(); ++i) {
      sum += static_cast<double>(whole.data()[i]);
      difference += std::fabs(static_cast<double>(whole.data()[i] - tiled.data()[i]));
    }
    EXPECT_GT(sum, 0);
    EXPECT_LT(difference, 0.03 * sum);
  }
}

TEST(ResidualProfileOfPixels, FindsTheLineItIsGiven) {
  constexpr int width = 200, height = 64;
  const std::array<double, 3> cell_e{1000, 500, 800};
  for (const std::size_t count : {1U, 3U}) {
    std::array<Plane<float>, 3> planes;
    NoiseMaps maps;
    maps.residual_variance_e2 = Plane<float>(width, height);
    for (std::size_t c = 0; c < 3; ++c) {
      planes[c] = Plane<float>(width, height);
      maps.site_variance_e2[c] = Plane<float>(width, height);
      for (int y = 0; y < height; ++y) {
        for (int x = 0; x < width; ++x) {
          planes[c].at(x, y) = static_cast<float>(x - 4) / 1000;
          const double fraction = std::max(0, x - 4) / 1000.0;
          const double variance_e2 = (5e-5 * fraction + 2e-6) * cell_e[c] * cell_e[c];
          maps.site_variance_e2[c].at(x, y) = static_cast<float>(variance_e2);
          if (c == 0) maps.residual_variance_e2.at(x, y) = static_cast<float>(variance_e2);
        }
      }
    }
    const auto profile = residual_profile(std::span(std::as_const(planes)).first(count), maps, cell_e, 1e-8);
    EXPECT_TRUE(profile.reduced);
    for (int c = 0; c < 3; ++c) {
      EXPECT_NEAR(profile.scale[c], 5e-5, 1e-9) << c;
      EXPECT_NEAR(profile.offset[c], 2e-6 + 1e-8, 1e-10) << c;
    }
  }
}

}  // namespace
}  // namespace lowlux::isp
