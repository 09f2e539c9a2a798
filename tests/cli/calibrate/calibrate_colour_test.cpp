#include <gtest/gtest.h>

#include <algorithm>
#include <cstddef>
#include <filesystem>
#include <string>
#include <utility>
#include <vector>

#include <nlohmann/json.hpp>

#include "calib/profile/profile_io.h"
#include "isp/base/matrix3.h"
#include "isp/output/dng/dng_writer.h"
#include "tests/cli/command.h"
#include "tests/support/chart_photograph.h"
#include "tests/support/process.h"
#include "tests/support/scratch_directory.h"
#include "tests/support/synthetic_chart.h"

namespace lowlux {
namespace {

using test::raws;

using Json = nlohmann::json;

const std::string kiss_x4 = raws + "canon_kissx4_ml_colorchart.dng";
const std::string rose = raws + "nikon_dsc1339_crop_rggb14.dng";

class CalibrateColour : public testing::Test {
 protected:
  static test::ProcessResult calibrate(std::vector<std::string> args) {
    const std::vector<std::string> verb{test::tested_command(), "calibrate", "colour"};
    args.insert(args.begin(), verb.begin(), verb.end());
    return test::run_process(args);
  }
  std::string file(const std::string& name) const { return scratch_.file(name); }
  CameraProfile profile(const std::string& name) const {
    const auto read = calib::parse_profile(test::read_file(file(name)));
    EXPECT_TRUE(read) << (read ? "" : read.error().message);
    return read.value_or(CameraProfile{});
  }
  /// A photographed chart of known colours, as a raw file.
  std::string simulated(const std::string& name, const test::ChartPhotograph& photograph = {}) const {
    const auto chart = test::photograph_chart({});
    RawFrame frame = test::photograph_patches(photograph, chart->camera_rgb);
    frame.colour = chart->colour;
    EXPECT_TRUE(isp::write_dng(frame, file(name)));
    return file(name);
  }
  bool left_nothing() const { return std::filesystem::is_empty(scratch_.path()); }

