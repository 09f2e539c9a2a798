#include <gtest/gtest.h>

#include <array>
#include <chrono>
#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "capture/file/dng_source.h"
#include "capture/file/picture_source.h"
#include "isp/raw/black_point.h"
#include "tests/cli/command.h"
#include "tests/cli/simulate/simulate_command.h"

namespace lowlux {
namespace {

using test::lowlux;
using Json = nlohmann::json;

class MergeCommand : public test::SimulateCommand {
 protected:
  void SetUp() override {
    simulated("chart:macbeth", "night.dng",
              {"--luminance", "0.2", "--size", "192x128", "--frames", "4", "--exposure", "0.02", "--no-truth"});
    for (int i = 0; i < 4; ++i) frames_.push_back(file("night_000" + std::to_string(i) + ".dng"));
  }

  test::ProcessResult merge(const std::vector<std::string>& inputs, const std::vector<std::string>& more = {}) {
    std::vector<std::string> args{"merge", "-o", file("merged.dng")};
    args.insert(args.end(), inputs.begin(), inputs.end());
    args.insert(args.end(), more.begin(), more.end());
    return lowlux(args);
  }

  void refused(const std::vector<std::string>& inputs, const std::vector<std::string>& more, int exit_code,
               const std::string& why) {
    const auto result = merge(inputs, more);
    EXPECT_EQ(result.exit_code, exit_code) << result.err;
    EXPECT_NE(result.err.find(why), std::string::npos) << why << "\n" << result.err;
    EXPECT_EQ(std::count(result.err.begin(), result.err.end(), '\n'), 1) << result.err;
    EXPECT_FALSE(std::filesystem::exists(file("merged.dng")));
  }

