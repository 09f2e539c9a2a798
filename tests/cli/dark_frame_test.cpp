#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "capture/file/dng_source.h"
#include "isp/cli/develop/dark_files.h"
#include "isp/cli/shared/raw_files.h"
#include "isp/codec/tiff.h"
#include "isp/output/dng/dng_writer.h"
#include "isp/raw/black_point.h"
#include "tests/cli/command.h"
#include "tests/cli/simulate/simulate_command.h"
#include "tests/support/dng/float_dng.h"

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
    args.insert(args.end(), {"--size", size_, "--exposure", "1"});
    simulated("chart:macbeth", name, args);
  }
  void darks(const std::string& name, const std::string& exposure_s, int frames,
             const std::vector<std::string>& more = {}) {
    std::filesystem::create_directories(std::filesystem::path(file(name)).parent_path());
    auto args = sensor(more);
    args.insert(args.end(), {"--exposure", exposure_s, "--frames", std::to_string(frames)});
    if (std::ranges::find(more, "--size") == more.end()) args.insert(args.end(), {"--size", size_});
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

  std::string size_ = "96x64";
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
  refused({"--dark-frame", folder, "--dark-noise", "0"}, 2, "fraction");
  refused({"--dark-frame", folder, "--dark-noise", "nan"}, 2, "fraction");
  refused({"--dark-frame", folder, "--dark-doubling", "1"}, 2, "2 to 30");
  refused({"--dark-frame", folder, "--dark-doubling", "hot"}, 2, "profile");
  refused({"--dark-frame", folder, "--dark-doubling", file("none.json")}, 1, "none.json");
  refused({"--dark-frame", file("nowhere.dng")}, 1, "nowhere.dng");
  refused({"--dark-frame", file("")}, 2, "one of its darks");  // the folder of the picture itself
  std::filesystem::create_directories(file("empty"));
  refused({"--dark-frame", file("empty")}, 1, "no raw files");
  refused({"--dark-frame", file("empty/*.dng")}, 1, "no file matches");
  refused({"--dark-frame", file("warm")}, 1, "--dark-doubling");
  refused({"--dark-frame", file("brief")}, 1, "more than the limit of 4 times");
  refused({"--dark-frame", file("other")}, 1, "pixels");
}

// The masked pixels of two pictures never have the same mean.
TEST_F(DarkFrameCommand, IsMadeOnceForAllPicturesOfASetting) {
  picture("later.dng", {"--luminance", "0.02", "--seed", "100"});
  darks("same/d.dng", "1", 4);
  darks("long/d.dng", "2", 4);
  RawFrame first = *capture::read_raw(file("night.dng")), later = *capture::read_raw(file("later.dng"));
  const auto level = [](const RawFrame& frame) { return isp::masked_black_of(frame).black->pedestal_dn; };
  ASSERT_NE(level(first), level(later));
  const auto same = *cli::read_darks({*cli::raw_files_of(file("same"))}, {});
  const auto made = same->frame_for(first, {});
  ASSERT_TRUE(made) << made.error().message;
  EXPECT_EQ(*same->frame_for(later, {}), *made);
  const auto scaled = *cli::read_darks({*cli::raw_files_of(file("long"))}, {});
  const auto before = scaled->frame_for(first, {}), after = scaled->frame_for(later, {});
  ASSERT_TRUE(before && after);
  for (int site = 0; site < 4; ++site) {
    EXPECT_NEAR((*after)->mean_dn[site] - (*before)->mean_dn[site], level(later)[site] - level(first)[site], 1e-9);
  }
}

