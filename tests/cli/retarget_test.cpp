#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <string>
#include <utility>
#include <vector>

#include <nlohmann/json.hpp>

#include "capture/file/picture_source.h"
#include "isp/base/executor.h"
#include "isp/output/picture/image_writer.h"
#include "tests/cli/simulate/simulate_command.h"

namespace lowlux {
namespace {

using Json = nlohmann::json;
using test::lowlux;

// A ramp of grey above a ramp of a muted red.
class RetargetCommand : public test::SimulateCommand {
 protected:
  void SetUp() override {
    Encoded8 picture{Plane<std::uint8_t>(3 * 64, 16)};
    for (int y = 0; y < 16; ++y) {
      for (int x = 0; x < 64; ++x) {
        for (int c = 0; c < 3; ++c) {
          picture.codes.at(3 * x + c, y) = static_cast<std::uint8_t>(y < 8 || c == 0 ? 4 * x : 3 * x);
        }
      }
    }
    InlineExecutor one;
    ASSERT_TRUE(isp::write_picture(Picture(std::move(picture)), OutputSpace::srgb, {}, file("in.png"), {}, one));
  }

  test::ProcessResult run(const std::string& out, const std::vector<std::string>& more) {
    std::vector<std::string> args{"retarget", file("in.png"), "-o", file(out)};
    args.insert(args.end(), more.begin(), more.end());
    return lowlux(args);
  }
  SceneLinear picture(const std::string& name) {
    InlineExecutor one;
    auto read = capture::read_picture(file(name), one);
    EXPECT_TRUE(read);
    return read ? std::move(read->xyz) : SceneLinear(64, 16);
  }
  // X over Y of D65 is 0.9505: how far a pixel is from it.
  static double redness(const SceneLinear& xyz, int x, int y) {
    return static_cast<double>(xyz.plane[0].at(x, y)) / xyz.plane[1].at(x, y) - 0.9505;
  }
  void refused(const std::vector<std::string>& more, int exit_code, const std::string& why) {
    const auto result = run("none.png", more);
    EXPECT_EQ(result.exit_code, exit_code) << result.err;
    EXPECT_NE(result.err.find(why), std::string::npos) << why << "\n" << result.err;
    EXPECT_FALSE(std::filesystem::exists(file("none.png")));
  }
};

TEST_F(RetargetCommand, GivesAPictureColourForADimDisplayAndLeavesGreyGrey) {
  const auto result = run("out.png", {"--json"});
  ASSERT_EQ(result.exit_code, 0) << result.err;
  const Json told = Json::parse(result.out);
  EXPECT_EQ(told["model"], "constrained");
  EXPECT_EQ(told["coefficients"], "SHIN-SUB-1");
  EXPECT_EQ(told["units"], "lux");
  EXPECT_EQ(told["display_cd_m2"], 2);
  EXPECT_LE(told["table_mean_ciede2000"].get<double>(), 0.5);
  EXPECT_GE(told["fraction_beyond_gamut"].get<double>(), 0);
  EXPECT_LT(told["fraction_beyond_gamut"].get<double>(), 1);
  const SceneLinear before = picture("in.png"), after = picture("out.png");
  EXPECT_GT(redness(after, 40, 12), 1.3 * redness(before, 40, 12));
  for (int x = 8; x < 64; ++x) EXPECT_LT(std::abs(redness(after, x, 4)), 1e-3) << x << ": equal codes";
}

TEST_F(RetargetCommand, EqualDisplaysChangeNothingInAnyFormat) {
  const SceneLinear before = picture("in.png");
  for (const char* name : {"a.png", "a.tif", "a.pfm"}) {
    std::vector<std::string> more{"--display-luminance", "250", "--quiet"};
    if (std::string(name) == "a.tif") more.insert(more.end(), {"--bits", "16"});
    const auto result = run(name, more);
    ASSERT_EQ(result.exit_code, 0) << result.err;
    EXPECT_EQ(result.out, "");
    const SceneLinear after = picture(name);
    for (int x = 0; x < 64; ++x) {
      for (int k = 0; k < 3; ++k) EXPECT_NEAR(after.plane[k].at(x, 12), before.plane[k].at(x, 12), 5e-4) << name;
    }
  }
}

TEST_F(RetargetCommand, CoefficientsAreReadFromAFile) {
  std::ofstream(file("mine.csv")) << "E,alpha,beta,l,a,m,b\n0.1,1,0,0.9,0,0.9,0\n1000,1,0,1,0,1,0\n";
  const auto result = run("out.png", {"--coefficients", file("mine.csv"), "--units", "luminance", "--model", "shin"});
  ASSERT_EQ(result.exit_code, 0) << result.err;
  EXPECT_NE(result.out.find("mine.csv, by luminance"), std::string::npos) << result.out;
  EXPECT_NE(result.out.find("250 to 2 cd/m2"), std::string::npos) << result.out;
  std::ofstream(file("bad.csv")) << "1,2,3\n";
  refused({"--coefficients", file("bad.csv")}, 1, "bad.csv");
  refused({"--coefficients", file("missing.csv")}, 1, "missing.csv");
  refused({"--coefficients", file("mine.csv"), "--model", "wanat"}, 2, "the model wanat has no coefficients");
  refused({"--units", "luminance", "--model", "cao"}, 2, "the model cao has no coefficients");
}

TEST_F(RetargetCommand, WrongCommandLinesAreTold) {
  refused({"--display-luminance", "0"}, 2, "display's luminance must be within 1e-11");
  refused({"--display-black", "3"}, 2, "below its white");
  refused({"--model", "magic"}, 2, "constrained");
}

}  // namespace
}  // namespace lowlux
