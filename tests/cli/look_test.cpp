#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "tests/cli/simulate_command.h"

namespace lowlux {
namespace {

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
  refused({"--display-luminance", "0"}, "luminance in cd/m2");
  refused({"--display-luminance", "2", "--space", "linear-srgb"}, "sRGB");
}

TEST_F(LookCommand, AsksForTheLuminanceThatTheFileDoesNotTell) {
  const std::string raw = std::string(LOWLUX_TESTDATA) + "/raws/infiniteisp_indoor1_grbg8.dng";
  const auto result = developed({"--look", "eye"}, raw);
  EXPECT_EQ(result.exit_code, 1);
  EXPECT_NE(result.err.find("--scene-luminance"), std::string::npos) << result.err;
  EXPECT_FALSE(std::filesystem::exists(file("seen.png")));
}

}  // namespace
}  // namespace lowlux
