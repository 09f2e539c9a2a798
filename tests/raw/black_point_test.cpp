#include "isp/raw/black_point.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>
#include <random>
#include <string>

#include "isp/raw/measure/masked_black.h"
#include "tests/support/frames.h"

namespace lowlux::isp {
namespace {

constexpr int border = 64;
constexpr int side = 512;
constexpr PerSite<double> true_black{511.6, 512.1, 515.3, 514.9};
constexpr double noise_dn = 12.0;

// A frame with a masked strip of 64 columns on its left, lit elsewhere; one masked pixel in 500 is hot or dead.
RawDn frame_with_masked_columns(unsigned seed) {
  test::NormalDn normal(seed);
  RawDn raw = test::bayer_frame(border + side, side, BayerPhase::rggb, [&](int x, int y) {
    if (x >= border) return normal(1500, 100);
    if ((x * 131 + y * 17) % 500 == 0) return (x & 2) != 0 ? 3900 : 3;
    return normal(true_black[site_of(x, y)], noise_dn);
  });
  raw.active = {border, 0, side, side};
  raw.masked = {{0, 0, border, side}};
  raw.masked_is_stated = true;
  raw.black_tag = BlackLevel{.pattern_dn = {520}};
  return raw;
}

TEST(MaskedBlack, FindsEverySiteWithinFiveOfItsOwnStandardErrors) {
  const MaskedBlack measured = measure_masked_black(frame_with_masked_columns(1));
  ASSERT_TRUE(measured.black) << measured.refusal;
  EXPECT_EQ(measured.region, (Rect{4, 0, 48, side}));
  for (int site = 0; site < 4; ++site) {
    const double se = measured.black->pedestal_standard_error_dn[site];
    EXPECT_NEAR(measured.black->pedestal_dn[site], true_black[site], 5 * se);
    // 24 x 256 samples of a site: the standard error of white noise, known to a fifth from 24 column means.
    EXPECT_NEAR(se, noise_dn / std::sqrt(24.0 * 256), 0.4 * noise_dn / std::sqrt(24.0 * 256));
    EXPECT_NEAR(measured.black->noise_std_dn[site], noise_dn, 0.5);
  }
}

TEST(MaskedBlack, IsUnbiasedOverManyFrames) {
  double sum = 0;
  constexpr int frames = 40;
  for (int i = 0; i < frames; ++i) {
    sum += measure_masked_black(frame_with_masked_columns(100 + i)).black->pedestal_dn[2] - true_black[2];
  }
  EXPECT_NEAR(sum / frames, 0, 5 * noise_dn / std::sqrt(24.0 * 256 * frames));  // five standard errors
}

/// Masked columns of a sensor that counts photons: Poisson dark charge over normal read noise, 20 DN/e-, pedestal 512.
RawDn frame_with_dark_charge(double dark_e, double read_noise_e, unsigned seed) {
  std::mt19937_64 engine(seed);
  std::poisson_distribution<int> charge(dark_e);
  std::normal_distribution<double> read(0, read_noise_e);
  RawDn raw = frame_with_masked_columns(seed);
  for (int y = 0; y < side; ++y) {
    for (int x = 0; x < border; ++x) {
      const int hot_e = (x * 131 + y * 17) % 500 == 0 ? 80 : 0;
      raw.dn.at(x, y) = static_cast<std::uint16_t>(std::lround(512 + 20 * (charge(engine) + read(engine) + hot_e)));
    }
  }
  return raw;
}

// Of little dark charge a symmetric cut removes the few pixels that have any: 92 % of 0.05 e- over 0.15 e- of read
// noise, 15 % of 0.2 e- over 0.25 e-. From 0.5 e- of read noise on it removes nothing.
TEST(MaskedBlack, KeepsTheFewPixelsThatHoldDarkCharge) {
  struct {
    double dark_e, read_noise_e, lost_without_gain_e;
  } const cases[] = {{0.05, 0.15, 0.046}, {0.2, 0.25, 0.030}, {0, 0.15, 0}, {1, 0.5, 0}, {10, 3, 0}};
  for (const auto& c : cases) {
    double with = 0, without = 0;
    constexpr int frames = 4;
    for (int i = 0; i < frames; ++i) {
      const RawDn raw = frame_with_dark_charge(c.dark_e, c.read_noise_e, 900 + i);
      const MaskedBlack by_gain = measure_masked_black(raw, 20), symmetric = measure_masked_black(raw);
      ASSERT_TRUE(by_gain.black && symmetric.black);
      for (int site = 0; site < 4; ++site) {
        with += (by_gain.black->pedestal_dn[site] - 512) / 20 / (4 * frames);
        without += (symmetric.black->pedestal_dn[site] - 512) / 20 / (4 * frames);
      }
    }
    const double error = std::sqrt((c.dark_e + c.read_noise_e * c.read_noise_e) / (48.0 * side * frames));
    EXPECT_NEAR(with, c.dark_e, 5 * error) << c.dark_e << " e- over " << c.read_noise_e;
    EXPECT_NEAR(without, c.dark_e - c.lost_without_gain_e, 5 * error + 1e-3)
        << c.dark_e << " e- over " << c.read_noise_e;
  }
}

TEST(MaskedBlack, StandardErrorIncludesRowNoise) {
  test::NormalDn normal(7);
  std::vector<int> row_offset(side);
  for (int& offset : row_offset) offset = normal(50, 10);
  RawDn raw = frame_with_masked_columns(2);
  for (int y = 0; y < side; ++y) {
    for (int x = 0; x < border; ++x) raw.dn.at(x, y) = static_cast<std::uint16_t>(normal(500 + row_offset[y], 2));
  }
  const double se = measure_masked_black(raw).black->pedestal_standard_error_dn[0];
  EXPECT_NEAR(se, 10 / std::sqrt(256.0), 0.15);  // 256 rows of this parity; the deviation itself is known to 5 %
}

TEST(MaskedBlack, RefusesBordersThatShowTheScene) {
  RawDn raw = frame_with_masked_columns(3);
  raw.masked_is_stated = false;
  ASSERT_TRUE(measure_masked_black(raw).black);
  for (int y = 0; y < side; ++y) {
    const double scene = 512 + 150 * (1 + std::sin(y * 0.05));
    for (int x = 0; x < border + side; ++x) {
      raw.dn.at(x, y) = static_cast<std::uint16_t>(x < border ? 480 + 0.2 * scene : scene);
    }
  }
  const MaskedBlack lit = measure_masked_black(raw);
  EXPECT_FALSE(lit.black);
  EXPECT_NE(lit.refusal.find("shows the scene"), std::string::npos);
}

TEST(MaskedBlack, RefusesUnstatedBordersFarFromTheTag) {
  RawDn raw = frame_with_masked_columns(4);
  raw.masked_is_stated = false;
  raw.black_tag->pattern_dn = {64};
  EXPECT_FALSE(measure_masked_black(raw).black);
  raw.masked_is_stated = true;  // the source's word on what is masked outweighs its tag
  EXPECT_TRUE(measure_masked_black(raw).black);
}

TEST(MaskedBlack, RefusesUnstatedBordersThatArePaddingOrCannotBeChecked) {
  RawDn raw = frame_with_masked_columns(4);
  raw.masked_is_stated = false;
  raw.black_tag.reset();
  EXPECT_FALSE(measure_masked_black(raw).black);
  raw = frame_with_masked_columns(4);
  raw.masked_is_stated = false;
  for (int y = 0; y < side; ++y) std::fill_n(raw.dn.row(y), border, std::uint16_t{0});
  raw.black_tag->pattern_dn = {10};
  EXPECT_FALSE(measure_masked_black(raw).black);
}

TEST(MaskedBlack, RefusesTooFewPixels) {
  RawDn raw = frame_with_masked_columns(5);
  raw.masked = {{border - 8, 0, 8, side}};
  EXPECT_FALSE(measure_masked_black(raw).black);
  raw.masked.clear();
  EXPECT_FALSE(measure_masked_black(raw).black);
}

TEST(MaskedBlack, OddActiveOriginsKeepSitesApart) {
  RawDn raw = frame_with_masked_columns(6);
  raw.active = {border + 1, 1, side - 1, side - 1};
  const MaskedBlack measured = measure_masked_black(raw);
  ASSERT_TRUE(measured.black);
  for (int site = 0; site < 4; ++site) {  // the active corner is the readout's site 3
    EXPECT_NEAR(measured.black->pedestal_dn[site], true_black[3 - site], 5 * noise_dn / std::sqrt(20.0 * 250));
  }
}

TEST(BlackPoint, AutomaticPrefersMaskedPixelsWhichIncludeTheDarkCharge) {
  const auto black = choose_black(frame_with_masked_columns(8), {BlackChoice::automatic});
  ASSERT_TRUE(black);
  EXPECT_EQ(black->source, BlackPoint::Source::masked_pixels);
  EXPECT_EQ(black->holds, BlackPoint::Holds::pedestal_and_dark);
  EXPECT_EQ(black->dark_mean_e, (PerSite<double>{}));
}

// Masked pixels of the frame know its temperature; a profile's level comes next, and replaces a tag of any layout.
TEST(BlackPoint, AProfilesLevelComesBetweenMaskedPixelsAndTheTag) {
  const BlackPoint of_profile{.pedestal_dn = {500, 501, 502, 503}, .source = BlackPoint::Source::profile};
  RawDn raw = frame_with_masked_columns(2);
  EXPECT_EQ(choose_black(raw, {.measured = of_profile})->source, BlackPoint::Source::masked_pixels);
  EXPECT_EQ(choose_black(raw, {.choice = BlackChoice::measured, .measured = of_profile})->source,
            BlackPoint::Source::profile);
  raw.masked.clear();
  EXPECT_EQ(choose_black(raw, {.measured = of_profile})->pedestal_dn, of_profile.pedestal_dn);
  EXPECT_EQ(choose_black(raw, {})->source, BlackPoint::Source::tag);
  EXPECT_EQ(choose_black(raw, {.choice = BlackChoice::metadata, .measured = of_profile})->source,
            BlackPoint::Source::tag);
  EXPECT_FALSE(choose_black(raw, {.choice = BlackChoice::masked, .measured = of_profile}));
  raw.black_tag->column_dn.assign(side, 0.5);
  EXPECT_EQ(choose_black(raw, {})->source, BlackPoint::Source::tag);
  EXPECT_EQ(choose_black(raw, {.measured = of_profile})->source, BlackPoint::Source::profile);
  raw.black_tag.reset();
  EXPECT_EQ(choose_black(raw, {.measured = of_profile})->source, BlackPoint::Source::profile);
}

TEST(BlackPoint, AMeasuredLevelThatIsMissingIsAnError) {
  const auto black = choose_black(frame_with_masked_columns(2), {.choice = BlackChoice::measured});
  ASSERT_FALSE(black);
  EXPECT_EQ(black.error().code, ErrorCode::invalid_argument);
  EXPECT_NE(black.error().message.find("the profile has none"), std::string::npos);
}

TEST(BlackPoint, MetadataTakesTheTagWithItsFractions) {
  RawDn raw = frame_with_masked_columns(9);
  raw.black_tag->pattern_dn = {12.5};
  const auto black = choose_black(raw, {BlackChoice::metadata});
  ASSERT_TRUE(black);
  EXPECT_EQ(black->pedestal_dn, (PerSite<double>{12.5, 12.5, 12.5, 12.5}));
  EXPECT_EQ(black->holds, BlackPoint::Holds::pedestal_only);
}

TEST(BlackPoint, NeitherTagNorMaskedPixelsIsRefusedAndNotGuessed) {
  RawDn raw = frame_with_masked_columns(10);
  raw.masked.clear();
  raw.black_tag.reset();
  const auto black = choose_black(raw, {BlackChoice::automatic});
  ASSERT_FALSE(black);
  EXPECT_EQ(black.error().code, ErrorCode::insufficient);
  raw = frame_with_masked_columns(10);
  raw.masked.clear();
  EXPECT_FALSE(choose_black(raw, {BlackChoice::masked}));  // asked for, so the tag does not stand in
}

// Levels that are measured or given come before the default of the format, which does not count as a tag.
TEST(BlackPoint, TheDefaultOfTheFormatIsUsedWhereNothingElseIsKnown) {
  const BlackPoint of_profile{.pedestal_dn = {500, 501, 502, 503}, .source = BlackPoint::Source::profile};
  RawDn raw = frame_with_masked_columns(11);
  raw.black_tag.reset();
  raw.is_black_zero_by_default = true;
  EXPECT_EQ(choose_black(raw, {})->source, BlackPoint::Source::masked_pixels);
  raw.masked.clear();
  EXPECT_EQ(choose_black(raw, {.measured = of_profile})->pedestal_dn, of_profile.pedestal_dn);
  EXPECT_FALSE(choose_black(raw, {.choice = BlackChoice::metadata}));
  EXPECT_FALSE(choose_black(raw, {.use_format_default = false}));
  const auto black = choose_black(raw, {});
  ASSERT_TRUE(black);
  EXPECT_EQ(black->source, BlackPoint::Source::format_default);
  EXPECT_EQ(black->pedestal_dn, (PerSite<double>{}));
  EXPECT_EQ(black->holds, BlackPoint::Holds::pedestal_only);
  const auto with_dark = choose_black(raw, {.dark_dn = {4, 3, 2, 1}});
  EXPECT_EQ(with_dark->pedestal_dn, (PerSite<double>{4, 3, 2, 1}));
  EXPECT_EQ(with_dark->holds, BlackPoint::Holds::pedestal_and_dark);
}

TEST(BlackPoint, FramesOfOneColumnHaveOneColumnOffset) {
  RawDn raw = test::bayer_frame(1, 4, BayerPhase::rggb, [](int, int) { return 600; });
  raw.black_tag = BlackLevel{.pattern_dn = {500}, .column_dn = {3}, .row_dn = {1, 2, 3, 4}};
  const auto black = choose_black(raw, {BlackChoice::automatic});
  ASSERT_TRUE(black);
  EXPECT_EQ(black->pedestal_dn, (PerSite<double>{505, 505, 506, 506}));  // means over the rows of each parity
}

TEST(BlackPoint, GivenFiguresAreTakenAsTheyAre) {
  RawDn raw = frame_with_masked_columns(13);
  const auto black = choose_black(raw, {BlackChoice::given, {500, 501, 502, 503.5}});
  ASSERT_TRUE(black);
  EXPECT_EQ(black->pedestal_dn[3], 503.5);
  EXPECT_EQ(black->source, BlackPoint::Source::given);
  EXPECT_FALSE(choose_black(raw, {BlackChoice::given, {5000, 0, 0, 0}}));
}

TEST(BlackPoint, KnownDarkChargeIsAddedToATagAndToGivenFigures) {
  RawDn raw = test::bayer_frame(8, 8, BayerPhase::rggb, [](int, int) { return 900; });
  const PerSite<double> dark{10, 20, 30, 40};
  raw.black_tag = BlackLevel{.pattern_dn = {520}};
  for (const BlackChoice choice : {BlackChoice::automatic, BlackChoice::metadata, BlackChoice::given}) {
    const auto black = choose_black(raw, {.choice = choice, .given_dn = {520, 520, 520, 520}, .dark_dn = dark});
    ASSERT_TRUE(black);
    EXPECT_EQ(black->pedestal_dn, (PerSite<double>{530, 540, 550, 560}));
    EXPECT_EQ(black->holds, BlackPoint::Holds::pedestal_and_dark);
    EXPECT_FALSE(black->pattern);
  }
  const auto without = choose_black(raw, {});
  ASSERT_TRUE(without);
  EXPECT_EQ(without->holds, BlackPoint::Holds::pedestal_only);
  // A pattern of three columns, and offsets of its rows.
  raw.black_tag = BlackLevel{.columns = 3, .pattern_dn = {1, 2, 3}, .row_dn = {0, 1, 2, 3, 4, 5, 6, 7}};
  const auto fine = choose_black(raw, {.dark_dn = dark});
  ASSERT_TRUE(fine && fine->pattern);
  for (int y = 0; y < 8; ++y) {
    for (int x = 0; x < 8; ++x) {
      EXPECT_EQ(fine->pattern->at(x, y), raw.black_tag->at(x, y) + dark[site_of(x, y)]) << x << ' ' << y;
    }
  }
  // Masked pixels hold it already.
  const auto masked = choose_black(frame_with_masked_columns(3), {.dark_dn = dark});
  const auto same = choose_black(frame_with_masked_columns(3), {});
  ASSERT_TRUE(masked && same);
  EXPECT_EQ(masked->pedestal_dn, same->pedestal_dn);
}

TEST(BlackPoint, LargePatternsAndRowOffsetsAreKeptWhole) {
  RawDn raw = frame_with_masked_columns(11);
  raw.black_tag = BlackLevel{.rows = 4, .columns = 4, .pattern_dn = std::vector<double>(16, 500.0)};
  raw.black_tag->pattern_dn[15] = 530;
  auto black = choose_black(raw, {BlackChoice::metadata});
  ASSERT_TRUE(black && black->pattern);
  raw.black_tag = BlackLevel{.pattern_dn = {500}, .row_dn = std::vector<double>(side, 0.25)};
  black = choose_black(raw, {BlackChoice::automatic});  // finer than four measured figures
  ASSERT_TRUE(black && black->pattern);
  EXPECT_EQ(black->source, BlackPoint::Source::tag);
}

TEST(BlackPoint, WhiteAtOrBelowBlackIsAnError) {
  RawDn raw = frame_with_masked_columns(12);
  raw.white_dn = {4095, 400, 4095};
  const auto black = choose_black(raw, {BlackChoice::metadata});
  ASSERT_FALSE(black);
  EXPECT_EQ(black.error().code, ErrorCode::malformed);
}

}  // namespace
}  // namespace lowlux::isp
