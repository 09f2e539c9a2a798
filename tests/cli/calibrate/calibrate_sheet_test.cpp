#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "tests/cli/command.h"
#include "tests/support/scratch_directory.h"

namespace lowlux {
namespace {

using test::holds;
using test::lowlux;

using Json = nlohmann::json;
using Words = std::vector<std::string>;

constexpr double gain = 0.5, read_noise_e = 3, current_e_per_s = 4, prnu = 0.01, dsnu = 0.25, column_noise_e = 1;
constexpr double doubling_c = 6, full_well_e = 20000;

/// Frames of one simulated sensor, in folders of a scratch directory.
class DataSheetCommand : public testing::Test {
 protected:
  std::string file(const std::string& name) const { return scratch_.file(name); }

  void shoot(const std::string& name, const std::string& scene, const std::string& time_s, int frames,
             const std::string& temperature_c = "20") {
    const auto done = lowlux({"simulate",
                              scene,
                              "-o",
                              file(name),
                              "--size",
                              "160x128",
                              "--sensor",
                              "ELD_NikonD850",
                              "--gain",
                              "ISO 1600",
                              "--iso",
                              "1600",
                              "--system-gain",
                              "0.5",
                              "--read-noise",
                              "3",
                              "--full-well",
                              "20000",
                              "--bits",
                              "16",
                              "--white-level",
                              "65535",
                              "--dark-current",
                              "4",
                              "--dark-doubling",
                              "6",
                              "--prnu",
                              "0.01",
                              "--dsnu",
                              "0.25",
                              "--column-noise",
                              "1",
                              "--hot-pixels",
                              "0",
                              "--row-noise",
                              "0",
                              "--luminance",
                              "1",
                              "--exposure",
                              time_s,
                              "--temperature",
                              temperature_c,
                              "--frames",
                              std::to_string(frames),
                              "--no-truth",
                              "--quiet",
                              "--effects",
                              "all",
                              "--seed",
                              std::to_string(++seed_),
                              "--sensor-seed",
                              "77"});
    ASSERT_EQ(done.exit_code, 0) << done.err;
  }

  void shoot_all() {
    std::filesystem::create_directory(file("flats"));
    std::filesystem::create_directory(file("darks"));
    for (const char* time_s :
         {"0.003", "0.01", "0.02", "0.03", "0.05", "0.07", "0.09", "0.11", "0.14", "0.2", "0.4", "2"}) {
      shoot(std::string("flats/f") + time_s + ".dng", "flat", time_s, 4);
    }
    shoot("darks/a.dng", "dark", "1", 8);
    shoot("darks/b.dng", "dark", "5", 8);
    shoot("darks/c.dng", "dark", "1", 8, "32");
    shoot("darks/d.dng", "dark", "5", 8, "32");
  }

  Words sheet(const Words& more) const {
    Words words{"calibrate", "sheet", file("flats"), "--darks", file("darks"), "-o", file("sheet.html")};
    words.insert(words.end(), more.begin(), more.end());
    return words;
  }

