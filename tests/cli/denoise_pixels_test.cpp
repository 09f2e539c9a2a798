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
#include "tests/support/dng_builder.h"
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
                                         "LinearRaw DNG of three colours, 32-bit floats: X-Trans is interpolated"};
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
    EXPECT_EQ(clean->raw.is_float(), kind == Kind::x_trans);
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

TEST_F(DenoisePixels, LevelsAreThoseOfMosaicsAndMapsAreRefusedByName) {
  write("night.dng", night(Kind::linear_raw));
  for (const std::string level : {"draft", "standard", "high", "best"}) {
    const auto result =
        lowlux({"denoise", file("night.dng"), "-o", file("clean.dng"), "--json", "--force", "--denoise", level});
    ASSERT_EQ(result.exit_code, 0) << result.err;
    EXPECT_EQ(Json::parse(result.out)[0]["denoise"]["level"], level);
  }
  const auto maps = lowlux({"denoise", file("night.dng"), "-o", file("maps.dng"), "--maps"});
  EXPECT_EQ(maps.exit_code, 0) << maps.err;
  EXPECT_NE(maps.err.find("noise maps are made of Bayer mosaics only"), std::string::npos) << maps.err;
  EXPECT_TRUE(std::filesystem::exists(file("maps.dng")));
  EXPECT_FALSE(std::filesystem::exists(file("maps.noise.pfm")));
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
  refused("the noise is unknown");
  DngBuilder cut = night(Kind::monochrome);
  write("night.dng", cut);
  std::filesystem::resize_file(file("night.dng"), std::filesystem::file_size(file("night.dng")) / 2);
  refused("night.dng");
}

}  // namespace
}  // namespace lowlux
