// `lowlux denoise` of files that are no Bayer mosaics.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <random>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "capture/file/dng_source.h"
#include "tests/capture/x_trans_colours.h"
#include "tests/cli/command.h"
#include "tests/support/dng/dng_builder.h"
#include "tests/support/scratch_directory.h"

namespace lowlux {
namespace {

using test::DngBuilder;
using test::lowlux;
using test::Tag;
using test::TagType;

using Json = nlohmann::json;

enum class Kind : std::uint8_t { linear_raw, monochrome, x_trans };

constexpr std::array kinds{Kind::linear_raw, Kind::monochrome, Kind::x_trans};

/// A grey of 20 e- and its noise, 16 DN/e-, in two halves of which the right one has twice the light.
DngBuilder night(Kind kind) {
  constexpr double gain_dn = 16, read_e = 2, black_dn = 64, white_dn = 65535;
  DngBuilder dng;
  dng.width = 96, dng.height = 72;
  if (kind == Kind::linear_raw) dng.samples = 3;
  dng.monochrome = kind == Kind::monochrome;
  if (kind == Kind::x_trans) {
    dng.set(33421, Tag::numbers(TagType::u16, {6, 6}));
    dng.set(33422, Tag::numbers(TagType::byte, test::x_trans_colours({})));
  }
  dng.set(50728, Tag::numbers(TagType::rational, {1, 1, 1}));
  const double full_e = (white_dn - black_dn) / gain_dn;
  dng.set(51041, Tag::numbers(TagType::f64, {1 / full_e, read_e * read_e / (full_e * full_e)}));  // NoiseProfile
  std::mt19937 draw(20261126);
  const int row = dng.width * dng.samples;
  for (int i = 0; i < row * dng.height; ++i) {
    std::poisson_distribution<int> light(i % row < row / 2 ? 20 : 40);
    std::normal_distribution<double> read(0, read_e);
    dng.pixels.push_back(static_cast<std::uint16_t>(std::lround(black_dn + gain_dn * (light(draw) + 8 + read(draw)))));
  }
  return dng;
}

class DenoisePixels : public testing::Test {
 protected:
  std::string file(const std::string& name) const { return folder_.file(name); }
  void write(const std::string& name, const DngBuilder& dng) const {
    const auto bytes = dng.build();
    std::ofstream(file(name), std::ios::binary)
        .write(reinterpret_cast<const char*>(bytes.data()), static_cast<std::streamsize>(bytes.size()));
  }
  test::ScratchDirectory folder_;
};

TEST_F(DenoisePixels, WritesARawOfTheSameKindAndSaysSo) {
  const std::array<std::string, 3> words{"LinearRaw DNG of three colours, 16 bits",
                                         "DNG of a monochrome sensor, 16 bits",
                                         "LinearRaw DNG of three colours, 16 bits: X-Trans is interpolated"};
  for (const Kind kind : kinds) {
    SCOPED_TRACE(static_cast<int>(kind));
    write("night.dng", night(kind));
    const auto result = lowlux({"denoise", file("night.dng"), "-o", file("clean.dng"), "--json", "--force"});
    ASSERT_EQ(result.exit_code, 0) << result.err;
    const Json report = Json::parse(result.out)[0];
    EXPECT_EQ(report["clean_raw"].get<std::string>().rfind(words[static_cast<std::size_t>(kind)], 0), 0U) << report;
    EXPECT_EQ(report["denoise"]["level"], "standard");
    EXPECT_EQ(report["width"], 96);
    const auto explained = lowlux({"denoise", file("night.dng"), "-o", file("clean.dng"), "--explain", "--force"});
    EXPECT_NE(explained.out.find(words[static_cast<std::size_t>(kind)]), std::string::npos) << explained.out;
    const auto noisy = capture::read_raw(file("night.dng")), clean = capture::read_raw(file("clean.dng"));
    ASSERT_TRUE(noisy && clean) << clean.error().message;
    EXPECT_EQ(clean->raw.layout, kind == Kind::monochrome ? SensorLayout::monochrome : SensorLayout::linear_rgb);
    EXPECT_FALSE(clean->raw.is_float());
    if (kind != Kind::monochrome) {
      EXPECT_LT(clean->raw.black_tag->pattern_dn[0], 1024);
    }
    EXPECT_FALSE(clean->raw.from_x_trans);
    EXPECT_EQ(clean->raw.info.model, noisy->raw.info.model);
    ASSERT_TRUE(clean->noise);
    EXPECT_TRUE(clean->noise->reduced);
    for (int c = 0; c < 3; ++c) {
      const auto variance = [&](const NoiseProfile& noise) { return noise.scale[c] * 0.005 + noise.offset[c]; };
      EXPECT_LT(variance(*clean->noise), 0.2 * variance(*noisy->noise)) << c;
    }
  }
}

TEST_F(DenoisePixels, LevelsAreThoseOfMosaics) {
  write("night.dng", night(Kind::linear_raw));
  for (const std::string level : {"draft", "standard", "high", "best"}) {
    const auto result =
        lowlux({"denoise", file("night.dng"), "-o", file("clean.dng"), "--json", "--force", "--denoise", level});
    ASSERT_EQ(result.exit_code, 0) << result.err;
    EXPECT_EQ(Json::parse(result.out)[0]["denoise"]["level"], level);
  }
}

TEST_F(DenoisePixels, MapsHaveTheSizeOfTheImageTurnedUpright) {
  for (const Kind kind : kinds) {
    DngBuilder dng = night(kind);
    dng.set(274, Tag::numbers(TagType::u16, {6}));  // Orientation: a quarter turn
    write("night.dng", dng);
    for (const std::string verb : {"denoise", "develop"}) {
      const std::string output = file(verb == "denoise" ? "maps.dng" : "maps.png");
      const auto result = lowlux({verb, file("night.dng"), "-o", output, "--maps", "--denoise", "high", "--force"});
      ASSERT_EQ(result.exit_code, 0) << result.err;
      EXPECT_EQ(result.err.find("maps"), std::string::npos) << result.err;
      for (const std::string map : {"noise", "confidence"}) {
        std::ifstream pfm(file("maps." + map + ".pfm"), std::ios::binary);
        std::string type;
        int width = 0, height = 0;
        pfm >> type >> width >> height;
        EXPECT_EQ(type, "Pf");
        EXPECT_EQ(width, 72) << verb << ' ' << map;
        EXPECT_EQ(height, 96) << verb << ' ' << map;
        pfm.close();
        std::filesystem::remove(file("maps." + map + ".pfm"));
      }
    }
  }
}

/// X-Trans frames of one sensor: a grey of 200 e- or none, 16 DN/e-, a dark charge of 0 to 60 e- that differs between
/// photosites but not between frames.
DngBuilder warm_x_trans(double light_e, unsigned seed) {
  DngBuilder dng;
  dng.width = 96, dng.height = 72;
  dng.set(33421, Tag::numbers(TagType::u16, {6, 6}));
  dng.set(33422, Tag::numbers(TagType::byte, test::x_trans_colours({2, 1})));
  dng.set(50728, Tag::numbers(TagType::rational, {1, 1, 1}));
  dng.set(33434, Tag::numbers(TagType::rational, {1}));  // ExposureTime
  const double full_e = 65471 / 16.0;
  dng.set(51041, Tag::numbers(TagType::f64, {1 / full_e, 9 / (full_e * full_e)}));
  std::mt19937 pattern(1), draw(seed);
  std::uniform_real_distribution<double> charge_e(0, 60);
  std::normal_distribution<double> read_e(0, 3);
  for (int i = 0; i < dng.width * dng.height; ++i) {
    std::poisson_distribution<int> electrons(light_e + charge_e(pattern));
    const double dn = 64 + 16 * (electrons(draw) + read_e(draw));
    dng.pixels.push_back(static_cast<std::uint16_t>(std::lround(std::clamp(dn, 0.0, 65535.0))));
  }
  return dng;
}

TEST_F(DenoisePixels, DarkFramesAreSubtractedFromSinglePhotositesOfXTrans) {
  const auto error_e = [&](const std::vector<std::string>& options) {
    std::vector<std::string> words{"develop", file("light.dng"), "-o", file("out.pfm"), "--force", "--tone",
                                   "none",    "--exposure",      "0",  "--space",       "camera",  "--denoise",
                                   "off",     "--quiet"};
    words.insert(words.end(), options.begin(), options.end());
    const auto result = lowlux(words);
    EXPECT_EQ(result.exit_code, 0) << result.err;
    std::ifstream pfm(file("out.pfm"), std::ios::binary);
    std::string line;
    for (int i = 0; i < 3; ++i) std::getline(pfm, line);
    std::vector<float> values(std::size_t{96} * 72 * 3);
    pfm.read(reinterpret_cast<char*>(values.data()), static_cast<std::streamsize>(values.size() * sizeof(float)));
    double mean = 0, squares = 0;
    for (const float v : values) mean += 65471 / 16.0 * v / static_cast<double>(values.size());
    for (const float v : values) squares += std::pow(65471 / 16.0 * v - mean, 2) / static_cast<double>(values.size());
    return std::pair{mean, std::sqrt(squares)};
  };
  write("light.dng", warm_x_trans(200, 77));
  std::filesystem::create_directory(file("darks"));
  for (unsigned i = 0; i < 16; ++i) write("darks/" + std::to_string(i) + ".dng", warm_x_trans(0, 100 + i));
  const auto without = error_e({}), with = error_e({"--dark-frame", file("darks")});
  // Noise: sqrt(230 + 9) e- of a site, of its dark charge 17 e-, which the darks measure to 2 e- or less.
  EXPECT_NEAR(without.first, 230, 5);
  EXPECT_NEAR(with.first, 200, 5 * 17 / std::sqrt(96 * 72 * 8 / 36.0) + 1);
  EXPECT_LT(with.second, 0.85 * without.second);
}

TEST_F(DenoisePixels, WhatXTransIsNotUsedForIsStated) {
  write("light.dng", warm_x_trans(200, 5));
  write("flat.dng", warm_x_trans(2000, 6));
  const auto refused = [&](const std::vector<std::string>& words, const std::string& why) {
    const auto result = lowlux(words);
    EXPECT_EQ(result.exit_code, 1) << result.err;
    EXPECT_NE(result.err.find(why), std::string::npos) << result.err;
    EXPECT_NE(result.err.find("X-Trans"), std::string::npos) << result.err;
    EXPECT_EQ(std::count(result.err.begin(), result.err.end(), '\n'), 1) << result.err;
  };
  refused({"develop", file("light.dng"), "-o", file("a.png"), "--flat-frame", file("flat.dng")}, "2 x 2 sites");
  refused({"merge", file("light.dng"), file("flat.dng"), "-o", file("a.dng")}, "not merged");
  refused({"calibrate", "black", file("light.dng"), file("flat.dng"), "-o", file("a.json")}, "2 x 2 sites");
}

// Its noise, which cannot be measured either, would not help.
TEST_F(DenoisePixels, LinearRawWithoutStatedNoiseIsNotMergedBecauseItIsDemosaiced) {
  for (const char* name : {"night.dng", "second.dng"}) write(name, night(Kind::linear_raw).remove(51041));
  for (const bool states_noise : {false, true}) {
    std::vector<std::string> words{"merge", file("night.dng"), file("second.dng"), "-o", file("merged.dng")};
    if (states_noise) words.insert(words.end(), {"--noise", "16,2"});
    const auto result = lowlux(words);
    EXPECT_EQ(result.exit_code, 1) << result.err;
    EXPECT_NE(result.err.find("night.dng: the frame is already demosaiced"), std::string::npos) << result.err;
    EXPECT_EQ(std::count(result.err.begin(), result.err.end(), '\n'), 1) << result.err;
    EXPECT_FALSE(std::filesystem::exists(file("merged.dng")));
  }
}

TEST_F(DenoisePixels, LinearRawWithoutStatedNoiseIsDevelopedWithOneWarning) {
  write("night.dng", night(Kind::linear_raw).remove(51041));
  const auto warnings = [&](const std::vector<std::string>& options) {
    std::vector<std::string> words{"develop", file("night.dng"), "-o", file("out.png"), "--force"};
    words.insert(words.end(), options.begin(), options.end());
    const auto result = lowlux(words);
    EXPECT_EQ(result.exit_code, 0) << result.err;
    const std::string remedy = "--noise GAIN,READ states it";
    int count = 0;
    for (auto at = result.err.find(remedy); at != std::string::npos; at = result.err.find(remedy, at + 1)) ++count;
    return count;
  };
  EXPECT_EQ(warnings({}), 1);
  EXPECT_EQ(warnings({"--denoise", "off"}), 0);
  EXPECT_EQ(warnings({"--noise", "16,2"}), 0);
}

TEST_F(DenoisePixels, BadInputIsOneLineAndNoFile) {
  const auto refused = [&](const std::string& why) {
    const auto result = lowlux({"denoise", file("night.dng"), "-o", file("clean.dng")});
    EXPECT_EQ(result.exit_code, 1);
    EXPECT_NE(result.err.find(why), std::string::npos) << result.err;
    EXPECT_EQ(std::count(result.err.begin(), result.err.end(), '\n'), 1) << result.err;
    EXPECT_FALSE(std::filesystem::exists(file("clean.dng")));
  };
  write("night.dng", night(Kind::linear_raw).remove(51041));
  refused("state it with --noise GAIN,READ");
  DngBuilder cut = night(Kind::monochrome);
  write("night.dng", cut);
  std::filesystem::resize_file(file("night.dng"), std::filesystem::file_size(file("night.dng")) / 2);
  refused("night.dng");
}

}  // namespace
}  // namespace lowlux
