#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <set>

#include <nlohmann/json.hpp>

#include "calib/profile/profile_io.h"
#include "tests/cli/command.h"
#include "tests/cli/simulate/simulate_command.h"

namespace lowlux {
namespace {

using test::holds;
using test::lowlux;

using Json = nlohmann::json;
using Words = std::vector<std::string>;

class Advise : public test::SimulateCommand {
 protected:
  static test::ProcessResult advise(const Words& more) {
    Words words{"info", "--advise"};
    words.insert(words.end(), more.begin(), more.end());
    return lowlux(words);
  }

  static Json advised(Words more) {
    more.emplace_back("--json");
    const auto result = advise(more);
    EXPECT_EQ(result.exit_code, 0) << testing::PrintToString(more) << result.err;
    EXPECT_EQ(result.err, "");
    return Json::parse(result.out);
  }

  /// A camera of two gains, neutral being (0.5, 1, 0.7) of its green under every light.
  std::string profile(bool with_colours) {
    CameraProfile camera{"Maker", "Model", {}, {}};
    for (const double iso : {100.0, 800.0}) {
      GainProfile gain;
      gain.gain_setting = "ISO " + std::to_string(static_cast<int>(iso));
      gain.iso = iso;
      SensorModel sensor;
      sensor.name = "Model";
      sensor.bits = 14;
      sensor.black_level_dn = 383;
      sensor.white_level_dn = 16383;
      sensor.system_gain_dn_per_e = iso / 200;  // 32000 and 4000 e- at the largest code
      sensor.read_noise_e = 400 / iso;
      sensor.full_well_e = 50000;
      gain.sensor = sensor;
      camera.gains.push_back(gain);
    }
    GainProfile unknown;
    unknown.gain_setting = "ISO 50";
    camera.gains.push_back(unknown);
    if (with_colours) {
      ColourProfile colour;
      colour.illuminant = "D65";
      colour.calibration.cct_k = 6504;
      // From XYZ of D65 (0.9505, 1, 1.0888) to (0.5, 1, 0.7).
      colour.calibration.xyz_to_camera = {{{0.5 / 0.9505, 0, 0}, {0, 1, 0}, {0, 0, 0.7 / 1.0888}}};
      camera.colours.push_back(colour);
    }
    scratch_.write("camera.json", *calib::profile_text(camera));
    return file("camera.json");
  }
};

const Words night{"--sensor", "ELD_NikonD850", "--luminance", "0.05", "--highlight", "20x"};

Words with(Words words, const Words& more) {
  words.insert(words.end(), more.begin(), more.end());
  return words;
}

TEST_F(Advise, SaysGainExposureAndWhyAndLeavesTheCurveToTheReport) {
  const auto result = advise(with(night, {"--max-exposure", "0.05"}));
  EXPECT_EQ(result.exit_code, 0) << result.err;
  EXPECT_TRUE(holds(result.out, "advice            ISO 6400, 1/20 s: SNR 12.8 dB")) << result.out;
  EXPECT_LT(std::count(result.out.begin(), result.out.end(), '\n'), 30) << result.out;
  EXPECT_TRUE(holds(result.out, "because         the longest exposure allowed is 0.05 s")) << result.out;
  EXPECT_TRUE(holds(result.out, "mid tone 0.05 cd/m2, highlight 1 cd/m2, at most 0.05 s, 20 C")) << result.out;
  EXPECT_TRUE(holds(result.out, "row and column noise of")) << result.out;
  EXPECT_TRUE(holds(result.out, "curves over exposure time")) << result.out;
}

TEST_F(Advise, AsJsonHasAllGainsAndACurveThatDoesNotBeatTheAdvice) {
  const Json json = advised(with(night, {"--max-exposure", "0.5"}));
  ASSERT_EQ(json["gains"].size(), 4u);
  ASSERT_EQ(json["curve"].size(), 100u);
  std::set<std::string> exceeded;
  for (const Json& point : json["curve"]) {
    if (!point["exceeds"].is_null()) {
      exceeded.insert(point["exceeds"]);
      continue;
    }
    // Within the 0.1 dB that count as equal.
    EXPECT_LE(point["snr_db"].get<double>(), json["advice"]["snr_db"].get<double>() + 0.1 + 1e-9) << point;
    EXPECT_GE(point["uv_std"].get<double>() * 1.012, json["advice"]["uv_std"].get<double>()) << point;
  }
  EXPECT_EQ(exceeded, std::set<std::string>{"converter range"});
  EXPECT_EQ(json["longest_exposure_s"], 0.5);
}

TEST_F(Advise, TakesMotionAndBlurForTheLongestExposureTheyAllow) {
  const Json moved = advised(with(night, {"--motion", "100", "--blur", "2"}));
  EXPECT_EQ(moved["advice"], advised(with(night, {"--max-exposure", "0.02"}))["advice"]);
  const Json both = advised(with(night, {"--motion", "100", "--blur", "2", "--max-exposure", "0.01"}));
  EXPECT_EQ(both["longest_exposure_s"], 0.01);
}

TEST_F(Advise, OfOneGainIsTheBestOfThatGain) {
  const Json all = advised(with(night, {"--max-exposure", "0.05"}));
  const Json one = advised(with(night, {"--max-exposure", "0.05", "--gain", "ISO 400"}));
  ASSERT_EQ(one["gains"].size(), 1u);
  EXPECT_EQ(one["advice"], all["gains"][1]);
}

TEST_F(Advise, WarmsTheSensorAndAveragesFrames) {
  const Words warm = with(night, {"--max-exposure", "0.05", "--dark-current", "1000"});
  EXPECT_EQ(advised(warm)["advice"]["largest_noise"], "dark current");
  const double cold_db = advised(with(warm, {"--temperature", "-50"}))["advice"]["snr_db"];
  const double warm_db = advised(warm)["advice"]["snr_db"];
  const double many_db = advised(with(warm, {"--frames", "100"}))["advice"]["snr_db"];
  EXPECT_GT(cold_db, warm_db + 3);
  EXPECT_NEAR(many_db, warm_db + 20, 1e-9);
}

TEST_F(Advise, WritesItsPageWholeAndNotOverAnother) {
  const Words words = with(night, {"--max-exposure", "0.05", "--report", file("page.html")});
  EXPECT_EQ(advise(words).exit_code, 0);
  const std::string page = test::read_file(file("page.html"));
  for (const char* part :
       {"<!DOCTYPE html>", "ISO 6400", "standard deviation of u", "SNR [dB]", "advised", "</html>"}) {
    EXPECT_TRUE(holds(page, part)) << part;
  }
  const auto again = advise(words);
  EXPECT_EQ(again.exit_code, 1);
  EXPECT_TRUE(holds(again.err, "--force")) << again.err;
  EXPECT_EQ(advise(with(words, {"--force"})).exit_code, 0);
}

TEST_F(Advise, OfAProfileSaturatesAsItsIsoSpeedsSay) {
  const Json json = advised({"--sensor", profile(true), "--luminance", "1", "--highlight", "10", "--f-number", "2.8",
                             "--max-exposure", "0.01"});
  ASSERT_EQ(json["gains"].size(), 2u);
  for (int i = 0; i < 2; ++i) {
    const double iso = i == 0 ? 100 : 800;
    // L / L_saturation with L_saturation = 78 N^2 / (0.65 S t), and no dark current.
    const double share = 10 * 0.65 * iso * 0.01 / (78 * 2.8 * 2.8);
    EXPECT_NEAR(json["gains"][i]["highlight_fraction_of_range"].get<double>() / share, 1, 1e-9);
    const double green_e = 32000 * 100 / iso * share / 10;
    const double variance_e2 = green_e + std::pow(400 / iso, 2) + std::pow(200 / iso, 2) / 12;
    EXPECT_NEAR(json["gains"][i]["snr"].get<double>() / (green_e * green_e / variance_e2), 1, 1e-9);
  }
  EXPECT_TRUE(holds(json["notes"].dump(), "ISO 50 is left out: the profile has no sensor figures of it"));
}

TEST_F(Advise, OfAProfileWithoutColoursAsksForACamera) {
  const Words words{"--sensor", profile(false), "--luminance", "1", "--highlight", "10", "--max-exposure", "0.01"};
  const auto refused = advise(words);
  EXPECT_EQ(refused.exit_code, 1);
  EXPECT_TRUE(holds(refused.err, "with --camera")) << refused.err;
  EXPECT_EQ(advise(with(words, {"--camera", "Nikon_D850"})).exit_code, 0);
}

TEST_F(Advise, OfARawFileFindsItsLuminances) {
  // Green sees D65 most, so that its pixels tell the luminance; ISO, f-number and time are in the file.
  simulated("flat", "flat.dng", {"--luminance", "0.5", "--gain", "ISO 1600", "--exposure", "0.05", "--size", "128x96"});
  const Words words{file("flat.dng"), "--sensor", "ELD_NikonD850", "--max-exposure", "0.05"};
  const Json json = advised(words);
  EXPECT_NEAR(json["midtone_cd_m2"].get<double>() / 0.5, 1, 0.02);  // of 6144 pixels with 40 e- or more each
  EXPECT_GT(json["highlight_cd_m2"], json["midtone_cd_m2"]);        // by noise alone
  EXPECT_TRUE(holds(json["notes"].dump(), "estimated from its f-number"));
  const Json given = advised(with(words, {"--luminance", "2", "--highlight", "3x"}));
  EXPECT_EQ(given["midtone_cd_m2"], 2);
  EXPECT_EQ(given["highlight_cd_m2"], 6);
}

TEST_F(Advise, OfAClippedRawFileSaysThatTheHighlightIsBrighter) {
  simulated("flat", "white.dng", {"--luminance", "500", "--gain", "ISO 1600", "--exposure", "0.05"});
  const Json json = advised({file("white.dng"), "--sensor", "ELD_NikonD850", "--max-exposure", "0.05"});
  EXPECT_TRUE(holds(json["notes"].dump(), "higher than estimated")) << json["notes"];
}

TEST_F(Advise, OfARawFileThatDoesNotTellItsExposureAsksForIt) {
  const std::string silent = LOWLUX_TESTDATA "/raws/nikon_dsc1339_crop_rggb14.dng";
  const Words words{silent, "--sensor", "ELD_NikonD850", "--max-exposure", "0.05"};
  const auto no_lens = advise(words);
  EXPECT_EQ(no_lens.exit_code, 1);
  EXPECT_TRUE(holds(no_lens.err, "give --f-number")) << no_lens.err;
  const auto no_light = advise(with(words, {"--f-number", "2"}));
  EXPECT_EQ(no_light.exit_code, 1);
  EXPECT_TRUE(holds(no_light.err, "give --luminance and --highlight")) << no_light.err;
  EXPECT_EQ(advise(with(words, {"--f-number", "2", "--luminance", "1", "--highlight", "9x"})).exit_code, 0);
}

TEST_F(Advise, RefusesWhatCannotBeInOneLine) {
  const Words good = with(night, {"--max-exposure", "0.05"});
  ASSERT_EQ(advise(good).exit_code, 0);
  struct Case {
    Words words;
    int exit_code;
    const char* says;
  };
  const auto of_sensor = [](const std::string& sensor) {
    return Words{"--sensor", sensor, "--luminance", "0.05", "--highlight", "20x", "--max-exposure", "0.05"};
  };
  const Words dim{"--sensor", "ELD_NikonD850", "--luminance", "0.05", "--max-exposure", "0.05"};
  const std::string some_file = LOWLUX_TESTDATA "/raws/nikon_dsc1339_crop_rggb14.dng";
  for (const Case& c : std::vector<Case>{
           {{"--luminance", "1", "--highlight", "9x", "--max-exposure", "1"}, 2, "needs --sensor"},
           {{"--sensor", "thesis", "--highlight", "9x", "--max-exposure", "1"}, 2, "needs --luminance"},
           {{"--sensor", "thesis", "--luminance", "1", "--max-exposure", "1"}, 2, "needs --highlight"},
           {night, 2, "needs a limit on the exposure time"},
           {with(good, {"--motion", "3"}), 2, "must be given together"},
           {with(good, {"--motion", "0", "--blur", "1"}), 2, "above 0"},
           {with(good, {some_file, some_file}), 2, "one raw file"},
           {with(dim, {"--highlight", "bright"}), 2, "neither a luminance"},
           {with(dim, {"--highlight", "0.5x"}), 2, "at least as bright"},
           {with(good, {"--report", file("page.txt")}), 2, ".html"},
           {with(good, {"--clip", "0.7"}), 2, "allowed to clip"},
           {with(good, {"--clip", "many"}), 2, "finite number"},
           {with(good, {"--patch", "0"}), 2, "a patch must have"},
           {with(good, {"--frames", "0"}), 2, "--frames"},
           {with(good, {"--temperature", "900"}), 2, "temperature"},
           {with(good, {"--f-number", "0"}), 2, "f-number"},
           {with(good, {"--illuminant", "D67"}), 2, "near it: D65"},
           {with(good, {"--camera", "Nikon_D851"}), 2, "Nikon_D850"},
           {with(good, {"--gain", "ISO 3"}), 2, "no figures for gain"},
           {with(good, {"--read-noise", "3"}), 2, "name it with --gain"},
           {with(good, {"--dark-current", "1,2"}), 2, "neither one number nor three"},
           {of_sensor("ELD_NikonD851"), 2, "ELD_NikonD850"},
           {of_sensor("QHY600"), 1, "--system-gain, --read-noise"},
           {of_sensor(file("none.json")), 1, "none.json"},
           {with(of_sensor(profile(true)), {"--read-noise", "3"}), 2, "change them there"},
           {with(of_sensor(profile(true)), {"--gain", "ISO 3"}), 1, "no requested gain setting of the profile"},
           {with(good, {file("none.dng")}), 1, "none.dng"}}) {
    const auto result = advise(c.words);
    EXPECT_EQ(result.exit_code, c.exit_code) << testing::PrintToString(c.words) << result.err;
    EXPECT_TRUE(holds(result.err, c.says)) << testing::PrintToString(c.words) << result.err;
    EXPECT_EQ(std::count(result.err.begin(), result.err.end(), '\n'), 1) << result.err;
    EXPECT_EQ(result.out, "");
  }
}

TEST_F(Advise, OptionsDoNothingWithoutAdviseAndAreRefused) {
  const auto result = lowlux({"info", LOWLUX_TESTDATA "/raws/nikon_dsc1339_crop_rggb14.dng", "--luminance", "1"});
  EXPECT_EQ(result.exit_code, 2);
  EXPECT_TRUE(holds(result.err, "--luminance requires --advise")) << result.err;
}

}  // namespace
}  // namespace lowlux
