#include <gtest/gtest.h>

#include <algorithm>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "tests/cli/command.h"
#include "tests/cli/simulate/simulate_command.h"

namespace lowlux {
namespace {

using test::lowlux;

using Json = nlohmann::json;

class CaptureCommand : public test::SimulateCommand {
 protected:
  static void refused(const std::vector<std::string>& args, const std::string& why, int exit_code = 2) {
    std::vector<std::string> words{"capture"};
    words.insert(words.end(), args.begin(), args.end());
    const auto result = lowlux(words);
    EXPECT_EQ(result.exit_code, exit_code) << testing::PrintToString(args) << result.err;
    EXPECT_NE(result.err.find(why), std::string::npos) << why << "\n" << result.err;
    EXPECT_EQ(std::ranges::count(result.err, '\n'), 1) << result.err;
    EXPECT_EQ(result.out, "");
  }
};

TEST_F(CaptureCommand, RefusesCommandLinesThatMeanNothing) {
  const std::string out = file("a.png");
  refused({}, "name one camera");
  refused({"--v4l2", "/dev/video0", "--libcamera", "0", "-o", out}, "name one camera");
  refused({"--v4l2", "/dev/video0"}, "name an output");
  refused({"--v4l2", "/dev/video0", "--live", "-o", out}, "no files");
  refused({"--v4l2", "/dev/video0", "--temporal", "-o", out}, "--temporal");
  refused({"--v4l2", "/dev/video0", "-o", file("a.gif")}, ".dng");
  refused({"--v4l2", "/dev/video0", "-o", out, "--as", "dng"}, "--as");
  refused({"--v4l2", "/dev/video0", "-o", out, "--raw"}, "--raw");
  refused({"--v4l2", "/dev/video0", "-o", out, "--format", "YUYV"}, "not a valid raw format");
  refused({"--v4l2", "/dev/video0", "-o", out, "--size", "640"}, "not a size");
  refused({"--v4l2", "/dev/video0", "-o", out, "--size", "0x480"}, "not a size");
  refused({"--v4l2", "/dev/video0", "-o", out, "--fps", "0"}, "--fps");
  refused({"--v4l2", "/dev/video0", "-o", out, "--exposure-time", "nan"}, "--exposure-time");
  refused({"--v4l2", "/dev/video0", "-o", out, "--flip", "x"}, "--flip");
  refused({"--v4l2", "/dev/video0", "-o", out, "--frames", "1.5"}, "number of frames");
  refused({"--v4l2", "/dev/video0", "-o", out, "--frames", "-1"}, "--frames");
  refused({"--v4l2", "/dev/video0", "-o", out, "--timeout", "0"}, "--timeout");
  refused({"--v4l2", "/dev/video0", "-o", out, "--buffers", "1"}, "--buffers");
  refused({"--v4l2", "/dev/video0", "-o", out, "--bits", "32"}, "PNG");
  refused({"--libcamera", "0", "-o", out, "--gain-code", "3"}, "V4L2");
  refused({"--v4l2", "/dev/video0", "-o", out, "--gain", "2", "--gain-code", "3"}, "mutually exclusive");
}

TEST_F(CaptureCommand, RefusesOptionsOfPicturesForRawFilesAndFilms) {
  for (const std::string option : {"--wb", "--denoise", "--look", "--space"}) {
    const std::string value = option == "--wb"        ? "auto"
                              : option == "--denoise" ? "off"
                              : option == "--look"    ? "eye"
                                                      : "srgb";
    refused({"--v4l2", "/dev/video0", "-o", file("a.dng"), option, value}, option);
  }
  refused({"--v4l2", "/dev/video0", "-o", file("a.dng"), "--black", "masked"}, "--black");
  refused({"--v4l2", "/dev/video0", "--live", "--half"}, "--half");
  refused({"--v4l2", "/dev/video0", "--live", "--wb", "5000"}, "--wb");
  refused({"--v4l2", "/dev/video0", "--live", "--denoise", "best"}, "best");
  refused({"--v4l2", "/dev/video0", "--live", "--look", "shin"}, "--look");
  refused({"--v4l2", "/dev/video0", "--live", "--budget-ms", "0"}, "--budget-ms");
  refused({"--v4l2", "/dev/video0", "-o", file("a.png"), "--budget-ms", "20"}, "requires --live");
}

TEST_F(CaptureCommand, RefusesLimitsOfAutomaticExposureThatMeanNothing) {
  const std::string out = file("a.dng");
  const auto automatic = [&](std::vector<std::string> words, const std::string& why) {
    words.insert(words.begin(), {"--v4l2", "/dev/video0", "-o", out, "--auto-exposure"});
    refused(words, why);
  };
  automatic({"--exposure-time", "0.1"}, "mutually exclusive");
  automatic({"--max-exposure", "0"}, "--max-exposure");
  automatic({"--max-exposure", "nan"}, "--max-exposure");
  automatic({"--max-gain", "0"}, "--max-gain");
  automatic({"--mains", "55"}, "auto, 50, 60, off");
  automatic({"--clip", "0.6"}, "--clip");
  automatic({"--gain-codes", "16"}, "16=1,32=2");
  automatic({"--gain-codes", "16=1,x=2"}, "16=1,32=2");
  automatic({"--gain-codes", "16=1,32=0"}, "16=1,32=2");
  automatic({"--gain-codes", "1.5=1"}, "16=1,32=2");
  automatic({"--gain-codes", "16=1,32=1"}, "factor 1 twice");
  automatic({"--gain-codes", "16=2,32=4,16=1"}, "code 16 twice");
  automatic({"--gain-codes", "16=1", "--gain-code", "16"}, "mutually exclusive");
  refused({"--libcamera", "0", "-o", out, "--auto-exposure", "--gain-codes", "16=1"}, "V4L2");
  for (const std::string option : {"--max-exposure", "--max-gain", "--clip"}) {
    refused({"--v4l2", "/dev/video0", "-o", out, option, "0.1"}, option + " requires --auto-exposure");
  }
}

TEST_F(CaptureCommand, HelpStatesInWhichChannelClippedPixelsAreLimited) {
  EXPECT_NE(lowlux({"capture", "--help-all"}).out.find("brightest"), std::string::npos);
}

TEST_F(CaptureCommand, SaysInOneLineThatThereIsNoSuchCamera) {
  refused({"--v4l2", "/dev/video9999", "-o", file("a.png")}, "/dev/video9999", 1);
  refused({"--v4l2", "/dev/null", "-o", file("a.dng")}, "/dev/null", 1);
  refused({"--libcamera", "no such camera", "-o", file("a.png")}, "libcamera", 1);
  EXPECT_TRUE(scratch_.names().empty());
}

TEST_F(CaptureCommand, RefusesFilesThatExistBeforeACameraIsOpened) {
  scratch_.write("a.png", "mine");
  scratch_.write("b-0007.dng", "mine");
  refused({"--v4l2", "/dev/video9999", "-o", file("a.png")}, "--force", 1);
  refused({"--v4l2", "/dev/video9999", "-o", file("b.dng"), "--frames", "7"}, "--force", 1);
  refused({"--v4l2", "/dev/video9999", "-o", file("b.dng"), "--frames", "0"}, "--force", 1);
  refused({"--v4l2", "/dev/video9999", "-o", file("b.dng"), "--frames", "6"}, "/dev/video9999", 1);
  refused({"--v4l2", "/dev/video9999", "-o", file("a.png"), "--force"}, "/dev/video9999", 1);
  refused({"--v4l2", "/dev/video9999", "-o", file("none/a.png")}, "no directory", 1);
  EXPECT_EQ(scratch_.read("a.png"), "mine");
}

TEST_F(CaptureCommand, ListsCamerasEvenWhereThereAreNone) {
  const auto text = lowlux({"capture", "--list"});
  EXPECT_EQ(text.exit_code, 0) << text.err;
  const auto json = lowlux({"capture", "--list", "--json"});
  EXPECT_EQ(json.exit_code, 0) << json.err;
  const Json list = Json::parse(json.out);
  EXPECT_TRUE(list["v4l2"].is_array() && list["libcamera"].is_array());
  EXPECT_EQ(list["v4l2"].empty() && list["libcamera"].empty(), text.out == "no cameras\n") << text.out;
}

TEST_F(CaptureCommand, TellsInJsonWhatWentWrong) {
  const auto result = lowlux({"capture", "--v4l2", "/dev/video9999", "-o", file("a.png"), "--json"});
  EXPECT_EQ(result.exit_code, 1);
  const Json json = Json::parse(result.out);
  EXPECT_EQ(json["ok"], false);
  EXPECT_EQ(json["frames"], 0);
  EXPECT_NE(json["error"], "");
}

}  // namespace
}  // namespace lowlux
