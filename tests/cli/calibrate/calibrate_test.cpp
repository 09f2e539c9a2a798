#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "tests/cli/command.h"
#include "tests/support/process.h"
#include "tests/support/scratch_directory.h"

namespace lowlux {
namespace {

using test::holds;
using test::lowlux;

using Json = nlohmann::json;
using Words = std::vector<std::string>;

constexpr const char* site_names[] = {"site_00", "site_01", "site_10", "site_11"};

/// A simulated camera's darks and flats as files, and the command that measures them.
class Calibrate : public testing::Test {
 protected:
  std::string file(const std::string& name) const { return scratch_.file(name); }
  bool exists(const std::string& name) const { return scratch_.holds(name); }

  /// Frames NAME_0000.dng..., 0.5 DN/e-, 2 e- of read noise, 20 e-/s of dark current at 20 C; ISO 1600 if not in
  /// `more`.
  Words shoot(const std::string& name, const std::string& scene, const std::string& time_s, int frames,
              const Words& more = {}, const std::string& size = "128x128") {
    Words words{"simulate",
                scene,
                "-o",
                file(name + ".dng"),
                "--size",
                size,
                "--sensor",
                "ELD_NikonD850",
                "--gain",
                "ISO 1600",
                "--system-gain",
                "0.5",
                "--read-noise",
                "2",
                "--full-well",
                "20000",
                "--dark-current",
                "20,30,25",
                "--dark-doubling",
                "6",
                "--exposure",
                time_s,
                "--frames",
                std::to_string(frames),
                "--no-truth",
                "--quiet",
                "--effects",
                "all",
                "--seed",
                std::to_string(++seed_)};
    words.insert(words.end(), more.begin(), more.end());
    if (std::ranges::find(more, "--iso") == more.end()) words.insert(words.end(), {"--iso", "1600"});
    const auto done = lowlux(words);
    EXPECT_EQ(done.exit_code, 0) << done.err;
    Words out;
    for (int i = 0; i < frames; ++i) {
      char text[16];
      std::snprintf(text, sizeof text, "_%04d", i);
      out.push_back(file(name + (frames == 1 ? "" : text) + ".dng"));
    }
    return out;
  }

  static Words joined(Words a, const Words& b) {
    a.insert(a.end(), b.begin(), b.end());
    return a;
  }

  Json profile(const std::string& name) { return Json::parse(scratch_.read(name)); }

