#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <filesystem>
#include <string>
#include <variant>
#include <vector>

#include <nlohmann/json.hpp>

#include "capture/file/file_bytes.h"
#include "isp/codec/tiff.h"
#include "tests/cli/command.h"
#include "tests/cli/simulate/simulate_command.h"

namespace lowlux {
namespace {

using test::lowlux;

using Json = nlohmann::json;

// A sensor whose pixels respond differently by 3 %, and an even scene.
class FlatFrameCommand : public test::SimulateCommand {
 protected:
  void flat(const std::string& name, const std::string& luminance, const std::vector<std::string>& more = {}) {
    std::filesystem::create_directories(std::filesystem::path(file(name)).parent_path());
    std::vector<std::string> args{"--luminance", luminance,   "--prnu", "0.03",      "--exposure",
                                  "1",           "--effects", "all",    "--no-truth"};
    args.insert(args.end(), more.begin(), more.end());
    if (std::ranges::find(more, "--size") == more.end()) args.insert(args.end(), {"--size", "128x96"});
    simulated("flat", name, args);
  }
  void SetUp() override {
    flat("flats/f.dng", "2", {"--frames", "8", "--seed", "5"});
    flat("scene.dng", "2", {"--seed", "99"});
  }
  test::ProcessResult developed(const std::vector<std::string>& more) {
    std::vector<std::string> args{
        "develop", file("scene.dng"), "-o",        file("out.tif"), "--force", "--json",   "--bits", "32",
        "--space", "linear-srgb",     "--denoise", "off",           "--half",  "--repair", "off"};
    args.insert(args.end(), more.begin(), more.end());
    return lowlux(args);
  }
  // Relative standard deviation of the green of the developed image.
  double deviation() {
    const auto bytes = capture::read_file_bytes(file("out.tif"), std::size_t{1} << 30);
    const auto decoded = isp::decode_tiff(*bytes);
    const Plane<float>& green = std::get<SceneLinear>(decoded->picture).plane[1];
    double sum = 0, squares = 0;
    for (std::size_t i = 0; i < green.size(); ++i) sum += green.data()[i], squares += std::pow(green.data()[i], 2);
    const auto n = static_cast<double>(green.size());
    return std::sqrt(squares / n - std::pow(sum / n, 2)) / (sum / n);
  }
  void refused(const std::vector<std::string>& more, int exit_code, const std::string& why) {
    std::filesystem::remove(file("out.tif"));
    const auto result = developed(more);
    EXPECT_EQ(result.exit_code, exit_code) << result.err;
    EXPECT_NE(result.err.find(why), std::string::npos) << why << "\n" << result.err;
    EXPECT_EQ(std::ranges::count(result.err, '\n'), 1) << result.err;
    EXPECT_FALSE(std::filesystem::exists(file("out.tif")));
  }
};

TEST_F(FlatFrameCommand, FlatsDivideOutTheResponseOfThePixels) {
  ASSERT_EQ(developed({}).exit_code, 0);
  const double before = deviation();
  const auto result = developed({"--flat-frame", file("flats")});
  ASSERT_EQ(result.exit_code, 0) << result.err;
  const double after = deviation();
  const Json report = Json::parse(result.out)[0]["flat_frame"];
  EXPECT_EQ(report["frames"], 8);
  // 12,288 pixels; noise that is removed from it is measured to 1 %.
  EXPECT_NEAR(report["prnu"].get<double>(), 0.03, 0.03 * (5 / std::sqrt(2.0 * 12288) + 0.02));
  EXPECT_LT(report["noise_share"].get<double>(), 0.01);
  // A 2 x 2 mean of green has 3 % / sqrt 2 in the mosaic; colour conversion raises it, and the shot noise stays.
  EXPECT_GT(before, 0.015);
  EXPECT_LT(after, 0.5 * before);
  const auto explained = lowlux(
      {"develop", file("scene.dng"), "-o", file("x.png"), "--explain", "--flat-frame", file("flats/f_0000.dng")});
  EXPECT_NE(explained.out.find("flat field"), std::string::npos) << explained.out;
  EXPECT_TRUE(Json::parse(developed({}).out)[0]["flat_frame"].is_null());
}

TEST_F(FlatFrameCommand, WhatCannotBeIsRefusedInOneLine) {
  flat("bright.dng", "500");
  flat("dark.dng", "0.01");
  flat("size.dng", "2", {"--size", "64x64"});
  flat("camera.dng", "2", {"--sensor", "thesis"});
  refused({"--flat-frame", file("bright.dng")}, 1, "clipped");
  refused({"--flat-frame", file("dark.dng")}, 1, "too dark");
  refused({"--flat-frame", file("size.dng")}, 1, "pixels");
  refused({"--flat-frame", file("camera.dng")}, 1, "camera");
  refused({"--flat-frame", file("none.dng")}, 1, "none.dng");
  refused({"--flat-frame", file("flats") + "," + file("size.dng")}, 1, "flat frame 9");
  refused({"--flat-frame", file("scene.dng")}, 2, "one of its flats");
}

}  // namespace
}  // namespace lowlux
