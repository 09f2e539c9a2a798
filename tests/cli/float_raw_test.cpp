// Floating-point raws as inputs and outputs of the command.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "capture/file/dng_source.h"
#include "capture/file/picture_source.h"
#include "isp/base/executor.h"
#include "isp/output/dng/dng_writer.h"
#include "tests/cli/command.h"
#include "tests/cli/simulate/simulate_command.h"
#include "tests/support/as_floats.h"
#include "tests/support/dng/float_dng.h"

namespace lowlux {
namespace {

using test::lowlux;
using Json = nlohmann::json;

class FloatRawCommand : public test::SimulateCommand {
 protected:
  void SetUp() override {
    simulated("chart:macbeth", "codes.dng", {"--luminance", "0.2", "--size", "192x128", "--no-truth"});
    auto frame = capture::read_raw(file("codes.dng"));
    ASSERT_TRUE(frame) << frame.error().message;
    test::make_floats(frame->raw);
    const auto written = isp::write_dng(*frame, file("floats.dng"));
    ASSERT_TRUE(written) << written.error().message;
  }

  void write(const std::string& name, const test::DngBuilder& dng) const {
    const auto bytes = dng.build();
    std::ofstream(file(name), std::ios::binary)
        .write(reinterpret_cast<const char*>(bytes.data()), static_cast<std::streamsize>(bytes.size()));
  }

  SceneLinear developed(const std::string& raw, const std::vector<std::string>& more) {
    std::vector<std::string> args{"develop", file(raw), "-o", file("out.png"), "--force", "--bits", "16"};
    args.insert(args.end(), more.begin(), more.end());
    const auto result = lowlux(args);
    EXPECT_EQ(result.exit_code, 0) << result.err;
    InlineExecutor one;
    auto picture = capture::read_picture(file("out.png"), one);
    EXPECT_TRUE(picture) << picture.error().message;
    return std::move(picture->xyz);
  }