  test::ScratchDirectory scratch_;
  int seed_ = 0;
};

TEST_F(Calibrate, BlackFindsWhatTheSensorHas) {
  Words darks = joined(shoot("a", "dark", "0.001", 4), shoot("b", "dark", "10", 4));
  darks = joined(darks, shoot("c", "dark", "10", 4, {"--temperature", "32"}));
  const auto done = lowlux(joined({"calibrate", "black", "-o", file("p.json"), "--system-gain", "0.5", "--report",
                                   file("p.html"), "--map", file("map")},
                                  darks));
  ASSERT_EQ(done.exit_code, 0) << done.err;
  EXPECT_TRUE(holds(done.out, "dark colour"));
  EXPECT_TRUE(holds(done.out, "doubling"));
  const Json gain = profile("p.json")["gains"][0];
  EXPECT_EQ(gain["iso"], 1600);
  EXPECT_EQ(gain["pedestal_holds"], "pedestal");
  const Json& sensor = gain["sensor"];
  const auto near = [&](const char* key, double truth, double factor) {
    const double value = sensor[key]["value"], error = sensor[key]["standard_error"];
    EXPECT_NEAR(value / factor, truth, 5 * error / factor) << key;
    EXPECT_LT(error, 0.05 * value) << key;
  };
  const double factor = std::exp2((sensor["dark_temperature_c"].get<double>() - 20) / 6);
  near("dark_current_red_e_per_s", 20, factor);
  near("dark_current_green_e_per_s", 30, factor);
  near("dark_current_blue_e_per_s", 25, factor);
  near("dark_doubling_c", 6, 1);
  near("read_noise_e", 2, 1);
  EXPECT_EQ(gain["provenance"].size(), 2U);  // the full well was not measured
  const std::string page = scratch_.read("p.html");
  for (const char* plot :
       {"Dark charge against time", "Dark current against temperature", "Colour of the dark current"}) {
    EXPECT_TRUE(holds(page, plot)) << plot;
  }
  // Pedestal and two currents of three settings: nothing is left to test the fit.
  EXPECT_FALSE(holds(page, "Residuals"));
  EXPECT_TRUE(holds(page, "add a third exposure time") && holds(done.out, "add a third exposure time"));
  EXPECT_FALSE(holds(page, "+- 0"));
  EXPECT_TRUE(holds(page, "c_0003.dng") && holds(page, "Next step: lowlux develop"));
  EXPECT_TRUE(exists("map_pedestal.pfm") && exists("map_current.pfm"));
}

TEST_F(Calibrate, BlackTakesTheGainFromTheDarkChargeOrSaysThatItCannot) {
  const Words shorts = shoot("a", "dark", "0.001", 6), longs = shoot("b", "dark", "10", 6);
  const auto done = lowlux(joined({"calibrate", "black", "-o", file("p.json")}, joined(shorts, longs)));
  ASSERT_EQ(done.exit_code, 0) << done.err;
  EXPECT_TRUE(holds(done.out, "from the noise of the dark charge"));
  const Json gain = profile("p.json")["gains"][0]["sensor"]["system_gain_dn_per_e"];
  EXPECT_NEAR(gain["value"], 0.5, 5 * gain["standard_error"].get<double>());
  const auto refused =
      lowlux(joined({"calibrate", "black", "-o", file("q.json")}, joined(shorts, shoot("c", "dark", "0.002", 6))));
  EXPECT_EQ(refused.exit_code, 1);
  EXPECT_TRUE(holds(refused.err, "--system-gain"));
  EXPECT_FALSE(exists("q.json"));
}

TEST_F(Calibrate, BlackWarnsOfFramesThatAreFarAboveTheirBlackLevel) {
  const auto dark = lowlux(joined({"calibrate", "black", "-o", file("p.json")}, shoot("a", "dark", "0.001", 4)));
  ASSERT_EQ(dark.exit_code, 0) << dark.err;
  EXPECT_FALSE(holds(dark.err, "light")) << dark.err;
  const Words lit = shoot("b", "flat", "0.1", 4, {"--luminance", "1"});
  const auto done = lowlux(joined({"calibrate", "black", "-o", file("q.json")}, lit));
  EXPECT_EQ(done.exit_code, 0) << done.err;
  EXPECT_TRUE(holds(done.err, "of the range above the black level of their files")) << done.err;
}

TEST_F(Calibrate, NoiseFindsGainReadNoiseAndFullWell) {
  const Words darks = shoot("d", "dark", "0.001", 4);
  Words flats;
  int n = 0;
  for (const char* luminance : {"0.05", "0.1", "0.2", "0.4", "0.7", "1", "1.4", "20"}) {
    flats = joined(flats, shoot("f" + std::to_string(n++), "flat", "0.1", 2, {"--luminance", luminance}));
  }
  Words words = joined({"calibrate", "noise", "-o", file("p.json"), "--report", file("p.html"), "--json"}, flats);
  for (const std::string& dark : darks) words = joined(words, {"--darks", dark});
  const auto done = lowlux(words);
  ASSERT_EQ(done.exit_code, 0) << done.err;
  const Json out = Json::parse(done.out);
  EXPECT_EQ(out["profile"], profile("p.json"));
  const Json& sensor = out["profile"]["gains"][0]["sensor"];
  EXPECT_NEAR(sensor["system_gain_dn_per_e"]["value"], 0.5,
              5 * sensor["system_gain_dn_per_e"]["standard_error"].get<double>());
  EXPECT_NEAR(sensor["read_noise_e"]["value"], 2, 5 * sensor["read_noise_e"]["standard_error"].get<double>());
  EXPECT_GT(sensor["full_well_e"]["standard_error"].get<double>(), 0);
  EXPECT_TRUE(holds(scratch_.read("p.html"), "Photon transfer curve"));

  // The black point of darks is added to it, with its gain.
  const auto added = lowlux(joined({"calibrate", "black", "-o", file("p.json"), "--force", "--add-to", file("p.json")},
                                   joined(darks, shoot("l", "dark", "10", 4))));
  ASSERT_EQ(added.exit_code, 0) << added.err;
  const Json both = profile("p.json");
  ASSERT_EQ(both["gains"].size(), 1U);
  EXPECT_EQ(both["gains"][0]["sensor"]["full_well_e"], sensor["full_well_e"]);
  EXPECT_GT(both["gains"][0]["sensor"]["dark_current_red_e_per_s"]["value"], 10);
}

TEST_F(Calibrate, NoiseOfTwoIsosIsOneProfileThatDevelopsBoth) {
  const auto shoot_at = [&](const std::string& iso, const std::string& name, const std::string& scene, int frames,
                            double luminance) {
    const auto done = lowlux({"simulate",    scene,
                              "-o",          file(iso + name + ".dng"),
                              "--size",      "128x128",
                              "--gain",      iso,
                              "--exposure",  "0.1",
                              "--luminance", std::to_string(1600 / std::stod(iso) * luminance),
                              "--frames",    std::to_string(frames),
                              "--no-truth",  "--quiet",
                              "--effects",   "all",
                              "--seed",      std::to_string(++seed_)});
    EXPECT_EQ(done.exit_code, 0) << done.err;
  };
  for (const std::string iso : {"100", "1600"}) {
    shoot_at(iso, "dark", "dark", 4, 0);
    int n = 0;
    for (const double luminance : {0.1, 0.2, 0.4, 1.0, 1.6, 2.4}) {
      shoot_at(iso, "flat" + std::to_string(n++), "flat", 2, luminance);
    }
    shoot_at(iso, "night", "chart", 1, 0.5);
  }
  const auto done =
      lowlux({"calibrate", "noise", file("*flat*.dng"), "--darks", file("*dark*.dng"), "-o", file("p.json")});
  ASSERT_EQ(done.exit_code, 0) << done.err;
  const Json found = profile("p.json");
  EXPECT_EQ(found["model"], "ELD_NikonD850");
  ASSERT_EQ(found["gains"].size(), 2U);
  for (std::size_t i = 0; i < 2; ++i) {
    const Json& gain = found["gains"][i];
    const std::string iso = std::to_string(gain["iso"].get<int>());
    const Json& measured = gain["sensor"]["system_gain_dn_per_e"];
    EXPECT_NEAR(measured["value"], iso == "100" ? 0.415 : 6.641, 5 * measured["standard_error"].get<double>());
    const auto developed =
        lowlux({"develop", file(iso + "night.dng"), "-o", file(iso + ".png"), "--profile", file("p.json"), "--json"});
    ASSERT_EQ(developed.exit_code, 0) << developed.err;
    const Json level = Json::parse(developed.out)[0]["black"]["pedestal_dn"][0];
    EXPECT_NEAR(level, gain["pedestal_dn"]["site_00"]["value"], 1e-6) << iso;
  }
}

TEST_F(Calibrate, OnePictureTellsItsNoiseAndIsHeldAgainstItsFile) {
  const std::string night = file("n.dng");
  const auto made = lowlux({"simulate",
                            std::string(LOWLUX_TESTDATA) + "/pictures/kodim15.png",
                            "-o",
                            night,
                            "--sensor",
                            "ELD_NikonD850",
                            "--gain",
                            "ISO 1600",
                            "--system-gain",
                            "2",
                            "--read-noise",
                            "2",
                            "--full-well",
                            "7000",
                            "--exposure",
                            "0.1",
                            "--luminance",
                            "0.03",
                            "--no-truth",
                            "--quiet"});
  ASSERT_EQ(made.exit_code, 0) << made.err;
  const auto done = lowlux({"calibrate", "noise", night, "-o", file("p.json"), "--report", file("p.html")});
  ASSERT_EQ(done.exit_code, 0) << done.err;
  EXPECT_TRUE(holds(done.out, "file, green")) << done.out;
  const Json gain = profile("p.json")["gains"][0];
  EXPECT_NEAR(gain["sensor"]["system_gain_dn_per_e"]["value"], 2, 0.2);
  EXPECT_EQ(gain["provenance"].back()["figures"], "noise of one picture");
  EXPECT_TRUE(holds(scratch_.read("p.html"), "file, green"));
  const auto flat = lowlux({"calibrate", "noise", shoot("d", "dark", "0.1", 1)[0], "-o", file("q.json")});
  EXPECT_EQ(flat.exit_code, 1);
  EXPECT_EQ(std::count(flat.err.begin(), flat.err.end(), '\n'), 1) << flat.err;
  EXPECT_FALSE(exists("q.json"));
}

TEST_F(Calibrate, MaskedPixelsOfAnOrdinaryFrameServe) {
  const std::string canon = std::string(LOWLUX_TESTDATA) + "/raws/canon_kissx4_ml_colorchart.dng";
  const auto light = lowlux({"calibrate", "black", canon, "-o", file("p.json")});
  EXPECT_EQ(light.exit_code, 1);
  EXPECT_TRUE(holds(light.err, "light reaches this frame") && holds(light.err, "--masked")) << light.err;
  const auto done = lowlux({"calibrate", "black", "--masked", canon, "-o", file("p.json")});
  ASSERT_EQ(done.exit_code, 0) << done.err;
  const Json gain = profile("p.json")["gains"][0];
  // testdata/README.md: 2047.4 DN in even rows and 2050.4 in odd ones.
  const auto level = [&](int site) { return gain["pedestal_dn"][site_names[site]]["value"].get<double>(); };
  EXPECT_NEAR(level(0), 2047.4, 0.5);
  EXPECT_NEAR(level(1), 2047.4, 0.5);
  EXPECT_NEAR(level(2), 2050.4, 0.5);
  EXPECT_NEAR(level(3), 2050.4, 0.5);
  EXPECT_FALSE(gain.contains("sensor"));
  EXPECT_EQ(gain["pedestal_holds"], "pedestal and dark");

  // The profile's black is the one that the picture's own masked pixels give.
  const auto developed = lowlux({"develop", canon, "-o", file("p.png"), "--half", "--json", "--black", file("p.json")});
  ASSERT_EQ(developed.exit_code, 0) << developed.err;
  const Json black = Json::parse(developed.out)[0]["black"];
  EXPECT_EQ(black["source"], "profile");
  EXPECT_NEAR(black["pedestal_dn"][2].get<double>(), level(2), 1e-9);
}

TEST_F(Calibrate, DevelopTakesBlackNoiseAndHotPixelsFromTheProfile) {
  const Words hot{"--hot-pixels", "0.002", "--hot-current", "2000", "--sensor-seed", "5"};
  const Words darks = joined(shoot("a", "dark", "0.001", 4, hot), shoot("b", "dark", "2", 16, hot));
  ASSERT_EQ(lowlux(joined({"calibrate", "black", "-o", file("p.json"), "--system-gain", "0.5"}, darks)).exit_code, 0);
  ASSERT_GT(profile("p.json")["gains"][0]["hot_pixels"].size(), 20U);
  const Words night = shoot("n", "flat", "2", 1, joined(hot, {"--luminance", "0.02"}));
  const auto developed =
      lowlux({"develop", night[0], "-o", file("n.png"), "--json", "--black", file("p.json"), "--repair", "off"});
  ASSERT_EQ(developed.exit_code, 0) << developed.err;
  const Json out = Json::parse(developed.out)[0];
  EXPECT_EQ(out["black"]["source"], "profile");
  EXPECT_GT(out["defects_repaired"], 20);
  // 2 s at 20 to 30 e-/s and 0.5 DN/e- above the pedestal.
  const double pedestal = profile("p.json")["gains"][0]["pedestal_dn"]["site_00"]["value"];
  EXPECT_NEAR(out["black"]["pedestal_dn"][0].get<double>() - pedestal, 25, 6);
  const auto longer = shoot("m", "flat", "20", 1, {"--luminance", "0.02"});
  const auto warned = lowlux({"develop", longer[0], "-o", file("m.png"), "--black", file("p.json")});
  EXPECT_EQ(warned.exit_code, 0);
  EXPECT_TRUE(holds(warned.err, "extrapolated")) << warned.err;
}

TEST_F(Calibrate, BadFramesAreOneErrorAndNoProfile) {
  const Words dark = shoot("d", "dark", "1", 2);
  const Words wide = shoot("w", "dark", "1", 1, {}, "130x128");
  const std::string canon = std::string(LOWLUX_TESTDATA) + "/raws/canon_kissx4_ml_colorchart.dng";
  const auto refused = [&](Words words, const std::string& why) {
    words.insert(words.end(), {"-o", file("p.json")});
    const auto done = lowlux(words);
    EXPECT_EQ(done.exit_code, 1) << why;
    EXPECT_TRUE(holds(done.err, why)) << done.err;
    EXPECT_EQ(std::count(done.err.begin(), done.err.end(), '\n'), 1) << done.err;
    EXPECT_FALSE(exists("p.json"));
  };
  refused({"calibrate", "black", dark[0], wide[0]}, "130 x 128 pixels");
  refused({"calibrate", "black", dark[0], canon}, "light reaches this frame");
  refused({"calibrate", "black", file("missing.dng")}, "missing.dng");
  refused({"calibrate", "black", dark[0], dark[1], shoot("e", "dark", "2", 1)[0]}, "one dark frame at 2 s");
  refused({"calibrate", "black", dark[0], "--add-to", file("missing.json")}, "missing.json");
  const Words more = shoot("m", "dark", "1", 2);
  refused({"calibrate", "noise", more[0], more[1], "--darks", dark[0] + "," + dark[1]}, "not brighter than the darks");
  refused({"calibrate", "noise", more[0], wide[0], "--darks", dark[0] + "," + dark[1]}, "130 x 128 pixels");
  refused({"calibrate", "noise", more[0], "--darks", dark[0] + "," + dark[1]}, "no two flats form a pair");
  std::filesystem::create_directories(file("empty"));
  refused({"calibrate", "noise", more[0], "--darks", file("empty")}, "no raw files");
  refused({"calibrate", "quoted", "nosuch"}, "nosuch");
  scratch_.write("future.json", R"({"format": "lowlux camera profile", "version": 9})");
  refused({"calibrate", "black", dark[0], "--add-to", file("future.json")}, "version");
}

TEST_F(Calibrate, WrongCommandLinesAreSaid) {
  const auto usage = [&](const Words& words, const std::string& why) {
    const auto done = lowlux(words);
    EXPECT_EQ(done.exit_code, 2) << why;
    EXPECT_TRUE(holds(done.err, why)) << done.err;
  };
  usage({"calibrate"}, "the first argument must be one of black, colour, noise, quoted, sheet");
  usage({"calibrate", "--json", "black"}, "sheet; --help describes them");
  usage({"calibrate", "grey"}, "unknown kind 'grey'");
  usage({"calibrate", "black", "-o", file("p.json")}, "FRAMES");
  usage({"calibrate", "black", "a.dng"}, "--output");
  usage({"calibrate", "black", "a.dng", "-o", file("p.json"), "--system-gain", "0"}, "above 0");
  usage({"calibrate", "noise", "a.dng", "b.dng", "-o", file("p.json")}, "--darks");
  usage({"calibrate", "black", "a.dng", "-o", file("p.json"), "--temperature", "999"}, "-200 to 200");
  for (const char* kind : {"black", "noise", "quoted"}) {
    const auto help = lowlux({"calibrate", kind, "--help"});
    EXPECT_EQ(help.exit_code, 0);
    EXPECT_TRUE(holds(help.out, "PROFILE.json"));
  }
  EXPECT_TRUE(holds(lowlux({"calibrate", "--help"}).out, "quoted"));
}

TEST_F(Calibrate, ShippedProfilesAreWhatTheQuotedFiguresGive) {
  int shipped = 0;
  for (const auto& entry : std::filesystem::directory_iterator(LOWLUX_PROFILES)) {
    const std::string name = entry.path().stem();
    const auto done = lowlux({"calibrate", "quoted", name, "-o", file("p.json"), "--force"});
    ASSERT_EQ(done.exit_code, 0) << name << done.err;
    EXPECT_EQ(scratch_.read("p.json"), test::read_file(entry.path())) << name << ": see scripts/make-profiles";
    ++shipped;
  }
  EXPECT_GT(shipped, 10);
}

TEST_F(Calibrate, NoInputAndNoOutputIsReplacedByAnother) {
  const Words dark = shoot("d", "dark", "1", 2);
  const std::string before = scratch_.read("d_0000.dng");
  const auto usage = [&](const Words& words, const std::string& why) {
    const auto done = lowlux(words);
    EXPECT_EQ(done.exit_code, 2) << why;
    EXPECT_TRUE(holds(done.err, why)) << done.err;
  };
  usage({"calibrate", "black", dark[0], dark[1], "-o", dark[0], "--force"},
        "the name of a profile must end with .json");
  usage({"calibrate", "black", dark[0], dark[0], "-o", file("p.json")}, "given twice");
  usage({"calibrate", "noise", dark[0], "--darks", dark[1] + "," + dark[0], "-o", file("p.json")}, "given twice");
  usage({"calibrate", "black", dark[0], "-o", file("p.json"), "--report", file("p.json")}, ".html");
  usage({"calibrate", "noise", dark[0], "-o", file("p.json"), "--steady-light"}, "applies to flats");
  usage({"calibrate", "noise", dark[0], "--darks", dark[1], "-o", file("p.json"), "--method", "foi"},
        "one ordinary image");
  usage({"develop", dark[0], "-o", file("p.png"), "--black", "a.json", "--profile", "b.json"}, "both name a profile");
  EXPECT_EQ(scratch_.read("d_0000.dng"), before);
}

TEST_F(Calibrate, MapsAreWrittenWithTheProfileOrNotAtAll) {
  const Words high{"--iso", "1600"}, low{"--iso", "100"};
  const Words good = joined(shoot("a", "dark", "0.1", 2, high), shoot("b", "dark", "10", 2, high));
  const Words bad = joined(shoot("c", "dark", "0.1", 2, low), shoot("d", "dark", "10", 1, low));
  const Words words{"calibrate", "black", "-o", file("p.json"), "--system-gain", "0.5", "--map", file("m")};
  const auto refused = lowlux(joined(words, joined(good, bad)));
  EXPECT_EQ(refused.exit_code, 1);
  EXPECT_TRUE(holds(refused.err, "one dark frame")) << refused.err;
  for (const std::string& name : scratch_.names()) EXPECT_FALSE(name.ends_with(".pfm")) << name;
  scratch_.write("m_current.pfm", "mine");
  const auto in_the_way = lowlux(joined(words, good));
  EXPECT_EQ(in_the_way.exit_code, 1);
  EXPECT_EQ(scratch_.read("m_current.pfm"), "mine");
  EXPECT_FALSE(exists("m_pedestal.pfm") || exists("p.json"));
}

TEST_F(Calibrate, ErrorsAreJsonToo) {
  const auto done = lowlux({"calibrate", "black", file("missing.dng"), "-o", file("p.json"), "--json"});
  EXPECT_EQ(done.exit_code, 1);
  EXPECT_EQ(Json::parse(done.out)["ok"], false);
}

TEST_F(Calibrate, NamesThatAreNoUtf8AreWrittenReadable) {
  const Words dark = shoot("d", "dark", "1", 2);
  const std::string odd = file("odd\xff.dng");
  std::filesystem::rename(dark[0], odd);
  const auto done = lowlux({"calibrate", "black", odd, dark[1], "-o", file("p.json")});
  EXPECT_EQ(done.exit_code, 0) << done.err;
  EXPECT_TRUE(holds(profile("p.json")["gains"][0]["provenance"][0]["files"][0].get<std::string>(), "odd"));
}

TEST_F(Calibrate, ColoursAloneAreAProfileToDevelopWith) {
  const std::string canon = std::string(LOWLUX_TESTDATA) + "/raws/canon_kissx4_ml_colorchart.dng";
  ASSERT_EQ(lowlux({"calibrate", "colour", canon, "-o", file("p.json")}).exit_code, 0);
  const auto done = lowlux({"develop", canon, "-o", file("p.png"), "--half", "--profile", file("p.json")});
  EXPECT_EQ(done.exit_code, 0) << done.err;
  EXPECT_EQ(lowlux({"develop", canon, "-o", file("q.png"), "--half", "--black", file("p.json")}).exit_code, 1);
}

TEST_F(Calibrate, AProfileWithoutBlackGivesItsNoise) {
  ASSERT_EQ(lowlux({"calibrate", "quoted", "ELD_NikonD850", "-o", file("p.json")}).exit_code, 0);
  const std::string night = shoot("n", "flat", "0.1", 1)[0];
  const auto refused = lowlux({"develop", night, "-o", file("n.png"), "--black", file("p.json")});
  EXPECT_EQ(refused.exit_code, 1);
  EXPECT_TRUE(holds(refused.err, "no black level") && holds(refused.err, "--profile")) << refused.err;
  const auto used = lowlux({"develop", night, "-o", file("n.png"), "--profile", file("p.json"), "--json"});
  ASSERT_EQ(used.exit_code, 0) << used.err;
  EXPECT_NE(Json::parse(used.out)[0]["black"]["source"], "profile");
}

TEST_F(Calibrate, AProfileWithADarkCurrentAloneAddsItToTheFilesPedestal) {
  ASSERT_EQ(lowlux({"calibrate", "quoted", "HWK4123_low_gain", "-o", file("p.json")}).exit_code, 0);
  const auto shot = lowlux({"simulate", "flat", "-o", file("n.dng"), "--sensor", "HWK4123_low_gain", "--exposure", "30",
                            "--temperature", "25", "--luminance", "0.02", "--white-luminance", "60", "--no-truth"});
  ASSERT_EQ(shot.exit_code, 0) << shot.err;
  const auto developed = [&](const std::vector<std::string>& options) {
    std::vector<std::string> words{"develop", file("n.dng"), "-o", file("n.png"), "--json", "--force"};
    words.insert(words.end(), options.begin(), options.end());
    const auto out = lowlux(words);
    EXPECT_EQ(out.exit_code, 0) << out.err;
    return Json::parse(out.out)[0];
  };
  const Json tagged = developed({});
  EXPECT_GT(tagged["unknown_dark_fraction"], 0.1);
  const double pedestal_dn = tagged["black"]["pedestal_dn"][0];
  for (const char* option : {"--profile", "--black"}) {
    const Json known = developed({option, file("p.json")});
    // 0.1 e-/s at 0 C, doubling every 8.56 degrees.
    const double dark_e = 0.1 * std::exp2(25 / 8.56) * 30;
    const double range_dn = 4095 - pedestal_dn;
    EXPECT_GT(known["black"]["pedestal_dn"][0], pedestal_dn) << option;
    EXPECT_LT(known["black"]["pedestal_dn"][0], pedestal_dn + dark_e / 100 * range_dn) << option;
    EXPECT_TRUE(known["unknown_dark_fraction"].is_null()) << option;
    EXPECT_EQ(known["warnings"].dump().find("the noise variance that its model states"), std::string::npos)
        << known["warnings"].dump();
  }
}

TEST_F(Calibrate, RaspberryPiSensorsAreQuotedByNameAndFromTuningFiles) {
  ASSERT_EQ(lowlux({"calibrate", "quoted", "imx477", "-o", file("p.json")}).exit_code, 0);
  const double shipped = profile("p.json")["gains"][0]["sensor"]["system_gain_dn_per_e"]["value"];
  EXPECT_NEAR(shipped, 2.767 * 2.767 / 16, 1e-12);
  const std::string tuning = R"({"version": 2.0, "target": "bcm2835", "algorithms": [
      {"rpi.black_level": {"black_level": 4096}},
      {"rpi.noise": {"reference_constant": 0, "reference_slope": 5.534}}]})";
  for (const char* name : {"imx477_own.json", "nosuch.json", "imx219.json"}) {
    scratch_.write(name, std::string(name) == "imx219.json" ? "{}" : tuning);
  }
  ASSERT_EQ(lowlux({"calibrate", "quoted", file("imx477_own.json"), "-o", file("p.json"), "--force"}).exit_code, 0);
  const double own = profile("p.json")["gains"][0]["sensor"]["system_gain_dn_per_e"]["value"];
  EXPECT_NEAR(own, 4 * shipped, 1e-12);
  for (const char* name : {"nosuch.json", "imx219.json", "absent_imx477.json"}) {
    const auto wrong = lowlux({"calibrate", "quoted", file(name), "-o", file("no.json")});
    EXPECT_NE(wrong.exit_code, 0) << name;
    EXPECT_TRUE(holds(wrong.err, name)) << wrong.err;
    EXPECT_EQ(std::count(wrong.err.begin(), wrong.err.end(), '\n'), 1) << wrong.err;
    EXPECT_FALSE(exists("no.json")) << name;
  }
}

TEST_F(Calibrate, NothingIsOverwrittenWithoutForce) {
  ASSERT_EQ(lowlux({"calibrate", "quoted", "thesis", "-o", file("p.json")}).exit_code, 0);
  const std::string before = scratch_.read("p.json");
  const auto again = lowlux({"calibrate", "quoted", "ELD_NikonD850", "-o", file("p.json")});
  EXPECT_EQ(again.exit_code, 1);
  EXPECT_TRUE(holds(again.err, "--force"));
  EXPECT_EQ(scratch_.read("p.json"), before);
  EXPECT_EQ(lowlux({"calibrate", "quoted", "ELD_NikonD850", "-o", file("p.json"), "--force"}).exit_code, 0);
  EXPECT_NE(scratch_.read("p.json"), before);
}

}  // namespace
}  // namespace lowlux