// Writes the mean of the frames as other programs do.
class MasterDarkCommand : public DarkFrameCommand {
 protected:
  void SetUp() override {
    size_ = "480x320";  // the exposure follows from the noise, which few pixels determine to 1 %
    picture("night.dng", {"--luminance", "0.02", "--seed", "99"});
    darks("darks/d.dng", "1", 16);
    Plane<float> mean;
    for (int i = 0; i < 16; ++i) {
      last_ = *capture::read_raw(file(fmt::format("darks/d_{:04}.dng", i)));
      const RawDn& raw = last_.raw;
      if (i == 0) {
        mean = Plane<float>(raw.dn.width(), raw.dn.height());
        std::fill_n(mean.data(), mean.size(), 0.0f);
      }
      for (std::size_t k = 0; k < mean.size(); ++k) mean.data()[k] += static_cast<float>(raw.dn.data()[k]) / 16;
    }
    mean_ = std::move(mean);
  }
  void write_raw(const std::string& name) {
    for (std::size_t k = 0; k < mean_.size(); ++k) {
      last_.raw.dn.data()[k] = static_cast<std::uint16_t>(std::lround(mean_.data()[k]));
    }
    ASSERT_TRUE(isp::write_dng(last_, file(name)));
  }
  /// Writes `mean_` times `factor` as a grey float TIFF; of colours if `tint` is not 1.
  void write_tiff(const std::string& name, float factor = 1, float tint = 1) {
    SceneLinear grey(mean_.width(), mean_.height());
    for (int c = 0; c < 3; ++c) {
      const float gain = c == 1 ? factor * tint : factor;
      std::transform(mean_.data(), mean_.data() + mean_.size(), grey.plane[c].data(),
                     [=](float v) { return gain * v; });
    }
    const std::unique_ptr<std::FILE, int (*)(std::FILE*)> out(std::fopen(file(name).c_str(), "w+b"), &std::fclose);
    ASSERT_TRUE(isp::encode_tiff(Picture(std::move(grey)), {}, {}, out.get()));
  }
  double mean_ciede2000(const std::string& a, const std::string& b) {
    const auto result = lowlux({"compare", file(a), file(b), "--json"});
    EXPECT_EQ(result.exit_code, 0) << result.err;
    return Json::parse(result.out)["ciede2000"]["mean"];
  }
  Json developed_to(const std::string& output, const std::vector<std::string>& more) {
    std::vector<std::string> args{"develop", file("night.dng"), "-o", file(output), "--bits", "16", "--json"};
    args.insert(args.end(), more.begin(), more.end());
    const auto result = lowlux(args);
    EXPECT_EQ(result.exit_code, 0) << result.err;
    return Json::parse(result.out)[0];
  }

  RawFrame last_;
  Plane<float> mean_;
};

TEST_F(MasterDarkCommand, GivesThePictureOfTheFramesItIsTheMeanOf) {
  write_raw("master.dng");
  write_tiff("master.tif");
  const Json frames = developed_to("frames.png", {"--dark-frame", file("darks")});
  EXPECT_EQ(frames["dark_frame"]["files"], 16);
  EXPECT_EQ(frames["dark_frame"]["frames_estimated"], false);
  const Json given = developed_to("given.png", {"--dark-frame", file("master.dng"), "--dark-frame-count", "16"});
  EXPECT_EQ(given["dark_frame"]["frames"], 16);
  EXPECT_EQ(given["dark_frame"]["files"], 1);
  EXPECT_EQ(given["dark_frame"]["frames_estimated"], false);
  EXPECT_EQ(given["warnings"].dump().find("single dark"), std::string::npos);
  // Rounding adds 1/12 DN^2 to about 15 DN^2 / 16.
  EXPECT_GT(given["dark_frame"]["noise_share"], frames["dark_frame"]["noise_share"]);
  const Json tiff = developed_to("tiff.png", {"--dark-frame", file("master.tif"), "--dark-frame-count", "16"});
  EXPECT_NE(tiff["warnings"].dump().find("are assumed"), std::string::npos);
  EXPECT_LT(mean_ciede2000("frames.png", "tiff.png"), 0.1);  // the figure
}