  test::ScratchDirectory scratch_;
  int seed_ = 900;
};

TEST_F(DataSheetCommand, FiguresOfSimulatedFramesAreThoseOfTheSensor) {
  shoot_all();
  const auto done = lowlux(sheet({"--steady-light", "--json", "--quiet"}));
  ASSERT_EQ(done.exit_code, 0) << done.err;
  EXPECT_EQ(done.err, "");
  EXPECT_EQ(done.out, scratch_.read("sheet.json"));
  const Json figures = Json::parse(done.out)["figures"];
  const auto near = [&](const std::string& key, double truth) {
    ASSERT_TRUE(figures.contains(key) && figures[key].is_object()) << key;
    const double value = figures[key]["value"], error = figures[key]["standard_error"];
    EXPECT_NEAR(value, truth, 5 * error) << key;
  };
  near("system_gain_dn_per_e", gain);
  near("temporal_dark_noise_e", std::sqrt(read_noise_e * read_noise_e + current_e_per_s));
  near("sensitivity_threshold_e",
       std::sqrt(read_noise_e * read_noise_e + current_e_per_s + 1 / (12 * gain * gain) + 0.25) + 0.5);
  near("dsnu_column_e", column_noise_e);
  near("dsnu_pixel_e", dsnu * current_e_per_s);
  near("prnu_pixel", prnu);
  near("dark_current_by_mean_e_per_s_at_20_c", current_e_per_s);
  near("dark_current_by_variance_e_per_s_at_20_c", current_e_per_s);
  near("dark_current_by_mean_e_per_s_at_32_c", current_e_per_s * std::exp2(12 / doubling_c));
  near("dark_current_doubling_c", doubling_c);
  EXPECT_LT(figures["linearity_error"]["value"].get<double>(), 0.02);
  EXPECT_TRUE(figures["quantum_efficiency_g"].is_null());
  const std::string page = scratch_.read("sheet.html");
  for (const char* part : {"Data sheet", "PRNU1288 of columns", "Spectrogram along rows", "Histogram of the darks",
                           "Photon transfer curve"}) {
    EXPECT_TRUE(holds(page, part)) << part;
  }
  const auto again = lowlux(sheet({}));
  EXPECT_EQ(again.exit_code, 1);
  EXPECT_TRUE(holds(again.err, "--force")) << again.err;
  const auto text = lowlux(sheet({"--force", "--irradiance", "0.001", "--wavelength", "550", "--pixel-pitch", "4"}));
  EXPECT_EQ(text.exit_code, 0) << text.err;
  EXPECT_TRUE(holds(text.out, "quantum efficiency of G")) << text.out;
  const Json measured = Json::parse(scratch_.read("sheet.json"))["figures"];
  EXPECT_GT(measured["quantum_efficiency_g"]["value"].get<double>(), 0);
  // No file can be made in the folder of this one.
  std::filesystem::remove(file("sheet.html"));
  std::filesystem::remove(file("sheet.json"));
  std::filesystem::create_symlink("/proc/version", file("sheet.json"));
  const auto half = lowlux(sheet({"--force", "--quiet"}));
  EXPECT_EQ(half.exit_code, 1);
  EXPECT_TRUE(holds(half.err, "sheet.json")) << half.err;
  EXPECT_FALSE(scratch_.holds("sheet.html"));
  const double snr_max = measured["snr_max"]["value"];  // at the last level before saturation, up to 0.6 of the next
  EXPECT_GT(snr_max, std::sqrt(0.6 * full_well_e));
  EXPECT_LT(snr_max, std::sqrt(1.02 * full_well_e));
}

TEST_F(DataSheetCommand, FlatsMayWarmUpAndMissingDarksAreWarnedOf) {
  shoot_all();
  for (const char* time_s : {"0.05", "0.07", "0.09", "0.11"}) {
    shoot(std::string("flats/warm") + time_s + ".dng", "flat", time_s, 4, "24");
  }
  const auto done = lowlux(sheet({"--irradiance", "0.001", "--wavelength", "550", "--pixel-pitch", "4"}));
  ASSERT_EQ(done.exit_code, 0) << done.err;
  EXPECT_TRUE(holds(scratch_.read("sheet.html"), "and of 8 flats")) << done.err;
  // Flats at 20 C have the dark current of that temperature; those at 24 C have none, and none has darks of its time.
  const Json json = Json::parse(scratch_.read("sheet.json"));
  EXPECT_NEAR(json["figures"]["prnu_pixel"]["value"], prnu,
              5 * json["figures"]["prnu_pixel"]["standard_error"].get<double>());
  ASSERT_EQ(json["warnings"].size(), 2u) << json["warnings"];
  EXPECT_TRUE(holds(done.err, "the non-uniformity of dark current is not subtracted from PRNU")) << done.err;
  EXPECT_TRUE(holds(done.err, "dark current is not subtracted for the quantum efficiency")) << done.err;
  EXPECT_TRUE(holds(done.err, "at 24 C")) << done.err;
}

TEST_F(DataSheetCommand, WhatIsMissingIsSaidInOneLine) {
  std::filesystem::create_directory(file("flats"));
  std::filesystem::create_directory(file("darks"));
  shoot("flats/a.dng", "flat", "0.1", 2);
  shoot("darks/a.dng", "dark", "1", 2);
  const auto few = lowlux(sheet({"--quiet"}));
  EXPECT_EQ(few.exit_code, 1);
  EXPECT_EQ(std::count(few.err.begin(), few.err.end(), '\n'), 1) << few.err;
  EXPECT_FALSE(scratch_.holds("sheet.html") || scratch_.holds("sheet.json"));
  for (const Words& wrong : std::vector<Words>{{"--irradiance", "1"},
                                               {"--irradiance", "0", "--wavelength", "550", "--pixel-pitch", "4"},
                                               {"--iso", "-1"},
                                               {"-o", file("sheet.json")}}) {
    const auto done = lowlux(sheet(wrong));
    EXPECT_EQ(done.exit_code, 2) << testing::PrintToString(wrong) << done.err;
    EXPECT_EQ(std::count(done.err.begin(), done.err.end(), '\n'), 1) << done.err;
  }
}

}  // namespace
}  // namespace lowlux
