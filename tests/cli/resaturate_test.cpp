#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <string>
#include <utility>
#include <vector>

#include <nlohmann/json.hpp>

#include "capture/file/picture_source.h"
#include "isp/base/executor.h"
#include "isp/model/colour/colorimetry.h"
#include "isp/output/picture/image_writer.h"
#include "tests/cli/command.h"
#include "tests/cli/simulate/simulate_command.h"

namespace lowlux {
namespace {

using test::lowlux;

using Json = nlohmann::json;

// An sRGB picture of a red field and, left of it, of nothing, with grey-blue dark in both.
class ResaturateCommand : public test::SimulateCommand {
 protected:
  static constexpr std::array<int, 3> dark{30, 32, 40}, field{90, 60, 55};

  void SetUp() override {
    Encoded8 picture{Plane<std::uint8_t>(3 * 64, 48)};
    for (int y = 0; y < 48; ++y) {
      for (int x = 0; x < 64; ++x) {
        for (int c = 0; c < 3; ++c) {
          picture.codes.at(3 * x + c, y) = static_cast<std::uint8_t>(x < 16 ? dark[c] : field[c]);
        }
      }
    }
    InlineExecutor one;
    ASSERT_TRUE(isp::write_picture(Picture(std::move(picture)), OutputSpace::srgb, {}, file("in.png"), {}, one));
  }

  test::ProcessResult run(const std::vector<std::string>& more) {
    std::vector<std::string> args{"resaturate", file("in.png"), "-o", file("out.png")};
    args.insert(args.end(), more.begin(), more.end());
    return lowlux(args);
  }
  isp::Xyz pixel(const std::string& name, int x, int y) {
    InlineExecutor one;
    const auto picture = capture::read_picture(file(name), one);
    EXPECT_TRUE(picture);
    const auto& plane = picture->xyz.plane;
    return {plane[0].at(x, y), plane[1].at(x, y), plane[2].at(x, y)};
  }
  void refused(const std::vector<std::string>& more, int exit_code, const std::string& why) {
    const auto result = run(more);
    EXPECT_EQ(result.exit_code, exit_code) << result.err;
    EXPECT_NE(result.err.find(why), std::string::npos) << why << "\n" << result.err;
    EXPECT_FALSE(std::filesystem::exists(file("out.png")));
  }
};

TEST_F(ResaturateCommand, GivesTheFieldTheColourOfItsLight) {
  ASSERT_EQ(run({"--black", "30,32,40", "--chroma-noise", "0"}).exit_code, 0);
  const isp::Xyz before = pixel("in.png", 48, 24), black = pixel("in.png", 4, 24), after = pixel("out.png", 48, 24);
  const auto light = isp::xy_of(isp::Xyz{before.x - black.x, before.y - black.y, before.z - black.z});
  const auto got = isp::xy_of(after), measured = isp::xy_of(before);
  ASSERT_TRUE(light && got && measured);
  EXPECT_NEAR(got->x, light->x, 0.004);  // one code of blue
  EXPECT_NEAR(got->y, light->y, 0.004);
  EXPECT_GT(got->x - measured->x, 0.02);
  EXPECT_NEAR(after.y, before.y, 0.01 * before.y) << "luminance stays";
}

TEST_F(ResaturateCommand, AnAreaOfThePictureTellsTheSameBlackPoint) {
  const auto by_codes = run({"--black", "30,32,40", "--json"});
  ASSERT_EQ(by_codes.exit_code, 0) << by_codes.err;
  const auto by_area = run({"--black-area", "0,0,16,48", "--json", "--force"});
  ASSERT_EQ(by_area.exit_code, 0) << by_area.err;
  const Json a = Json::parse(by_codes.out), b = Json::parse(by_area.out);
  for (int k = 0; k < 3; ++k) EXPECT_NEAR(a["black_xyz"][k].get<double>(), b["black_xyz"][k].get<double>(), 1e-5);
  EXPECT_EQ(a["chroma_noise"], 0);
}

TEST_F(ResaturateCommand, ABlackPointThatIsTooBrightIsWarnedOf) {
  const auto result = run({"--black", "120,120,120"});
  EXPECT_EQ(result.exit_code, 0);
  EXPECT_NE(result.err.find("not brighter than the black point"), std::string::npos) << result.err;
}

TEST_F(ResaturateCommand, WritesEveryFormat) {
  for (const char* name : {"a.jpg", "a.tif", "a.exr", "a.pfm"}) {
    const auto result = lowlux({"resaturate", file("in.png"), "-o", file(name), "--black", "30,32,40"});
    EXPECT_EQ(result.exit_code, 0) << name << result.err;
    EXPECT_GT(pixel(name, 48, 24).x, 0) << name;
  }
}

TEST_F(ResaturateCommand, RefusesWhatCannotBe) {
  refused({}, 2, "give either --black R,G,B or --black-area");
  refused({"--black", "1,2,3", "--black-area", "0,0,4,4"}, 2, "give either --black R,G,B or --black-area");
  refused({"--black", "1,2"}, 2, "three codes");
  refused({"--black", "1,2,256"}, 2, "three codes");
  refused({"--black", "nan,2,3"}, 2, "three codes");
  refused({"--black-area", "0,0,0,4"}, 2, "left, top, width and height");
  refused({"--black-area", "0.5,0,4,4"}, 2, "left, top, width and height");
  refused({"--black-area", "60,0,16,16"}, 1, "are not inside it");
  refused({"--black", "1,2,3", "--bits", "12"}, 2, "--bits");
  refused({"--black", "1,2,3", "--radius", "-1"}, 2, "--radius");
  const auto same = lowlux({"resaturate", file("in.png"), "-o", file("in.png"), "--black", "1,2,3", "--force"});
  EXPECT_EQ(same.exit_code, 2) << same.err;
  const auto missing = lowlux({"resaturate", file("no.png"), "-o", file("out.png"), "--black", "1,2,3"});
  EXPECT_EQ(missing.exit_code, 1);
  EXPECT_NE(missing.err.find("no.png"), std::string::npos);
}

}  // namespace
}  // namespace lowlux