TEST_F(MasterDarkCommand, TheNumberOfFramesOfSeveralRawMastersIsEstimated) {
  for (const char* const name : {"one", "two"}) {
    mean_ = Plane<float>(mean_.width(), mean_.height());
    std::fill_n(mean_.data(), mean_.size(), 0.0f);
    darks(fmt::format("{}/d.dng", name), "1", 8, {"--seed", name == std::string("one") ? "700" : "800"});
    for (int i = 0; i < 8; ++i) {
      last_ = *capture::read_raw(file(fmt::format("{}/d_{:04}.dng", name, i)));
      for (std::size_t k = 0; k < mean_.size(); ++k) mean_.data()[k] += static_cast<float>(last_.raw.dn.data()[k]) / 8;
    }
    write_raw(fmt::format("master_{}.dng", name));
  }
  const Json report =
      developed_to("x.png", {"--dark-frame", file("master_one.dng") + "," + file("master_two.dng")})["dark_frame"];
  EXPECT_EQ(report["files"], 2);
  EXPECT_EQ(report["frames_estimated"], true);
  EXPECT_NEAR(report["frames"].get<double>(), 16, 3);  // whole numbers of two files
}

// In codes, and as fractions of white, which DNG has where no white level is stated.
TEST_F(MasterDarkCommand, AFloatingPointDngGivesTheImageOfTheSameTiff) {
  write_tiff("master.tif");
  developed_to("tiff.png", {"--dark-frame", file("master.tif"), "--dark-frame-count", "16"});
  const double white = last_.raw.white_dn[0];
  for (const bool in_codes : {true, false}) {
    Plane<float> values = mean_.clone();
    const auto scale = static_cast<float>(in_codes ? 1 : 1 / white);
    std::transform(values.data(), values.data() + values.size(), values.data(), [=](float v) { return scale * v; });
    test::DngBuilder dng = test::float_dng(values, in_codes ? std::optional(white) : std::nullopt);
    dng.remove(271).remove(272).remove(50708);  // Make, Model and UniqueCameraModel
    const auto bytes = dng.build();
    std::ofstream(file("master.dng"), std::ios::binary)
        .write(reinterpret_cast<const char*>(bytes.data()), static_cast<std::streamsize>(bytes.size()));
    const std::string name = in_codes ? "codes.png" : "fractions.png";
    const Json report = developed_to(name, {"--dark-frame", file("master.dng"), "--dark-frame-count", "16"});
    EXPECT_NE(report["warnings"].dump().find("a floating-point DNG does not state"), std::string::npos);
    EXPECT_LT(mean_ciede2000("tiff.png", name), 0.01) << "floats";
  }
  mean_.at(3, 5) = std::nanf("");
  const auto bytes = test::float_dng(mean_, white).build();
  std::ofstream(file("nan.dng"), std::ios::binary)
      .write(reinterpret_cast<const char*>(bytes.data()), static_cast<std::streamsize>(bytes.size()));
  refused({"--dark-frame", file("nan.dng")}, 1, "column 3, row 5");
}

TEST_F(MasterDarkCommand, TheNumberOfItsFramesIsEstimated) {
  write_tiff("master.tif");
  write_tiff("fractions.tiff", 1.0f / 65535);
  const Json report = developed_to("estimated.png", {"--dark-frame", file("master.tif")});
  EXPECT_EQ(report["dark_frame"]["frames_estimated"], true);
  // 38,400 pairs of pixels; with the noise of the image, about 3 times a dark's, an error of sqrt(50 / 38400) = 0.036.
  EXPECT_NEAR(report["dark_frame"]["frames"].get<double>(), 16, 16 * 5 * 0.036);
  const Json scaled = developed_to("scaled.png", {"--dark-frame", file("fractions.tiff")});
  EXPECT_NE(scaled["warnings"].dump().find("65535"), std::string::npos);
  EXPECT_EQ(scaled["dark_frame"]["frames"], report["dark_frame"]["frames"]);
  const auto explained = developed({"--dark-frame", file("master.tif"), "--explain"});
  EXPECT_EQ(explained.exit_code, 0);
}

