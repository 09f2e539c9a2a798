#include <gtest/gtest.h>

#include <algorithm>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "tests/cli/command.h"
#include "tests/support/scratch_directory.h"

namespace lowlux {
namespace {

using test::dog;
using test::holds;
using test::lowlux;
using Json = nlohmann::json;
using Words = std::vector<std::string>;

class FinishOptions : public testing::Test {
 protected:
  test::ProcessResult develop(const Words& options, const std::string& name = "x.png") const {
    Words words{"develop", dog, "-o", scratch_.file(name), "--force", "--json"};
    words.insert(words.end(), options.begin(), options.end());
    return lowlux(words);
  }
  Json developed(const Words& options, const std::string& name = "x.png") const {
    const auto result = develop(options, name);
    EXPECT_EQ(result.exit_code, 0) << result.err;
    return result.exit_code == 0 ? Json::parse(result.out)[0] : Json();
  }
  void refused(const Words& options, int code, const std::string& part) const {
    const auto result = develop(options, "refused.png");
    const std::string said = testing::PrintToString(options) + result.err;
    EXPECT_EQ(result.exit_code, code) << said;
    EXPECT_EQ(std::count(result.err.begin(), result.err.end(), '\n'), 1) << said;
    EXPECT_TRUE(holds(result.err, part)) << said;
    EXPECT_FALSE(scratch_.holds("refused.png")) << said;
  }
  test::ScratchDirectory scratch_;
};

TEST_F(FinishOptions, CropAndMaxSizeSetTheSizeOfTheImage) {
  const Json whole = developed({});
  const int width = whole["width"], height = whole["height"];
  EXPECT_TRUE(whole["framing"].is_null());
  const Json crop = developed({"--crop", "8,20,64,31"});
  EXPECT_EQ(crop["width"], 64);
  EXPECT_EQ(crop["height"], 31);
  EXPECT_FALSE(crop["framing"]["shrunk"].get<bool>());
  const Json part = developed({"--crop", "25%,0%,50%,100%", "--max-size", "100"});
  EXPECT_EQ(part["height"], 100);
  EXPECT_EQ(part["width"], (width / 2 * 100 + height / 2) / height);
  EXPECT_EQ(developed({"--max-size", "65535"})["width"], width) << "nothing is enlarged";
  EXPECT_EQ(
      developed({"--half", "--max-size", "50", "--bits", "16", "--look", "eye", "--scene-luminance", "1"})["height"],
      50);
}

TEST_F(FinishOptions, AbsurdCropsAndSizesAreOneLine) {
  for (const char* crop : {"1,2,3", "1,2,3,4,5", "0,0,0,5", "-1,0,5,5", "0,0,5.5,5", "0,0,50%,50", "0%,0%,101%,5%",
                           "a,b,c,d", "", "nan,0,5,5", "0,0,1e9,5"}) {
    refused({"--crop", crop}, 2, "--crop");
  }
  refused({"--crop", "0,0,257,10"}, 1, "the upright image has");
  refused({"--crop", "60%,0%,60%,10%"}, 1, "the upright image has");
  for (const char* size : {"0", "-5", "1.5", "65536", "big"}) refused({"--max-size", size}, 2, "--max-size");
}

TEST_F(FinishOptions, WhiteBalanceTakesPresetsTintsGainsAndPixels) {
  const auto white = [&](const char* text) { return developed({"--wb", text})["white_balance"]; };
  EXPECT_EQ(white("tungsten")["rule"], "preset");
  EXPECT_NEAR(white("tungsten")["cct_k"].get<double>(), 2856, 3);
  EXPECT_NEAR(white("shade")["cct_k"].get<double>(), 7504, 8);
  EXPECT_NEAR(white("fluorescent")["duv"].get<double>(), 0.0018, 2e-4);
  EXPECT_EQ(white("Shade"), white("shade"));
  EXPECT_EQ(white("AUTO"), white("auto"));
  EXPECT_EQ(white("5500"), white("5500K,0"));
  EXPECT_NEAR(white("5500,30")["duv"].get<double>() - white("5500")["duv"].get<double>(), 0.01, 1e-5);
  EXPECT_EQ(white("2,1,1.5")["rule"], "gains");
  EXPECT_NEAR(white("2,1,1.5")["neutral"][0].get<double>(), 0.5, 1e-9);
  EXPECT_EQ(white("pick:100,100")["rule"], "picked");
  EXPECT_NE(white("pick:100,100,8"), white("pick:30,40,8"));
}

TEST_F(FinishOptions, AbsurdWhiteBalancesAreOneLine) {
  for (const char* text : {"warm", "1000", "5000,200", "5000,1,2,3", "0,1,1", "1,1,-2", "1,1,1000", "pick:", "pick:5",
                           "pick:5,5,0", "pick:-1,2", "pick:1.5,2", "pick:1,2,3,4", ",", "5000,", "nan", "nan,1,1"}) {
    refused({"--wb", text}, 2, "--wb");
  }
  refused({"--wb", "pick:60000,5"}, 1, "outside the upright image");
  refused({"--wb", "pick:1000000000,5"}, 1, "outside the upright image");
  refused({"--wb", "100,0.01,100"}, 1, "--wb 5500");
}

TEST_F(FinishOptions, ExposureIsAGainOrAChangeOfTheAutomaticOne) {
  const auto ev = [&](const char* text) { return developed({"--exposure", text})["exposure"]["ev"].get<double>(); };
  const double automatic = ev("auto");
  EXPECT_NEAR(ev("auto+1"), automatic + 1, 1e-9);
  EXPECT_NEAR(ev("auto-0.5 EV"), automatic - 0.5, 1e-9);
  EXPECT_EQ(ev("1"), 1);
  EXPECT_EQ(ev("+1"), 1) << "what --explain prints can be given again";
  EXPECT_EQ(ev("-0.5"), -0.5);
  for (const char* text : {"auto1", "auto+", "auto+20", "+auto", "13", "", "auto+nan"})
    refused({"--exposure", text}, 2, "--exposure");
}

TEST_F(FinishOptions, AdjustmentsTakeNumbersInTheirRange) {
  developed({"--brightness", "+0.5EV", "--contrast", "1.2", "--saturation", "0.8", "--highlights", "reconstruct",
             "--sharpen", "0.7px", "--local-tone", "0.4"});
  EXPECT_EQ(developed({"--local-tone", "1"})["local_tone"], 1);
  EXPECT_EQ(developed({})["local_tone"], 0);
  developed({"--sharpen", "off", "--highlights", "clip", "--brightness", "0", "--contrast", "1"});
  for (const char* text : {"3", "-3", "x", "nan", ""}) refused({"--brightness", text}, 2, "--brightness");
  for (const char* text : {"0.4", "1.6", "inf"}) refused({"--contrast", text}, 2, "--contrast");
  for (const char* text : {"-1", "3.1", "a lot"}) refused({"--saturation", text}, 2, "--saturation");
  for (const char* text : {"0.2", "2", "on", "-1"}) refused({"--sharpen", text}, 2, "--sharpen");
  for (const char* text : {"-0.1", "1.1", "nan", "on", ""}) refused({"--local-tone", text}, 2, "--local-tone");
  refused({"--highlights", "rebuild"}, 2, "--highlights");
  refused({"--tone", "none", "--local-tone", "0.5"}, 2, "--local-tone requires");
  refused({"--tone", "none", "--contrast", "1.2"}, 2, "tone curve");
  refused({"--look", "eye", "--scene-luminance", "1", "--saturation", "2"}, 2, "saturation");
}

}  // namespace
}  // namespace lowlux