  void expect_same_picture(const std::string& raw, const std::vector<std::string>& more, double tolerance) {
    const SceneLinear codes = developed("codes.dng", more), floats = developed(raw, more);
    double worst = 0;
    for (std::size_t k = 0; k < 3; ++k) {
      for (std::size_t i = 0; i < codes.plane[k].size(); ++i) {
        worst = std::max<double>(worst, std::fabs(codes.plane[k].data()[i] - floats.plane[k].data()[i]));
      }
    }
    EXPECT_LE(worst, tolerance);
  }
};

TEST_F(FloatRawCommand, AreDevelopedLikeCodesOfTheSameValues) {
  // One code of 16 bits is at most 1 / 65535 / 1 * 2.3 (the slope of sRGB's curve at white) of light in each of R, G
  // and B, which add up in XYZ.
  constexpr double one_code = 2.3 / 65535;
  expect_same_picture("floats.dng", {}, one_code);
  expect_same_picture("floats.dng", {"--denoise", "off", "--repair", "off"}, one_code);
  expect_same_picture("floats.dng", {"--look", "eye", "--scene-luminance", "0.2", "--half"}, one_code);
}

TEST_F(FloatRawCommand, InfoStatesThatTheyAre) {
  const auto text = lowlux({"info", file("floats.dng")});
  ASSERT_EQ(text.exit_code, 0) << text.err;
  EXPECT_NE(text.out.find("192 x 128, RGGB, floating-point\n"), std::string::npos) << text.out;
  const auto json = lowlux({"info", "--json", file("floats.dng"), file("codes.dng")});
  ASSERT_EQ(json.exit_code, 0) << json.err;
  const Json report = Json::parse(json.out);
  EXPECT_EQ(report[0]["floating_point"], true);
  EXPECT_EQ(report[1]["floating_point"], false);
  for (const char* key : {"readout", "white_dn", "noise_profile", "active", "cfa"})
    EXPECT_EQ(report[0][key], report[1][key]);
}

TEST_F(FloatRawCommand, AreDenoisedToFloatingPointRaws) {
  for (const char* name : {"codes", "floats"}) {
    const auto result =
        lowlux({"denoise", file(std::string(name) + ".dng"), "-o", file(std::string("clean_") + name + ".dng")});
    ASSERT_EQ(result.exit_code, 0) << result.err;
  }
  const auto codes = capture::read_raw(file("clean_codes.dng")), floats = capture::read_raw(file("clean_floats.dng"));
  ASSERT_TRUE(codes && floats);
  EXPECT_TRUE(floats->raw.is_float());
  EXPECT_EQ(floats->raw.white_dn[0], 1);
  const double black = codes->raw.black_tag->pattern_dn[0], range = codes->raw.white_dn[0] - black;
  for (std::size_t i = 0; i < floats->raw.samples(); ++i) {
    ASSERT_NEAR(black + range * static_cast<double>(floats->raw.dn_float.data()[i]), codes->raw.dn.data()[i], 1.01)
        << i;
  }
  ASSERT_TRUE(floats->noise);
  EXPECT_TRUE(floats->noise->reduced);
  developed("clean_floats.dng", {});
}

TEST_F(FloatRawCommand, OfOtherProgramsAreRead) {
  Plane<std::uint32_t> patterns(3 * 70, 60);
  for (std::size_t i = 0; i < patterns.size(); ++i)
    patterns.data()[i] = 0x3000 + static_cast<std::uint32_t>(37 * i % 2000);
  write("merged.dng", test::float_dng(patterns, {16, 3, true, 34894, 32, 32}));  // LinearRaw halves, as Adobe merges
  developed("merged.dng", {});
  const auto refused = lowlux({"denoise", file("merged.dng"), "-o", file("out.dng")});
  EXPECT_EQ(refused.exit_code, 1);
  Plane<std::uint32_t> mosaic(80, 64);
  for (std::size_t i = 0; i < mosaic.size(); ++i)
    mosaic.data()[i] = 0x3E0000 + static_cast<std::uint32_t>(371 * i % 60000);
  write("mosaic.dng",
        test::float_dng(mosaic, {24, 1, true, 34895, 32, 32}));  // a mosaic of 24 bits, as HDRMerge has it
  developed("mosaic.dng", {});
  const auto unknown = lowlux({"denoise", file("mosaic.dng"), "-o", file("out.dng")});
  EXPECT_EQ(unknown.exit_code, 1);
  EXPECT_NE(unknown.err.find("floating-point"), std::string::npos) << unknown.err;
}

TEST_F(FloatRawCommand, WhatIsMadeOfCodesIsRefusedInOneLine) {
  const auto expect_refusal = [&](const std::vector<std::string>& args) {
    const auto result = lowlux(args);
    EXPECT_EQ(result.exit_code, 1) << result.err;
    EXPECT_NE(result.err.find("floating-point"), std::string::npos) << result.err;
    EXPECT_EQ(std::count(result.err.begin(), result.err.end(), '\n'), 1) << result.err;
  };
  expect_refusal({"develop", file("floats.dng"), "--dark-frame", file("codes.dng"), "-o", file("out.png")});
  expect_refusal({"develop", file("codes.dng"), "--bias-frame", file("floats.dng"), "-o", file("out.png")});
  expect_refusal({"develop", file("codes.dng"), "--flat-frame", file("floats.dng"), "-o", file("out.png")});
  expect_refusal({"calibrate", "black", file("floats.dng"), "-o", file("out.json")});
  Plane<float> values(64, 64);
  std::fill_n(values.data(), values.size(), 0.5F);
  values.at(3, 5) = std::nanf("");
  write("nan.dng", test::float_dng(values, 1));
  const auto result = lowlux({"info", file("nan.dng")});
  EXPECT_EQ(result.exit_code, 1);
  EXPECT_NE(result.err.find("column 3, row 5 is not a finite number"), std::string::npos) << result.err;
}

}  // namespace
}  // namespace lowlux
