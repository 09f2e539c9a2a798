#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "capture/file/dng_source.h"
#include "isp/cli/develop/dark_files.h"
#include "isp/cli/shared/raw_files.h"
#include "isp/raw/measure/masked_black.h"
#include "tests/cli/command.h"
#include "tests/cli/simulate_command.h"

namespace lowlux {
namespace {

using test::lowlux;

using Json = nlohmann::json;

// A warm sensor with hot pixels, a picture of 1 s, and darks beside it.
class DarkFrameCommand : public test::SimulateCommand {
 protected:
  void SetUp() override { picture("night.dng", {"--luminance", "0.02", "--seed", "99"}); }

  static std::vector<std::string> sensor(const std::vector<std::string>& more) {
    std::vector<std::string> args{"--read-noise",  "3",   "--dark-current",   "60", "--hot-pixels", "0.002",
                                  "--hot-current", "800", "--masked-columns", "64", "--effects",    "all",
                                  "--no-truth"};
    args.insert(args.end(), more.begin(), more.end());
    return args;
  }
  void picture(const std::string& name, const std::vector<std::string>& more) {
    auto args = sensor(more);
    args.insert(args.end(), {"--size", "96x64", "--exposure", "1"});
    simulated("chart:macbeth", name, args);
  }
  void darks(const std::string& name, const std::string& exposure_s, int frames,
             const std::vector<std::string>& more = {}) {
    std::filesystem::create_directories(std::filesystem::path(file(name)).parent_path());
    auto args = sensor(more);
    args.insert(args.end(), {"--exposure", exposure_s, "--frames", std::to_string(frames)});
    if (std::ranges::find(more, "--size") == more.end()) args.insert(args.end(), {"--size", "96x64"});
    simulated("dark", name, args);
  }
  test::ProcessResult developed(const std::vector<std::string>& more) {
    std::vector<std::string> args{"develop", file("night.dng"), "-o", file("out.png"), "--force", "--json"};
    args.insert(args.end(), more.begin(), more.end());
    return lowlux(args);
  }
  Json report(const std::vector<std::string>& more) {
    const auto result = developed(more);
    EXPECT_EQ(result.exit_code, 0) << result.err;
    return result.exit_code == 0 ? Json::parse(result.out)[0] : Json();
  }
  void refused(const std::vector<std::string>& more, int exit_code, const std::string& why) {
    const auto result = developed(more);
    EXPECT_EQ(result.exit_code, exit_code) << result.err;
    EXPECT_NE((result.err + result.out).find(why), std::string::npos) << why << "\n" << result.err << result.out;
    EXPECT_FALSE(std::filesystem::exists(file("out.png")));
  }
};

TEST_F(DarkFrameCommand, AFolderOfDarksIsTakenOffAndTheReportSaysWhatWasDone) {
  darks("darks/d.dng", "1", 16);
  const Json with = report({"--dark-frame", file("darks")});
  EXPECT_EQ(with["black"]["source"], "dark-frame");
  EXPECT_EQ(with["black"]["holds_dark"], true);
  EXPECT_EQ(with["dark_frame"]["frames"], 16);
  EXPECT_EQ(with["dark_frame"]["settings"], 1);
  EXPECT_EQ(with["dark_frame"]["scale"], 1);
  EXPECT_TRUE(with["dark_frame"]["doubling_c"].is_null());
  EXPECT_NEAR(with["dark_frame"]["noise_share"].get<double>(), 1.0 / 16, 1e-9);
  EXPECT_TRUE(report({})["dark_frame"].is_null());
}

TEST_F(DarkFrameCommand, FilesByCommaAndRepeatedAreOneStackAndFewAddNoMoreThanAllowed) {
  darks("darks/d.dng", "1", 4);
  const auto dark = [&](int i) { return file("darks/d_000" + std::to_string(i) + ".dng"); };
  const Json three = report({"--dark-frame", dark(0) + "," + dark(1), "--dark-frame", dark(2)});
  EXPECT_EQ(three["dark_frame"]["frames"], 3);
  EXPECT_LE(three["dark_frame"]["noise_share"].get<double>(), 0.1 + 1e-9);
  const Json strict = report({"--dark-frame", file("darks"), "--dark-noise", "0.02"});
  EXPECT_LT(strict["dark_frame"]["noise_share"].get<double>(), three["dark_frame"]["noise_share"].get<double>());
  const Json whole = report({"--dark-frame", file("darks"), "--dark-noise", "1"});
  EXPECT_NEAR(whole["dark_frame"]["noise_share"].get<double>(), 0.25, 1e-9);
  EXPECT_EQ(whole["dark_frame"]["pattern_share"], 1);
  const Json one = report({"--dark-frame", dark(0)});
  EXPECT_NE(one["warnings"].dump().find("single dark"), std::string::npos);
}

TEST_F(DarkFrameCommand, OtherTimesAndTemperaturesAreScaledAndSaidSo) {
  darks("short/d.dng", "0.01", 4);
  darks("long/d.dng", "3", 4);
  darks("warm/d.dng", "1", 4, {"--temperature", "27"});
  const Json times = report({"--dark-frame", file("short"), "--dark-frame", file("long")});
  EXPECT_EQ(times["dark_frame"]["settings"], 2);
  EXPECT_NEAR(times["dark_frame"]["scale"].get<double>(), 1.0 / 3, 1e-6);
  const Json warm = report({"--dark-frame", file("warm"), "--dark-doubling", "7"});
  EXPECT_NEAR(warm["dark_frame"]["scale"].get<double>(), 0.5, 1e-6);
  EXPECT_EQ(warm["dark_frame"]["doubling_c"], 7);
  EXPECT_NE(warm["warnings"].dump().find("27"), std::string::npos);
}

TEST_F(DarkFrameCommand, WhatCannotBeIsRefusedWithACure) {
  darks("darks/d.dng", "1", 2);
  darks("warm/d.dng", "1", 2, {"--temperature", "27"});
  darks("brief/d.dng", "0.1", 2);
  darks("other/d.dng", "1", 2, {"--size", "64x64"});
  const std::string folder = file("darks");
  refused({"--dark-frame", folder, "--black", "600"}, 2, "green shadows");
  refused({"--dark-frame", folder + "," + file("night.dng")}, 2, "one of its darks");
  refused({"--dark-noise", "0.1"}, 2, "--dark-frame");
  refused({"--dark-frame", folder, "--dark-noise", "0"}, 2, "share");
  refused({"--dark-frame", folder, "--dark-noise", "nan"}, 2, "share");
  refused({"--dark-frame", folder, "--dark-doubling", "1"}, 2, "2 to 30");
  refused({"--dark-frame", folder, "--dark-doubling", "hot"}, 2, "profile");
  refused({"--dark-frame", folder, "--dark-doubling", file("none.json")}, 1, "none.json");
  refused({"--dark-frame", file("nowhere.dng")}, 1, "nowhere.dng");
  refused({"--dark-frame", file("")}, 2, "one of its darks");  // the folder of the picture itself
  std::filesystem::create_directories(file("empty"));
  refused({"--dark-frame", file("empty")}, 1, "no raw files");
  refused({"--dark-frame", file("empty/*.dng")}, 1, "no file matches");
  refused({"--dark-frame", file("warm")}, 1, "--dark-doubling");
  refused({"--dark-frame", file("brief")}, 1, "at most 4 times");
  refused({"--dark-frame", file("other")}, 1, "pixels");
}

// The masked pixels of two pictures never have the same mean.
TEST_F(DarkFrameCommand, IsMadeOnceForAllPicturesOfASetting) {
  picture("later.dng", {"--luminance", "0.02", "--seed", "100"});
  darks("same/d.dng", "1", 4);
  darks("long/d.dng", "2", 4);
  RawFrame first = *capture::read_raw(file("night.dng")), later = *capture::read_raw(file("later.dng"));
  const auto level = [](const RawFrame& frame) { return isp::measure_masked_black(frame.raw).black->pedestal_dn; };
  ASSERT_NE(level(first), level(later));
  const auto same = *cli::read_darks(*cli::raw_files_of(file("same")), {});
  const auto made = same->frame_for(first);
  ASSERT_TRUE(made) << made.error().message;
  EXPECT_EQ(*same->frame_for(later), *made);
  const auto scaled = *cli::read_darks(*cli::raw_files_of(file("long")), {});
  const auto before = scaled->frame_for(first), after = scaled->frame_for(later);
  ASSERT_TRUE(before && after);
  for (int site = 0; site < 4; ++site) {
    EXPECT_NEAR((*after)->mean_dn[site] - (*before)->mean_dn[site], level(later)[site] - level(first)[site], 1e-9);
  }
}

TEST_F(DarkFrameCommand, DarksThatHoldLightAreRefused) {
  std::filesystem::create_directories(file("lit"));
  picture("lit/d.dng", {"--luminance", "0.2", "--seed", "5"});
  refused({"--dark-frame", file("lit")}, 1, "covered");
}

}  // namespace
}  // namespace lowlux