  std::vector<std::string> frames_;
};

TEST_F(MergeCommand, WritesARawFileWithTheNoiseOfTheMean) {
  const auto result = merge(frames_, {"--json"});
  ASSERT_EQ(result.exit_code, 0) << result.err;
  const Json report = Json::parse(result.out);
  EXPECT_EQ(report["alignment"], "none");
  EXPECT_EQ(report["frames"].size(), 4);
  EXPECT_NEAR(report["mean_count"], 4, 0.1);
  const auto one = capture::read_raw(frames_[0]), merged = capture::read_raw(file("merged.dng"));
  ASSERT_TRUE(one && merged) << merged.error().message;
  ASSERT_TRUE(merged->noise);
  EXPECT_NEAR(merged->noise->scale[1] / one->noise->scale[1], 0.25, 0.01);
  EXPECT_NEAR(merged->noise->offset[1] / one->noise->offset[1], 0.25, 0.02);
  EXPECT_FALSE(merged->noise->reduced);
  EXPECT_EQ(merged->raw.info.model, one->raw.info.model);
  EXPECT_EQ(merged->raw.info.exposure_s, one->raw.info.exposure_s);
  EXPECT_EQ(merged->colour.calibrations.size(), one->colour.calibrations.size());
}

/// Returns the mean of each site of a mosaic, as a fraction of white.
PerSite<double> means_of(const RawFrame& frame) {
  const RawDn& raw = frame.raw;
  PerSite<double> sum{}, pixels{};
  for (int y = 0; y < raw.active.height; ++y) {
    for (int x = 0; x < raw.active.width; ++x) {
      const int site = site_of(x, y), column = raw.active.x + x, row = raw.active.y + y;
      const double black_dn = frame.raw.black_tag->at(x & 1, y & 1), white_dn = isp::white_at(raw, site);
      const double dn = raw.is_float() ? static_cast<double>(raw.dn_float.at(column, row)) : raw.dn.at(column, row);
      sum[site] += (dn - black_dn) / (white_dn - black_dn);
      ++pixels[site];
    }
  }
  for (int site = 0; site < 4; ++site) sum[site] /= pixels[site];
  return sum;
}

// Interpolation on cube roots shifts the mean of a colour in fine texture. What is moved from between the sites of a
// colour to its sites must not inherit the shift.
TEST_F(MergeCommand, HandHeldTextureKeepsTheMeanOfEachColour) {
  simulated(std::string(LOWLUX_TESTDATA) + "/pictures/kodim05.png", "hand.dng",
            {"--luminance", "0.3", "--exposure", "0.05", "--gain", "1600", "--frames", "6", "--shake", "6", "--seed",
             "1", "--no-truth"});
  std::vector<std::string> frames;
  frames.reserve(6);
  for (int i = 0; i < 6; ++i) frames.push_back(file("hand_000" + std::to_string(i) + ".dng"));
  ASSERT_EQ(merge(frames).exit_code, 0);
  const auto one = capture::read_raw(frames[0]), merged = capture::read_raw(file("merged.dng"));
  ASSERT_TRUE(one && merged);
  const PerSite<double> expected = means_of(*one), found = means_of(*merged);
  // 98,000 sites of about 10 e- of one frame: 0.1 % of standard error.
  for (int site = 0; site < 4; ++site) EXPECT_NEAR(found[site] / expected[site], 1, 0.006) << site;
}

TEST_F(MergeCommand, DevelopMergesFirst) {
  const auto result = lowlux({"develop", "--merge", frames_[0], frames_[1], frames_[2], "-o", file("out.png"), "--json",
                              "--mean", "plain", "--align", "none"});
  ASSERT_EQ(result.exit_code, 0) << result.err;
  const Json report = Json::parse(result.out)[0];
  EXPECT_EQ(report["merge"]["frames"].size(), 3);
  EXPECT_NEAR(report["merge"]["mean_count"], 3, 1e-6);
  EXPECT_EQ(report["width"], 192);
  EXPECT_TRUE(std::filesystem::exists(file("out.png")));
  const auto explained = lowlux({"develop", "--merge", scratch_.path(), "-o", file("two.png"), "--explain"});
  ASSERT_EQ(explained.exit_code, 0) << explained.err;
  EXPECT_NE(explained.out.find("alignment none"), std::string::npos) << explained.out;
}

TEST_F(MergeCommand, ABudgetChoosesWhatIsOpenAndSaysWhy) {
  const auto wide = merge(frames_, {"--budget-ms", "100000", "--json"});
  ASSERT_EQ(wide.exit_code, 0) << wide.err;
  const Json all = Json::parse(wide.out)["budget"];
  EXPECT_EQ(all["mean"], "robust");
  EXPECT_EQ(all["alignment"], "none");  // measured: the camera stood still
  EXPECT_EQ(all["motion_measured"], true);
  EXPECT_EQ(all["fits"], true);
  EXPECT_GT(all["predicted_ms"], 0);
  EXPECT_GT(all["taken_ms"], 0);
  const auto tight = merge(frames_, {"--budget-ms", "0.01", "--force", "--explain"});
  ASSERT_EQ(tight.exit_code, 0) << tight.err;
  EXPECT_NE(tight.out.find("plain mean, alignment none"), std::string::npos) << tight.out;
  EXPECT_NE(tight.out.find("no method fits into the time; this one is the fastest"), std::string::npos) << tight.out;
  EXPECT_NE(tight.err.find("warning: merging is predicted to take at least"), std::string::npos) << tight.err;
  const auto fixed =
      merge(frames_, {"--budget-ms", "0.01", "--force", "--json", "--align", "cells", "--mean", "robust"});
  ASSERT_EQ(fixed.exit_code, 0) << fixed.err;
  EXPECT_EQ(Json::parse(fixed.out)["budget"]["mean"], "robust");
  EXPECT_EQ(Json::parse(fixed.out)["alignment"], "cells");
  EXPECT_EQ(merge(frames_, {"--budget-ms", "soon", "--force"}).exit_code, 2);
}

// Frames are merged whole and as camera RGB, whatever the image is to be.
TEST_F(MergeCommand, OptionsOfTheImageDoNotChangeHowFramesAreMerged) {
  simulated("chart:macbeth", "hand.dng",
            {"--size", "288x216", "--luminance", "0.1", "--frames", "4", "--shake", "8", "--seed", "2", "--no-truth"});
  std::vector<std::string> develop{"develop", "--merge", "--force", "--json"};
  for (int i = 0; i < 4; ++i) develop.push_back(file("hand_000" + std::to_string(i) + ".dng"));
  const auto developed = [&](const std::string& output, const std::vector<std::string>& more) {
    std::vector<std::string> args = develop;
    args.insert(args.end(), {"-o", file(output)});
    args.insert(args.end(), more.begin(), more.end());
    const auto result = lowlux(args);
    EXPECT_EQ(result.exit_code, 0) << testing::PrintToString(more) << result.err;
    return result.exit_code == 0 ? Json::parse(result.out)[0]["merge"]["mean_count"].get<double>() : 0;
  };
  const double count = developed("whole.png", {"--exposure", "4"});
  EXPECT_GT(count, 2.5);
  ASSERT_EQ(lowlux({"merge", "-o", file("merged.dng"), develop[4], develop[5], develop[6], develop[7]}).exit_code, 0);
  const auto alone = lowlux({"develop", file("merged.dng"), "-o", file("other.png"), "--denoise", "standard"});
  EXPECT_EQ(alone.err, "") << "interpolation leaves less noise on fine scales, which does not call for a warning";
  const std::vector<std::vector<std::string>> changes{{"--crop", "51,50,203,151"},
                                                      {"--max-size", "100"},
                                                      {"--saturation", "1.2"},
                                                      {"--brightness", "0.5"},
                                                      {"--contrast", "1.2"},
                                                      {"--sharpen", "1.5"},
                                                      {"--highlights", "reconstruct"},
                                                      {"--half"},
                                                      {"--local-tone", "0.5"},
                                                      {"--wb", "5000"},
                                                      {"--look", "eye", "--light", "HPS_generic"}};
  for (const std::vector<std::string>& change : changes) {
    EXPECT_EQ(developed("other.png", change), count) << testing::PrintToString(change);
  }
  developed("crop.png", {"--exposure", "4", "--crop", "51,50,203,151"});
  InlineExecutor executor;
  const auto whole = capture::read_picture(file("whole.png"), executor);
  const auto crop = capture::read_picture(file("crop.png"), executor);
  ASSERT_TRUE(whole && crop);
  ASSERT_EQ(crop->xyz.width(), 203);
  for (std::size_t c = 0; c < 3; ++c) {
    for (int y = 0; y < 151; ++y) {
      for (int x = 0; x < 203; ++x) {
        ASSERT_EQ(crop->xyz.plane[c].at(x, y), whole->xyz.plane[c].at(51 + x, 50 + y)) << x << ' ' << y;
      }
    }
  }
}

// Estimates from single frames scatter: by chance some show the dark charge significantly, and others do not.
TEST_F(MergeCommand, DarkChargeThatIsEstimatedIsDecidedOnceForAllFrames) {
  for (const char* const temperature : {"26", "30"}) {
    simulated(std::string(LOWLUX_TESTDATA) + "/pictures/kodim23.png", "still.dng",
              {"--luminance", "0.1", "--exposure", "1", "--gain", "1600", "--dark-current", "6", "--temperature",
               temperature, "--frames", "6", "--seed", "1", "--no-truth", "--force"});
    std::vector<std::string> frames;
    frames.reserve(6);
    for (int i = 0; i < 6; ++i) frames.push_back(file("still_000" + std::to_string(i) + ".dng"));
    const auto result = merge(frames, {"--json", "--force"});
    ASSERT_EQ(result.exit_code, 0) << result.err;
    const Json report = Json::parse(result.out);
    EXPECT_EQ(report["alignment"], "none") << temperature;
    EXPECT_NEAR(report["mean_count"], 6, 0.1) << temperature;
  }
}

// Dark frames leave hot pixels without a value, and so cells in which a colour has none.
TEST_F(MergeCommand, TheNoiseOfABracketIsThatOfSitesWithValues) {
  const std::string scene = std::string(LOWLUX_TESTDATA) + "/pictures/kodim23.png";
  std::array<NoiseProfile, 2> noise;
  for (const bool hot : {false, true}) {
    std::vector<std::string> more{"--bracket", "0,-1,-2", "--luminance", "1", "--exposure", "0.1",
                                  "--gain",    "1600",    "--seed",      "3", "--no-truth", "--force"};
    if (hot) more.insert(more.end(), {"--hot-pixels", "0.0002", "--hot-current", "3000"});
    simulated(scene, "bracket.dng", more);
    const auto result =
        merge({file("bracket_0000.dng"), file("bracket_0001.dng"), file("bracket_0002.dng")}, {"--force"});
    ASSERT_EQ(result.exit_code, 0) << result.err;
    const auto merged = capture::read_raw(file("merged.dng"));
    ASSERT_TRUE(merged && merged->noise);
    noise[hot ? 1 : 0] = *merged->noise;
  }
  for (std::size_t c = 0; c < 3; ++c) {
    EXPECT_NEAR(noise[1].scale[c] / noise[0].scale[c], 1, 0.05) << c;
    EXPECT_NEAR(noise[1].offset[c] / noise[0].offset[c], 1, 0.2) << c;
  }
}

TEST_F(MergeCommand, ABudgetOfDevelopIsForMergingToo) {
  const auto result = lowlux({"develop", "--merge", frames_[0], frames_[1], frames_[2], "-o", file("out.png"), "--json",
                              "--budget-ms", "100000"});
  ASSERT_EQ(result.exit_code, 0) << result.err;
  const Json report = Json::parse(result.out)[0];
  EXPECT_LT(report["merge"]["budget"]["budget_ms"], 100000);
  EXPECT_EQ(report["merge"]["budget"]["fits"], true);
}

TEST_F(MergeCommand, MergesABracketByItsExposureTimes) {
  simulated("chart:macbeth", "long.dng",
            {"--luminance", "0.2", "--size", "192x128", "--exposure", "0.08", "--seed", "9", "--no-truth"});
  const auto result = merge({frames_[0], file("long.dng")}, {"--json"});
  ASSERT_EQ(result.exit_code, 0) << result.err;
  const Json report = Json::parse(result.out);
  EXPECT_EQ(report["bracket"], true);
  EXPECT_EQ(report["frames"][1]["reference"], true);  // the longest
  EXPECT_NEAR(report["frames"][0]["light"], 0.25, 0.0125);
  EXPECT_TRUE(report["mean_count"].is_null());  // weights differ by place
}

TEST_F(MergeCommand, NoDisplacementIsStatedWhereNoneCouldBeFound) {
  simulated("flat", "flat.dng", {"--luminance", "0.01", "--size", "192x128", "--frames", "2", "--no-truth"});
  const std::vector<std::string> flats{file("flat_0000.dng"), file("flat_0001.dng")};
  const auto result = merge(flats, {"--align", "subpixel", "--json"});
  ASSERT_EQ(result.exit_code, 0) << result.err;
  const Json frame = Json::parse(result.out)["frames"][1];
  EXPECT_EQ(frame["aligned"], false);
  EXPECT_TRUE(frame["largest_shift_px"].is_null() && frame["shift_error_px"].is_null()) << frame;
  const auto text = merge(flats, {"--align", "subpixel", "--explain", "--force"});
  EXPECT_NE(text.out.find("its displacement could not be found"), std::string::npos) << text.out;
  EXPECT_EQ(text.out.find("moved by"), std::string::npos) << text.out;
}

TEST_F(MergeCommand, FramesThatAreNotComparedAreNotSaidToMatch) {
  const auto plain = merge(frames_, {"--mean", "plain", "--explain"});
  ASSERT_EQ(plain.exit_code, 0) << plain.err;
  EXPECT_EQ(plain.out.find("matches"), std::string::npos) << plain.out;
  EXPECT_NE(plain.out.find("averaged without comparing it"), std::string::npos) << plain.out;
  const auto single = merge({frames_[0]}, {"--json", "--force"});
  ASSERT_EQ(single.exit_code, 0) << single.err;
  EXPECT_EQ(Json::parse(single.out)["frames"][0]["reason"], "it is the reference");
}

TEST_F(MergeCommand, DrizzlesANightThatOtherCommandsDevelop) {
  std::filesystem::create_directory(file("night"));
  const auto made =
      lowlux({"simulate", "flat", "--size",           "300x200", "--luminance", "0.02",    "--exposure",         "2",
              "--stars",  "60",   "--star-luminance", "0.3",     "--drift",     "2.7,1.3", "--field-rotation",   "0.3",
              "--frames", "8",    "--dark-current",   "0.1",     "--no-truth",  "-o",      file("night/sky.dng")});
  ASSERT_EQ(made.exit_code, 0) << made.err;
  const auto result = lowlux({"merge", file("night"), "-o", file("sky.dng"), "--align", "stars", "--drizzle", "1.5",
                              "--pixfrac", "0.9", "--json"});
  ASSERT_EQ(result.exit_code, 0) << result.err;
  const Json report = Json::parse(result.out);
  EXPECT_EQ(report["alignment"], "stars");
  EXPECT_EQ(report["frames"][4]["reference"], true);
  for (const Json& frame : report["frames"]) EXPECT_TRUE(frame["aligned"]);
  EXPECT_GT(report["stars"], 20);
  EXPECT_LT(report["empty_fraction"][1], report["empty_fraction"][0]);
  EXPECT_NE(result.err.find("no data of one colour"), std::string::npos) << result.err;
  const auto developed = lowlux({"develop", file("sky.dng"), "-o", file("sky.png"), "--json"});
  ASSERT_EQ(developed.exit_code, 0) << developed.err;
  EXPECT_EQ(developed.err.find("noise variance"), std::string::npos) << developed.err;
  const Json picture = Json::parse(developed.out)[0];
  EXPECT_EQ(picture["width"], 450);
  EXPECT_EQ(picture["height"], 300);
  const auto kept =
      lowlux({"merge", file("night"), "-o", file("kept.dng"), "--align", "stars", "--foreground", "keep", "--explain"});
  ASSERT_EQ(kept.exit_code, 0) << kept.err;
  EXPECT_NE(kept.out.find("alignment stars"), std::string::npos);
}

TEST_F(MergeCommand, OptionsOfStarsThatContradictEachOtherAreRefused) {
  refused(frames_, {"--foreground", "keep"}, 2, "--foreground");
  refused(frames_, {"--align", "stars", "--foreground", "keep", "--mean", "plain"}, 2, "--foreground");
  refused(frames_, {"--align", "stars", "--foreground", "keep", "--drizzle", "1"}, 2, "--drizzle");
  refused(frames_, {"--align", "none", "--drizzle", "1"}, 2, "--drizzle");
  refused(frames_, {"--pixfrac", "0.5"}, 2, "--pixfrac");
  refused(frames_, {"--align", "stars", "--budget-ms", "1000"}, 2, "--budget-ms");
  refused(frames_, {"--drizzle", "2", "--budget-ms", "1000"}, 2, "--budget-ms");
  refused(frames_, {"--drizzle", "3.1"}, 2, "--drizzle");
  refused(frames_, {"--drizzle", "nan"}, 2, "--drizzle");
  refused(frames_, {"--drizzle", "1", "--pixfrac", "0.01"}, 2, "--pixfrac");
  refused(frames_, {"--drizzle", "1"}, 1, "did not move");
  refused(frames_, {"--align", "stars"}, 1, "stars were found");
}

TEST_F(MergeCommand, FramesOfOtherScenesAreReportedInOneLine) {
  const std::vector<std::string> look{"--size", "192x128", "--no-truth"};
  simulated("chart:macbeth", "chart.dng", look);
  simulated("flat", "flat.dng", look);
  simulated("dark", "dark.dng", look);
  const auto result = merge({file("flat.dng"), file("dark.dng"), file("chart.dng")}, {"--json"});
  ASSERT_EQ(result.exit_code, 0) << result.err;
  const std::string line = "2 of 3 frames match the reference in less than 10 % of the image (" + file("dark.dng") +
                           ": it differs from the reference by more than the noise)";
  const std::size_t found = result.err.find(line);
  ASSERT_NE(found, std::string::npos) << result.err;
  EXPECT_EQ(result.err.find("match the reference", found + line.size()), std::string::npos) << result.err;
  EXPECT_NE(Json::parse(result.out)["warnings"].dump().find("2 of 3 frames match"), std::string::npos);
  const auto developed =
      lowlux({"develop", "--merge", file("flat.dng"), file("dark.dng"), file("chart.dng"), "-o", file("out.png")});
  EXPECT_NE(developed.err.find(line), std::string::npos) << developed.err;
  simulated("flat", "odd.dng", {"--size", "192x128", "--no-truth", "--exposure", "0.02"});
  const auto odd_first = merge({file("odd.dng"), frames_[0], frames_[1], frames_[2]}, {"--force"});
  EXPECT_NE(
      odd_first.err.find("1 of 4 frames matches the reference in less than 10 % of the image (" + file("odd.dng")),
      std::string::npos)
      << odd_first.err;
  EXPECT_EQ(merge(frames_, {"--force"}).err, "") << "frames of one scene need no warning";
}

TEST_F(MergeCommand, ASaturatedFrameOfABracketIsNotTakenForAnotherScene) {
  const std::vector<std::string> light{"--luminance", "5", "--no-truth", "--exposure"};
  std::vector<std::string> brief = light, endless = light;
  brief.emplace_back("0.1");
  endless.insert(endless.end(), {"10", "--seed", "3"});
  simulated("flat", "brief.dng", brief);
  simulated("flat", "endless.dng", endless);
  const auto result = merge({file("brief.dng"), file("endless.dng")});
  ASSERT_EQ(result.exit_code, 0) << result.err;
  EXPECT_NE(result.err.find("1 of 2 frames matches the reference in less than 10 % of the image (" +
                            file("endless.dng") + ": no part of it can be compared"),
            std::string::npos)
      << result.err;
}

TEST_F(MergeCommand, RefusesWhatCannotBeMerged) {
  refused({}, {}, 2, "RAW");
  refused({frames_[0], frames_[0]}, {}, 2, "given twice");
  refused({frames_[0], file("none.dng")}, {}, 1, "none.dng");
  refused({frames_[0], test::dog}, {}, 1, test::dog + ": it was taken with");
  std::ofstream(file("frame of mine.dng")) << "no raw file";
  refused({frames_[0], file("frame of mine.dng")}, {}, 1, "frame of mine.dng");
  refused(frames_, {"--reference", test::dog}, 2, "--reference");
  refused(frames_, {"--align", "sideways"}, 2, "--align");
  refused(frames_, {"--false-alarm", "2"}, 2, "--false-alarm");
  std::ofstream(file("broken.dng")) << "no raw file";
  refused({frames_[0], file("broken.dng")}, {}, 1, "broken.dng");
  EXPECT_EQ(lowlux({"merge", frames_[0], "-o", frames_[0], "--force"}).exit_code, 2);
  EXPECT_EQ(lowlux({"merge", frames_[0], "-o", file("merged.png")}).exit_code, 2);
  EXPECT_EQ(lowlux({"merge", frames_[0], "-o", file("MERGED.DNG")}).exit_code, 0);
  EXPECT_EQ(lowlux({"develop", frames_[0], "-o", file("out.png"), "--align", "none"}).exit_code, 2);
  ASSERT_EQ(merge(frames_).exit_code, 0);
  const auto again = merge(frames_);
  EXPECT_EQ(again.exit_code, 1);
  EXPECT_NE(again.err.find("exists"), std::string::npos);
  EXPECT_EQ(merge(frames_, {"--force"}).exit_code, 0);
}

TEST_F(MergeCommand, AnExistingOutputIsKeptAndTheMessageNamesOptionsOfMergeOnly) {
  ASSERT_EQ(merge(frames_).exit_code, 0);
  const auto again = merge(frames_);
  EXPECT_EQ(again.exit_code, 1);
  EXPECT_NE(again.err.find("exists: use --force to overwrite it"), std::string::npos) << again.err;
  EXPECT_EQ(again.err.find("--skip-existing"), std::string::npos) << again.err;
  EXPECT_EQ(merge(frames_, {"--force"}).exit_code, 0);
  std::filesystem::remove(file("merged.dng"));
  std::filesystem::create_directory(file("merged.dng"));
  const auto folder = merge(frames_, {"--force"});
  EXPECT_EQ(folder.exit_code, 1);
  EXPECT_NE(folder.err.find("it is a directory"), std::string::npos) << folder.err;
}

TEST_F(MergeCommand, TheTimeToCheckNamesDoesNotGrowWithTheSquareOfTheirNumber) {
  const std::string folder = file("many");
  std::filesystem::create_directory(folder);
  for (int i = 0; i < 5000; ++i) {  // links to nothing: only names are checked before the first is read
    std::filesystem::create_symlink("none", fmt::format("{}/{}.dng", folder, i));
  }
  const auto begin = std::chrono::steady_clock::now();
  refused({folder}, {}, 1, "no such file");
  // It takes 0.1 s, and 15 s or more if each is compared with each.
  EXPECT_LT(std::chrono::steady_clock::now() - begin, std::chrono::seconds(5));
}

}  // namespace
}  // namespace lowlux
