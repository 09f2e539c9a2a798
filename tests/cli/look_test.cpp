#include <gtest/gtest.h>

#include <algorithm>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <string>
#include <utility>
#include <vector>

#include <nlohmann/json.hpp>

#include "isp/model/vision/scene_light.h"
#include "tests/cli/simulate/simulate_command.h"

namespace lowlux {
namespace {

using test::lowlux;

using Json = nlohmann::json;

class LookCommand : public test::SimulateCommand {
 protected:
  void SetUp() override {
    simulated("chart:macbeth", "night.dng", {"--luminance", "0.2", "--size", "96x64", "--no-truth"});
  }
  test::ProcessResult developed(const std::vector<std::string>& more, const std::string& raw) {
    std::vector<std::string> args{"develop", raw, "-o", file("seen.png"), "--force", "--json"};
    args.insert(args.end(), more.begin(), more.end());
    return lowlux(args);
  }
  Json look_of(const std::vector<std::string>& more) {
    const auto result = developed(more, file("night.dng"));
    EXPECT_EQ(result.exit_code, 0) << result.err;
    const Json json = Json::parse(result.out, nullptr, false);
    return json.is_array() && !json.empty() ? json[0] : Json();
  }
  void refused(const std::vector<std::string>& more, const std::string& why) {
    std::filesystem::remove(file("seen.png"));
    const auto result = developed(more, file("night.dng"));
    EXPECT_EQ(result.exit_code, 2) << result.err;
    EXPECT_NE(result.err.find(why), std::string::npos) << why << "\n" << result.err;
    EXPECT_FALSE(std::filesystem::exists(file("seen.png")));
  }
};

TEST_F(LookCommand, OfTheEyeTellsWhatItGoesByAndShows) {
  const Json eye = look_of({"--look", "eye"})["look"];
  EXPECT_EQ(eye["name"], "eye");
  EXPECT_EQ(eye["luminance_rule"], "exposure");
  EXPECT_GT(eye["scene_luminance_cd_m2"], 0.01);
  EXPECT_LT(eye["scene_luminance_cd_m2"], 0.5);
  EXPECT_LT(eye["dimming_ev"], 0);
  ASSERT_EQ(eye["effects"].size(), 6);
  EXPECT_EQ(eye["effects"][0]["name"], "purkinje");
  EXPECT_EQ(eye["effects"][0]["shown"], true);
  EXPECT_EQ(eye["effects"][4]["shown"], false) << "glare is shown on request";
  const Json listed = look_of({"--look", "eye", "--effects", "glare,visual-noise", "--scene-luminance", "3"})["look"];
  EXPECT_EQ(listed["scene_luminance_cd_m2"], 3);
  EXPECT_EQ(listed["luminance_rule"], "given");
  for (int k = 0; k < 6; ++k) EXPECT_EQ(listed["effects"][k]["shown"], k >= 4);
}

TEST_F(LookCommand, OfAModelNamesItsTableAndCoefficients) {
  const Json shin = look_of({"--look", "shin"})["look"];
  EXPECT_EQ(shin["coefficients"], "SHIN-SUB-1");
  EXPECT_LT(shin["table_mean_ciede2000"], 0.5);
  const Json dim = look_of({"--display-luminance", "2"});
  EXPECT_TRUE(dim["look"].is_null());
  EXPECT_EQ(dim["display"]["coefficients"], "SHIN-SUB-1");
  EXPECT_EQ(dim["display"]["display_cd_m2"], 2);
}

TEST_F(LookCommand, TakesCoefficientsFromAFile) {
  std::ofstream(file("shin.csv")) << "0.01,0.2,0.8,0.1,0,0.1,0\n1000,1,0,1,0,1,0\n";
  std::ofstream(file("bad.csv")) << "0.01,0.2,0.8\n";
  const Json shin = look_of({"--look", "shin", "--coefficients", file("shin.csv")})["look"];
  EXPECT_EQ(shin["coefficients"], file("shin.csv"));
  const Json dim = look_of({"--display-luminance", "2", "--coefficients", file("shin.csv")});
  EXPECT_EQ(dim["display"]["coefficients"], file("shin.csv"));
  std::filesystem::remove(file("seen.png"));
  const auto bad = developed({"--look", "shin", "--coefficients", file("bad.csv")}, file("night.dng"));
  EXPECT_EQ(bad.exit_code, 1);
  EXPECT_NE(bad.err.find("bad.csv"), std::string::npos) << bad.err;
  EXPECT_FALSE(std::filesystem::exists(file("seen.png")));
}

TEST_F(LookCommand, RefusesWhatDoesNotFit) {
  refused({"--coefficients", "shin.csv"}, "--look shin");
  refused({"--look", "owl"}, "is none of camera, eye, ");
  refused({"--scene-luminance", "1"}, "--look eye");
  refused({"--look", "shin", "--effects", "purkinje"}, "--look eye");
  refused({"--look", "shin", "--effects", "glare", "--dimming", "0.5", "--scene-luminance", "1"}, "--effects");
  refused({"--look", "eye", "--scene-luminance", "0"}, "1e-07");
  refused({"--look", "eye", "--scene-luminance", "-3"}, "1e-07");
  refused({"--look", "eye", "--effects", "purkinje,fog"}, "'fog'");
  refused({"--look", "eye", "--dimming", "2"}, "from 0 to 1");
  refused({"--noise-limit", "0"}, "neither off nor a lightness");
  refused({"--display-luminance", "0"}, "is not a luminance from");
  refused({"--display-luminance", "2", "--space", "linear-srgb"}, "sRGB");
}

TEST_F(LookCommand, WritesTheProbabilityOfSeeingNextToThePicture) {
  const auto plain = lowlux({"develop", file("night.dng"), "-o", file("plain.png"), "--look", "eye"});
  ASSERT_EQ(plain.exit_code, 0) << plain.err;
  const std::vector<std::string> args{"develop", file("night.dng"), "-o",     file("seen.png"),    "--look",
                                      "eye",     "--seeing-map",    "--json", "--scene-luminance", "0.00003"};
  const auto first = lowlux(args);
  ASSERT_EQ(first.exit_code, 0) << first.err;
  const Json retina = Json::parse(first.out)[0]["look"]["retina"];
  EXPECT_GT(retina["pupil_mm"], 7);
  EXPECT_LT(retina["pupil_mm"], 8);
  EXPECT_GT(retina["rod_isomerisations_per_s"], 0.001);
  EXPECT_LT(retina["rod_isomerisations_per_s"], 0.1) << "one in a rod every half minute or so";
  EXPECT_GT(retina["rod_threshold"], 5);
  EXPECT_LE(retina["false_alarm_rate"], 0.01);
  EXPECT_GT(retina["seen_fraction"], 0.1);
  EXPECT_LT(retina["seen_fraction"], 1);
  std::ifstream map(file("seen.seeing.pfm"), std::ios::binary);
  std::string kind, width, height;
  map >> kind >> width >> height;
  EXPECT_EQ(kind, "Pf");
  EXPECT_EQ(width + "x" + height, "24x16") << "a sample for 4x4 pixels";

  std::filesystem::remove(file("seen.png"));
  const auto again = lowlux(args);
  EXPECT_EQ(again.exit_code, 1) << "the map exists";
  EXPECT_NE(again.err.find("seen.seeing.pfm"), std::string::npos) << again.err;
  EXPECT_FALSE(std::filesystem::exists(file("seen.png")));

  const auto explained = lowlux(
      {"develop", file("night.dng"), "-o", file("seen.png"), "--look", "eye", "--seeing-map", "--force", "--explain"});
  EXPECT_EQ(explained.exit_code, 0) << explained.err;
  for (const char* word : {"retina", "pupil", "in a rod", "seeing", "false alarms"}) {
    EXPECT_NE(explained.out.find(word), std::string::npos) << word << explained.out;
  }
  EXPECT_EQ(test::read_file(file("seen.png")), test::read_file(file("plain.png"))) << "the picture stays as it is";
}

TEST_F(LookCommand, TurnsTheMapOfSeeingUprightLikeThePicture) {
  const auto map_of = [&](const std::string& raw) {
    const auto made = lowlux({"develop", raw, "-o", file("seen.png"), "--look", "eye", "--seeing-map", "--force",
                              "--scene-luminance", "0.00003"});
    EXPECT_EQ(made.exit_code, 0) << made.err;
    std::string map = test::read_file(file("seen.seeing.pfm"));
    std::vector<float> samples(24 * 16);
    EXPECT_GT(map.size(), sizeof(float) * samples.size());
    std::memcpy(samples.data(), map.data() + map.size() - sizeof(float) * samples.size(),
                sizeof(float) * samples.size());
    return std::pair(map.substr(3, 5), samples);
  };
  std::string raw = test::read_file(file("night.dng"));
  const std::string orientation{"\x12\x01\x03\0\x01\0\0\0\x01", 9};  // tag 274, a short: 1, normal
  const std::size_t at = raw.find(orientation);
  ASSERT_NE(at, std::string::npos);
  raw[at + 8] = 6;  // turned by 90 degrees
  std::ofstream(file("turned.dng"), std::ios::binary) << raw;
  const auto [size, normal] = map_of(file("night.dng"));
  const auto [turned_size, turned] = map_of(file("turned.dng"));
  EXPECT_EQ(size, "24 16");
  EXPECT_EQ(turned_size, "16 24");
  for (int y = 0; y < 16; ++y) {  // rows of a PFM go from the bottom up
    for (int x = 0; x < 24; ++x) ASSERT_EQ(turned[(23 - x) * 16 + y], normal[y * 24 + x]) << x << "," << y;
  }
}

TEST_F(LookCommand, WritesAMapOfSeeingForEachFileOfABatch) {
  std::filesystem::copy_file(file("night.dng"), file("other.dng"));
  const auto both =
      lowlux({"develop", file("night.dng"), file("other.dng"), "-o", file("out/"), "--look", "eye", "--seeing-map"});
  ASSERT_EQ(both.exit_code, 0) << both.err;
  for (const char* map : {"out/night.seeing.pfm", "out/other.seeing.pfm"}) {
    EXPECT_TRUE(std::filesystem::exists(file(map))) << map;
  }
}

TEST_F(LookCommand, HasAMapOfSeeingForFilesAndTheEyeAlone) {
  refused({"--seeing-map"}, "--seeing-map requires --look eye");
  refused({"--look", "shin", "--seeing-map"}, "--seeing-map requires --look eye");
  const auto live = lowlux({"capture", "--v4l2", "/dev/video0", "--live", "--look", "eye", "--seeing-map"});
  EXPECT_EQ(live.exit_code, 2);
  EXPECT_NE(live.err.find("--seeing-map"), std::string::npos) << live.err;
  const Json plain = look_of({"--look", "eye"})["look"];
  EXPECT_TRUE(plain["retina"].is_null());
  const Json noisy = look_of({"--look", "eye", "--effects", "visual-noise"})["look"];
  EXPECT_GT(noisy["retina"]["cone_isomerisations_per_s"], 0);
  EXPECT_TRUE(noisy["retina"]["seen_fraction"].is_null()) << "no map, no count";
}

TEST_F(LookCommand, AsksForTheLuminanceThatTheFileDoesNotTell) {
  const std::string raw = std::string(LOWLUX_TESTDATA) + "/raws/infiniteisp_indoor1_grbg8.dng";
  const auto result = developed({"--look", "eye"}, raw);
  EXPECT_EQ(result.exit_code, 1);
  EXPECT_NE(result.err.find("--scene-luminance"), std::string::npos) << result.err;
  EXPECT_FALSE(std::filesystem::exists(file("seen.png")));
}

TEST_F(LookCommand, TakesTheLightByNameRatioAndSpectrum) {
  const Json unknown = look_of({"--look", "eye"})["look"];
  EXPECT_TRUE(unknown["light"].is_null());
  EXPECT_EQ(unknown["light_rule"], "white");
  EXPECT_EQ(unknown["adaptation_degree"], 1);
  const Json sodium = look_of({"--look", "eye", "--light", "hps_GENERIC"})["look"];
  EXPECT_EQ(sodium["light"], "HPS_generic");
  EXPECT_EQ(sodium["light_rule"], "spectrum");
  EXPECT_LT(sodium["white_scotopic_ratio"], 0.7);
  EXPECT_LT(sodium["adaptation_degree"], 0.83) << "CIE 159 in the dark: 0.824";
  EXPECT_EQ(sodium["rods_source"], "xyz") << "the file states no camera";
  const Json given = look_of({"--look", "wanat_mantiuk", "--light", "0.6", "--adaptation-degree", "0.5"})["look"];
  EXPECT_TRUE(given["light"].is_null());
  EXPECT_EQ(given["light_rule"], "given");
  EXPECT_EQ(given["white_scotopic_ratio"], 0.6);
  EXPECT_EQ(given["adaptation_degree"], 0.5);
  std::ofstream(file("even.csv")) << "wavelength_nm,power\n360,1\n830,1\n";
  const Json even = look_of({"--look", "eye", "--light", file("even.csv")})["look"];
  EXPECT_EQ(even["light"], file("even.csv"));
  EXPECT_NEAR(even["white_scotopic_ratio"], 2.26, 0.005) << "equal energy";
  const auto explained = lowlux({"develop", file("night.dng"), "-o", file("seen.png"), "--force", "--look", "eye",
                                 "--light", "LPS", "--explain"});
  EXPECT_NE(explained.out.find("LPS, S/P ratio 0.2"), std::string::npos) << explained.out;
}

TEST_F(LookCommand, FitsRodsOnTheCameraOfAProfile) {
  simulated("chart:macbeth", "d850.dng",
            {"--luminance", "0.2", "--size", "96x64", "--no-truth", "--sensor", "ELD_NikonD850", "--gain", "ISO 1600"});
  const std::string profile = std::string(LOWLUX_TESTDATA) + "/../calib/profiles/ELD_NikonD850.json";
  const auto result = developed({"--look", "eye", "--light", "HPS_generic", "--profile", profile}, file("d850.dng"));
  ASSERT_EQ(result.exit_code, 0) << result.err;
  EXPECT_EQ(Json::parse(result.out)[0]["look"]["rods_source"], "Nikon_D850");
}

TEST_F(LookCommand, TakesWeightsOfRodsFromAProfile) {
  const std::string own = file("own.json");
  ASSERT_EQ(
      lowlux({"calibrate", "colour", "--camera", "Nikon_D5100", "--illuminant", "HPS_generic", "-o", own}).exit_code,
      0);
  Json profile = Json::parse(std::ifstream(own));
  const Json weights = profile["colours"][0]["scotopic_weights"];
  const double ratio = isp::light_of_lamp("HPS_generic")->scotopic_ratio;
  EXPECT_NEAR(weights["red"].get<double>() + weights["green"].get<double>() + weights["blue"].get<double>(), ratio,
              1e-12);
  profile["model"] = "";
  std::ofstream(own) << profile;
  const auto source_under = [&](const char* light) {
    return look_of({"--look", "eye", "--light", light, "--profile", own})["look"]["rods_source"];
  };
  EXPECT_EQ(source_under("hps_generic"), "profile");
  EXPECT_EQ(source_under("LPS"), "xyz") << "the weights are those of another lamp";
}

TEST_F(LookCommand, RefusesLightsThatAreNone) {
  refused({"--light", "LPS"}, "--look eye");
  refused({"--adaptation-degree", "0.5"}, "--look eye");
  refused({"--look", "eye", "--light", "candle"}, "the lights are HPS_generic, ");
  refused({"--look", "eye", "--light", "0.05"}, "0.1 to 60");
  refused({"--look", "eye", "--light", "2,4"}, "write decimals with a point: 2.4");
  refused({"--look", "eye", "--adaptation-degree", "2"}, "from 0 to 1");
  const auto broken = [&](const std::string& table, const std::string& why) {
    std::ofstream(file("light.csv")) << table;
    std::filesystem::remove(file("seen.png"));
    const auto result = developed({"--look", "eye", "--light", file("light.csv")}, file("night.dng"));
    EXPECT_EQ(result.exit_code, 1) << table;
    EXPECT_NE(result.err.find("light.csv"), std::string::npos) << result.err;
    EXPECT_NE(result.err.find(why), std::string::npos) << why << "\n" << result.err;
    EXPECT_EQ(std::count(result.err.begin(), result.err.end(), '\n'), 1) << result.err;
    EXPECT_FALSE(std::filesystem::exists(file("seen.png"))) << table;
  };
  broken("", "no row of names");
  broken("400,1\n700,1\n", "must name the columns");
  broken("wavelength_nm,power\n", "at least two wavelengths");
  broken("wavelength_nm,power\n400,1\n700,-1\n", "negative");
  broken("wavelength_nm,power\n400,1\n700,nan\n", "not a finite number");
  broken("wavelength_nm,power\n700,1\n400,1\n", "must rise");
  broken("wavelength_nm,a,b\n400,1,1\n700,1,1\n", "a light must be one spectrum");
  broken("wavelength_nm,power\n400,0\n700,0\n", "no luminance");
  broken("wavelength_nm,power\n699,0\n700,1\n701,0\n", "0.1 to 60");
  std::filesystem::remove(file("light.csv"));
  EXPECT_EQ(developed({"--look", "eye", "--light", file("light.csv")}, file("night.dng")).exit_code, 1);
}

}  // namespace
}  // namespace lowlux