  test::ScratchDirectory scratch_;
};

TEST_F(CalibrateColour, FindsTheChartOnTheKissX4AndReportsIt) {
  const auto result =
      calibrate({kiss_x4, "-o", file("p.json"), "--json", "--report", file("r.html"), "--overlay", file("o.png")});
  ASSERT_EQ(result.exit_code, 0) << result.err;
  const Json json = Json::parse(result.out);
  // Where a person sees the chart's corners, to a third of a patch (108 px).
  const std::vector<std::vector<double>> corners{{664, 578}, {1306, 578}, {1312, 978}, {650, 982}};
  for (std::size_t i = 0; i < 4; ++i) {
    EXPECT_NEAR(json["chart"]["corners_px"][i][0].get<double>(), corners[i][0], 36) << i;
    EXPECT_NEAR(json["chart"]["corners_px"][i][1].get<double>(), corners[i][1], 36) << i;
  }
  ASSERT_EQ(json["matrices"].size(), 4U);
  const auto mean = [&](std::size_t i) { return json["matrices"][i]["mean_ciede2000"].get<double>(); };
  EXPECT_GT(mean(0), 10);       // as shot: the camera balanced to the dusk outside, the chart stands in lamp light
  EXPECT_LT(mean(2), mean(1));  // fitted against the file's own
  EXPECT_LT(mean(2), 3);        // CIEDE2000, usual for a chart with some glare on its black
  EXPECT_GT(mean(3), mean(2));  // left out against fitted
  EXPECT_EQ(json["illuminant"], "A");

  const CameraProfile written = profile("p.json");
  EXPECT_EQ(written.model, "Canon EOS Kiss X4");
  ASSERT_EQ(written.colours.size(), 1U);
  EXPECT_EQ(written.colours[0].patches_ciede2000, mean(2));
  EXPECT_EQ(written.colours[0].cross_validated_ciede2000, mean(3));
  EXPECT_EQ(written.colours[0].provenance.files, std::vector<std::string>{kiss_x4});
  EXPECT_NE(test::read_file(file("r.html")).find("left-out"), std::string::npos);
  EXPECT_GT(std::filesystem::file_size(file("o.png")), 10000U);
}

TEST_F(CalibrateColour, PrintsATableOfThePatches) {
  const auto result = calibrate({simulated("chart.dng"), "-o", file("p.json"), "--illuminant", "D65"});
  ASSERT_EQ(result.exit_code, 0) << result.err;
  for (const char* word :
       {"dark_skin", "black_2_1p5_D", "before", "after", "left-out", "condition", "D65", "as asked"}) {
    EXPECT_NE(result.out.find(word), std::string::npos) << word << "\n" << result.out;
  }
  EXPECT_EQ(result.err, "");
}

TEST_F(CalibrateColour, RecoversTheLightsFallAndTheCameraFromASimulatedChart) {
  const auto chart = test::photograph_chart({});
  const std::string raw = simulated("chart.dng", {.angle_deg = 20, .light_x = 0.1, .light_y = -0.05});
  const auto result = calibrate({raw, "-o", file("p.json"), "--illuminant", "D65", "--json"});
  ASSERT_EQ(result.exit_code, 0) << result.err;
  const Json json = Json::parse(result.out);
  EXPECT_NEAR(json["chart"]["light_per_x"].get<double>(), 0.1,
              0.02);  // no matrix is exact for the camera: 2 % of light
  EXPECT_NEAR(json["chart"]["light_per_y"].get<double>(), -0.05, 0.02);
  const auto white = profile("p.json").colours[0].calibration.xyz_to_camera * vector_of(chart->scene_white);
  for (std::size_t c = 0; c < 3; ++c) EXPECT_NEAR(white[c], (*chart->colour.as_shot_neutral)[c], 0.02) << c;
}

TEST_F(CalibrateColour, PreservesWhiteAndKeepsTheLightEvenWhereAsked) {
  const std::string raw = simulated("chart.dng");
  const auto result = calibrate({raw, "-o", file("p.json"), "--preserve-white", "--even-light", "--json"});
  ASSERT_EQ(result.exit_code, 0) << result.err;
  const Json json = Json::parse(result.out);
  EXPECT_EQ(json["chart"]["light_per_x"], 0);
  const auto chart = test::photograph_chart({});
  const Vector3 white = profile("p.json").colours[0].calibration.xyz_to_camera * vector_of(chart->scene_white);
  for (std::size_t c = 0; c < 3; ++c) {
    EXPECT_NEAR(white[c], json["chart"]["neutral"][c].get<double>(), 1e-6) << c;  // of rounded white points
  }
  EXPECT_EQ(json["illuminant"], "D65");  // found by the chart's neutral
}

TEST_F(CalibrateColour, AddsToAProfileAndReplacesTheSameIlluminant) {
  const std::string raw = simulated("chart.dng");
  ASSERT_EQ(calibrate({raw, "-o", file("one.json"), "--illuminant", "D65"}).exit_code, 0);
  ASSERT_EQ(calibrate({raw, "-o", file("two.json"), "--illuminant", "A", "--add-to", file("one.json")}).exit_code, 0);
  const CameraProfile two = profile("two.json");
  ASSERT_EQ(two.colours.size(), 2U);
  EXPECT_EQ(two.colours[0].illuminant, "A");
  EXPECT_EQ(two.colours[1].illuminant, "D65");
  ASSERT_EQ(
      calibrate({raw, "-o", file("two.json"), "--illuminant", "A", "--add-to", file("two.json"), "--force"}).exit_code,
      0);
  EXPECT_EQ(profile("two.json").colours.size(), 2U);
  const auto other = calibrate({kiss_x4, "-o", file("three.json"), "--add-to", file("one.json")});
  EXPECT_EQ(other.exit_code, 1);
  EXPECT_NE(other.err.find("the profile is of \"Maker Model 1\""), std::string::npos) << other.err;
  EXPECT_FALSE(std::filesystem::exists(file("three.json")));
}

TEST_F(CalibrateColour, MakesAProfileOfSpectralSensitivities) {
  const auto result = calibrate(
      {"--camera", "Nikon_D5100", "--illuminant", "D65", "-o", file("p.json"), "--json", "--report", file("r.html")});
  ASSERT_EQ(result.exit_code, 0) << result.err;
  const Json json = Json::parse(result.out);
  ASSERT_EQ(json["matrices"].size(), 3U);
  EXPECT_EQ(json["matrices"][2]["matrix"], "fitted");
  EXPECT_LT(json["matrices"][2]["mean_ciede2000"], json["matrices"][1]["mean_ciede2000"]);
  EXPECT_GT(json["condition_number"], 1);
  EXPECT_EQ(profile("p.json").colours[0].illuminant, "D65");
}

TEST_F(CalibrateColour, ReadsSensitivitiesPerPhotonAndPerPower) {
  const std::string power = "nm,r,g,b\n400,0,0.1,1\n500,0.1,1,0.3\n600,1,0.4,0.05\n700,0.2,0.05,0.01\n";
  const std::string photon =
      "nm,r,g,b\n400,0,0.1375,1.375\n500,0.11,1.1,0.33\n600,0.9166666666666667,0.3666666666666667,"
      "0.04583333333333333\n700,0.15714285714285714,0.03928571428571429,0.007857142857142857\n";
  test::write_file(file("power.csv"), power.data(), power.size());
  test::write_file(file("photon.csv"), photon.data(), photon.size());
  const auto a = calibrate({"--camera", file("power.csv"), "-o", file("a.json"), "--json"});
  const auto b = calibrate({"--camera", file("photon.csv"), "--per-photon", "-o", file("b.json"), "--json"});
  ASSERT_EQ(a.exit_code, 0) << a.err;
  ASSERT_EQ(b.exit_code, 0) << b.err;
  // The same values at the nodes: 1e-9 relative for the decimals written.
  EXPECT_NEAR(Json::parse(a.out)["condition_number"], Json::parse(b.out)["condition_number"].get<double>(), 1e-7);
}

TEST_F(CalibrateColour, RefusesBadInputInOneLineAndLeavesNothing) {
  const std::vector<std::pair<std::vector<std::string>, std::string>> bad{
      {{rose}, "no chart found"},
      {{file("none.dng")}, "none.dng"},
      {{kiss_x4, "--illuminant", "D99"}, "unknown light 'D99'"},
      {{"--camera", "Nikon_D51"}, "near it: Nikon_D5100"},
      {{"--camera", "zzzzzz"}, "lowlux simulate --list"},
      {{"--camera", "Nikon_D5100", "--per-photon"}, "per unit of power"},
      {{"--camera", file("none.csv")}, "none.csv"},
      {{kiss_x4, "--overlay", file("no/such/o.png")}, "create it first"},
  };
  for (const auto& [args, expected] : bad) {
    auto words = args;
    words.insert(words.end(), {"-o", file("p.json")});
    const auto result = calibrate(words);
    const std::string said = testing::PrintToString(words) + result.err;
    EXPECT_EQ(result.exit_code, 1) << said;
    EXPECT_EQ(result.out, "") << said;
    EXPECT_NE(result.err.find(expected), std::string::npos) << said;
    EXPECT_EQ(std::count(result.err.begin(), result.err.end(), '\n'), 1) << said;
    EXPECT_TRUE(left_nothing()) << said;
  }
  const auto json = calibrate({rose, "-o", file("p.json"), "--json"});
  EXPECT_EQ(json.exit_code, 1);
  EXPECT_TRUE(Json::parse(json.out).contains("error")) << json.out;
}

TEST_F(CalibrateColour, RefusesSensitivitiesThatAreNotIndependent) {
  const std::string table = "nm,r,g,b\n400,1,1,1\n500,1,1,1\n600,1,1,1\n700,1,1,1\n";
  test::write_file(file("flat.csv"), table.data(), table.size());
  const auto flat = calibrate({"--camera", file("flat.csv"), "-o", file("p.json")});
  EXPECT_EQ(flat.exit_code, 1);
  EXPECT_NE(flat.err.find("flat.csv"), std::string::npos) << flat.err;
  const std::string two = "nm,r,g\n400,1,1\n500,1,1\n";
  test::write_file(file("two.csv"), two.data(), two.size());
  EXPECT_NE(calibrate({"--camera", file("two.csv"), "-o", file("p.json")}).err.find("the table has 2"),
            std::string::npos);
  EXPECT_FALSE(std::filesystem::exists(file("p.json")));
}

TEST_F(CalibrateColour, OverwritesOnlyWithForce) {
  const std::vector<std::string> args{"--camera", "Nikon_D5100", "-o", file("p.json")};
  ASSERT_EQ(calibrate(args).exit_code, 0);
  const auto again = calibrate(args);
  EXPECT_EQ(again.exit_code, 1);
  EXPECT_NE(again.err.find("--force"), std::string::npos) << again.err;
}

TEST_F(CalibrateColour, RefusesWrongCommandLines) {
  const std::vector<std::vector<std::string>> wrong{
      {},
      {kiss_x4},
      {"-o", file("p.json")},
      {kiss_x4, "--camera", "Nikon_D5100", "-o", file("p.json")},
      {kiss_x4, "-o", file("p.txt")},
      {kiss_x4, "-o", file("p.json"), "--report", file("r.txt")},
      {kiss_x4, "-o", file("p.json"), "--overlay", file("o.gif")},
      {kiss_x4, "-o", file("p.json"), "--overlay", file("o.exr")},
      {kiss_x4, "-o", file("p.json"), "--per-photon"},
      {"--camera", "Nikon_D5100", "-o", file("p.json"), "--overlay", file("o.png")},
      {"--camera", "Nikon_D5100", "-o", file("p.json"), "--preserve-white"},
      {"--camera", "Nikon_D5100", "-o", file("p.json"), "--even-light"},
      {kiss_x4, "-o", file("p.json"), "--no-such-option"},
  };
  for (const auto& args : wrong) {
    const auto result = calibrate(args);
    EXPECT_EQ(result.exit_code, 2) << testing::PrintToString(args) << result.err;
    EXPECT_EQ(std::count(result.err.begin(), result.err.end(), '\n'), 1) << result.err;
  }
  EXPECT_TRUE(left_nothing());
  const auto help = calibrate({"--help"});
  EXPECT_EQ(help.exit_code, 0);
  EXPECT_NE(help.out.find("--illuminant"), std::string::npos);
}

}  // namespace
}  // namespace lowlux
