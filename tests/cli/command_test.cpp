#include <gtest/gtest.h>

#include <algorithm>
#include <string>

#include <nlohmann/json.hpp>

#include "tests/cli/command.h"
#include "tests/support/dng/dng_builder.h"
#include "tests/support/process.h"
#include "tests/support/scratch_directory.h"

namespace lowlux {
namespace {

using test::dog;
using test::lowlux;
using test::raws;

using Json = nlohmann::json;

const std::string chart = raws + "canon_kissx4_ml_colorchart.dng";

TEST(Command, HelpListsVerbsAndEveryVerbHasHelp) {
  const auto help = lowlux({"--help"});
  EXPECT_EQ(help.exit_code, 0);
  for (const char* verb : {"develop", "info"}) {
    EXPECT_NE(help.out.find(verb), std::string::npos);
    const auto verb_help = lowlux({verb, "--help"});
    EXPECT_EQ(verb_help.exit_code, 0);
    EXPECT_NE(verb_help.out.find("RAW"), std::string::npos);
    EXPECT_EQ(verb_help.err, "");
  }
}

TEST(Command, VersionNamesTheDecoderAndTheKernels) {
  const auto version = lowlux({"--version"});
  EXPECT_EQ(version.exit_code, 0);
  EXPECT_NE(version.out.find("LibRaw"), std::string::npos);
}

TEST(Command, WrongCommandLinesExitWithTwoAndOneLine) {
  const test::ScratchDirectory scratch;
  const std::string png = scratch.file("x.png");
  const std::vector<std::vector<std::string>> wrong{
      {"fry"},
      {"develop"},
      {"develop", dog},
      {"develop", dog, "-o", scratch.file("x.gif")},
      {"develop", dog, "-o", scratch.file("x")},
      {"develop", dog, "-o", png, "--exposure", "bright"},
      {"develop", dog, "-o", png, "--exposure", "nan"},
      {"develop", dog, "-o", png, "--exposure", "1e9"},
      {"develop", dog, "-o", png, "--wb", "200"},
      {"develop", dog, "-o", png, "--wb", "warm"},
      {"develop", dog, "-o", png, "--space", "adobe"},
      {"develop", dog, "-o", png, "--space", "camera"},
      {"develop", dog, "-o", png, "--space", "xyz"},
      {"develop", dog, "-o", png, "--format", "jpg"},
      {"develop", dog, "-o", png, "--bits", "12"},
      {"develop", dog, "-o", png, "--bits", "32"},
      {"develop", dog, "-o", scratch.file("x.jpg"), "--bits", "16"},
      {"develop", dog, "-o", scratch.file("x.jpg"), "--quality", "0"},
      {"develop", dog, "-o", scratch.file("x.exr"), "--space", "srgb"},
      {"develop", dog, "-o", scratch.file("x.exr"), "--bits", "8"},
      {"develop", dog, "-o", png, "--tone", "punchy"},
      {"develop", dog, "-o", png, "--black", "25,25"},
      {"develop", dog, "-o", png, "--jobs", "0"},
      {"develop", dog, "-o", png, "--no-such-option"},
      {"develop", dog, chart, "-o", png},
      {"develop", dog, dog, "-o", scratch.path() + "/"},
      {"info"},
      {"info", dog, "--xml"},
  };
  for (const auto& args : wrong) {
    const auto result = lowlux(args);
    const std::string said = testing::PrintToString(args) + result.err;
    EXPECT_EQ(result.exit_code, 2) << said;
    EXPECT_EQ(std::count(result.err.begin(), result.err.end(), '\n'), 1) << said;
    EXPECT_EQ(result.out, "") << said;
  }
  EXPECT_TRUE(scratch.names().empty());
}

TEST(Command, FloatSamplesWithAToneCurveAreRefused) {
  const test::ScratchDirectory scratch;
  const auto result = lowlux({"develop", dog, "-o", scratch.file("x.exr"), "--tone", "standard"});
  EXPECT_EQ(result.exit_code, 2);
  EXPECT_TRUE(scratch.names().empty());
}

TEST(Command, InfoShowsTagAndMeasurementOfTheKissX4SideBySide) {
  const auto result = lowlux({"info", chart, "--json"});
  ASSERT_EQ(result.exit_code, 0) << result.err;
  const Json black = Json::parse(result.out)[0]["black"];
  EXPECT_EQ(black["tag"]["pattern_dn"][0], 2056);
  const auto measured = black["measured"]["pedestal_dn"].get<std::vector<double>>();
  const auto error = black["measured"]["standard_error_dn"].get<std::vector<double>>();
  // By row parity, as ../README of the raw files' collection measured them on other columns of the strip.
  for (int site = 0; site < 4; ++site) {
    EXPECT_NEAR(measured[site], site < 2 ? 2047.4 : 2050.4, 0.5);
    EXPECT_GT(error[site], 0.05);
    EXPECT_LT(error[site], 0.5);
  }
  const auto text = lowlux({"info", chart});
  EXPECT_NE(text.out.find("2056.00"), std::string::npos);
  EXPECT_NE(text.out.find("2047.3"), std::string::npos);
}

TEST(Command, DevelopReportsTheBlackItUsed) {
  const test::ScratchDirectory scratch;
  const auto measured = lowlux({"develop", chart, "-o", scratch.file("a.png"), "--json", "--half"});
  ASSERT_EQ(measured.exit_code, 0) << measured.err;
  const Json report = Json::parse(measured.out)[0];
  EXPECT_EQ(report["black"]["source"], "masked-pixels");
  EXPECT_EQ(report["black"]["holds_dark"], true);
  EXPECT_EQ(report["width"], 867);
  EXPECT_EQ(report["height"], 578);
  EXPECT_TRUE(report["timings_s"].contains("render"));
  const auto tagged =
      lowlux({"develop", chart, "-o", scratch.file("b.png"), "--json", "--half", "--black", "metadata"});
  EXPECT_EQ(Json::parse(tagged.out)[0]["black"]["pedestal_dn"][0], 2056);
}

TEST(Command, GoProFilesAreRefusedWithTheReason) {
  const test::ScratchDirectory scratch;
  const auto result = lowlux({"develop", raws + "gopro_hero6_GOPR0024.gpr", "-o", scratch.file("x.png")});
  EXPECT_EQ(result.exit_code, 1);
  EXPECT_NE(result.err.find("VC-5"), std::string::npos);
  EXPECT_NE(result.err.find("convert"), std::string::npos);
  EXPECT_TRUE(scratch.names().empty());
}

TEST(Command, EveryFormatAndDepthIsWritten) {
  const test::ScratchDirectory scratch;
  const std::vector<std::vector<std::string>> kinds{
      {"a.png"},
      {"b.png", "--bits", "16"},
      {"c.jpg"},
      {"d.jpeg", "--quality", "50"},
      {"e.tif"},
      {"f.tiff", "--bits", "8"},
      {"g.tif", "--bits", "32", "--space", "linear-rec2020"},
      {"h.exr"},
      {"i.exr", "--bits", "32", "--space", "xyz"},
      {"j.png", "--space", "p3"},
      {"k.tif", "--space", "camera"},
      {"l.PNG", "--space", "rec2020"},
      {"m.tif", "--space", "linear-srgb", "--tone", "none", "--exposure", "0"}};
  for (const auto& kind : kinds) {
    std::vector<std::string> args{"develop", dog, "-o", scratch.file(kind[0])};
    args.insert(args.end(), kind.begin() + 1, kind.end());
    const auto result = lowlux(args);
    EXPECT_EQ(result.exit_code, 0) << kind[0] << result.err;
  }
  EXPECT_EQ(scratch.names().size(), kinds.size());
}

TEST(Command, BatchesContinueAfterABadFileAndReportItAtTheEnd) {
  const test::ScratchDirectory scratch;
  const std::string bad = scratch.file("bad.dng");
  test::write_file(bad, "no raw", 6);
  const std::string folder = scratch.file("out/");
  const auto result = lowlux({"develop", dog, bad, raws + "nikon_dsc1339_crop_rggb14.dng", "-o", folder, "--format",
                              "jpg", "--jobs", "2", "--json"});
  EXPECT_EQ(result.exit_code, 1);
  EXPECT_NE(result.err.find("1 of 3 files failed"), std::string::npos) << result.err;
  const Json report = Json::parse(result.out);
  ASSERT_EQ(report.size(), 3u);
  EXPECT_EQ(report[0]["ok"], true);  // in the order of the command line, whatever finished first
  EXPECT_EQ(report[1]["ok"], false);
  EXPECT_EQ(report[1]["file"], bad);
  EXPECT_EQ(report[2]["ok"], true);
  EXPECT_TRUE(std::filesystem::exists(folder + "n900_dog_small_grbg10in16.jpg"));
  EXPECT_TRUE(std::filesystem::exists(folder + "nikon_dsc1339_crop_rggb14.jpg"));
  EXPECT_FALSE(std::filesystem::exists(folder + "bad.jpg"));
}

TEST(Command, NumberOfJobsDoesNotChangeAPicture) {
  const test::ScratchDirectory scratch;
  for (const char* jobs : {"1", "2", "5"}) {
    ASSERT_EQ(lowlux({"develop", dog, chart, "-o", scratch.file(jobs) + "/", "--jobs", jobs}).exit_code, 0);
  }
  for (const char* name : {"/n900_dog_small_grbg10in16.png", "/canon_kissx4_ml_colorchart.png"}) {
    const std::string one = test::read_file(scratch.file("1") + name);
    EXPECT_FALSE(one.empty());
    EXPECT_EQ(one, test::read_file(scratch.file("2") + name));
    EXPECT_EQ(one, test::read_file(scratch.file("5") + name));
  }
}

TEST(Command, OrientationIsAppliedToThePixels) {
  const test::ScratchDirectory scratch;
  test::DngBuilder dng;
  dng.width = 64;
  dng.height = 48;
  dng.set(274, test::Tag::numbers(test::TagType::u16, {6}));
  const std::vector<std::byte> bytes = dng.build();
  test::write_file(scratch.file("in.dng"), bytes.data(), bytes.size());
  const auto result = lowlux({"develop", scratch.file("in.dng"), "-o", scratch.file("x.png"), "--json"});
  ASSERT_EQ(result.exit_code, 0) << result.err;
  const Json report = Json::parse(result.out)[0];
  EXPECT_EQ(report["width"], 48);
  EXPECT_EQ(report["height"], 64);
}

TEST(Command, AFullStandardOutputIsAFailure) {
  EXPECT_EQ(test::run_process({"sh", "-c", test::tested_command() + " info " + dog + " --json > /dev/full"}).exit_code,
            1);
}

TEST(Command, TimingsNameTheStages) {
  const test::ScratchDirectory scratch;
  const auto result = lowlux({"develop", dog, "-o", scratch.file("x.png"), "--timings"});
  for (const char* stage : {"read and decode", "black point", "render", "encode and write", "sum"}) {
    EXPECT_NE(result.out.find(stage), std::string::npos) << stage;
  }
}

TEST(Command, ARawFileIsNeverReplacedByItsPicture) {
  const test::ScratchDirectory scratch;
  const std::string raw = scratch.file("photo.tif");  // many raw formats are TIFF files
  std::filesystem::copy_file(dog, raw);
  const std::string before = test::read_file(raw);
  EXPECT_EQ(lowlux({"develop", raw, "-o", raw, "--force"}).exit_code, 2);
  EXPECT_EQ(lowlux({"develop", raw, "-o", scratch.path() + "/", "--format", "tif", "--force"}).exit_code, 2);
  EXPECT_EQ(test::read_file(raw), before);
}

}  // namespace
}  // namespace lowlux