TEST_F(MasterDarkCommand, WhatCannotBeIsRefusedInOneLine) {
  write_tiff("tint.tif", 1, 0.9f);
  write_tiff("half.tif", 0.5f);
  mean_.at(3, 5) = std::nanf("");
  write_tiff("nan.tif");
  mean_ = Plane<float>(32, 32);
  std::fill_n(mean_.data(), mean_.size(), 600.0f);
  write_tiff("small.tif");
  std::ofstream(file("text.tif")) << "no TIFF";
  refused({"--dark-frame", file("tint.tif")}, 1, "has colours");
  refused({"--dark-frame", file("half.tif")}, 1, "half.tif");
  refused({"--dark-frame", file("nan.tif")}, 1, "column 3, row 5");
  refused({"--dark-frame", file("small.tif")}, 1, "32 x 32");
  refused({"--dark-frame", file("text.tif")}, 1, "text.tif");
  refused({"--dark-frame", file("none.tif")}, 1, "none.tif");
  refused({"--dark-frame", file("darks"), "--dark-frame-count", "0"}, 2, "--dark-frame-count");
  refused({"--dark-frame-count", "16"}, 2, "--dark-frame");
}

TEST_F(DarkFrameCommand, BiasFramesScaleDarksOfAnotherTime) {
  darks("bias/b.dng", "0.0001", 8);
  darks("long/d.dng", "3", 8);
  const Json both = report({"--bias-frame", file("bias"), "--dark-frame", file("long")});
  const Json library = report({"--dark-frame", file("bias"), "--dark-frame", file("long")});
  EXPECT_EQ(both["black"]["pedestal_dn"], library["black"]["pedestal_dn"]);
  EXPECT_EQ(both["dark_frame"]["settings"], 2);
  EXPECT_EQ(both["dark_frame"]["is_bias"], false);
  EXPECT_EQ(both["black"]["holds_dark"], true);
}

TEST_F(DarkFrameCommand, BiasFramesAloneGiveThePatternAndMaskedPixelsTheLevel) {
  darks("bias/b.dng", "0.0001", 16);
  const Json masked = report({"--bias-frame", file("bias")});
  EXPECT_EQ(masked["dark_frame"]["is_bias"], true);
  EXPECT_EQ(masked["black"]["holds_dark"], true);
  const Json plain = report({});
  for (int site = 0; site < 4; ++site) {
    EXPECT_NEAR(masked["black"]["pedestal_dn"][site].get<double>(), plain["black"]["pedestal_dn"][site].get<double>(),
                1e-9);
  }
  RawFrame bare = *capture::read_raw(file("night.dng"));
  bare.raw.masked.clear();
  const auto source = *cli::read_darks({{}, *cli::raw_files_of(file("bias"))}, {});
  const auto dark = source->frame_for(bare, {isp::BlackChoice::metadata});
  ASSERT_TRUE(dark) << dark.error().message;
  EXPECT_FALSE((*dark)->holds_dark);  // 60 e- of dark charge are left
  // 6144 pixels of 16 frames of 3 e- at 0.41 DN/e-: 0.02 DN for each site; the pedestal is 1024.
  for (const double level : (*dark)->mean_dn) EXPECT_NEAR(level, 1024, 0.1);
}

TEST_F(DarkFrameCommand, BiasFramesThatAreNoneAreRefused) {
  darks("brief/d.dng", "0.3", 2);
  refused({"--bias-frame", file("brief")}, 1, "exposure time of a bias frame is 0.3 s");
  refused({"--bias-frame", file("brief"), "--black", "600"}, 2, "green shadows");
  refused({"--bias-frame", file("night.dng")}, 2, "one of its bias frames");
  refused({"--bias-frame", file("some.tif")}, 1, "exposure time");
}

TEST_F(DarkFrameCommand, DarksThatHoldLightAreRefused) {
  std::filesystem::create_directories(file("lit"));
  picture("lit/d.dng", {"--luminance", "0.2", "--seed", "5"});
  refused({"--dark-frame", file("lit")}, 1, "covered");
}

}  // namespace
}  // namespace lowlux
