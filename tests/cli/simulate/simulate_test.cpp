#include <gtest/gtest.h>

#include <chrono>
#include <csignal>
#include <cstdio>
#include <regex>
#include <set>
#include <sstream>
#include <thread>

#include <nlohmann/json.hpp>

#include "capture/file/dng_source.h"
#include "tests/cli/command.h"
#include "tests/cli/simulate/simulate_command.h"

namespace lowlux {
namespace {

using test::holds;
using test::lowlux;

using Json = nlohmann::json;
using Words = std::vector<std::string>;

class Simulate : public test::SimulateCommand {
 protected:
  RawDn raw(const std::string& name) {
    auto frame = capture::read_raw(file(name));
    if (!frame) throw std::runtime_error(frame.error().message);
    return std::move(frame->raw);
  }
  std::vector<std::uint16_t> codes(const std::string& name) {
    const RawDn frame = raw(name);
    return {frame.dn.data(), frame.dn.data() + frame.dn.size()};
  }
};

std::string three_digits(double value) {
  char text[32];
  std::snprintf(text, sizeof text, "%.3g", value);
  return text;
}

TEST_F(Simulate, EveryOptionOfTheHelpWorks) {
  scratch_.write("lamp.csv", "nm,lamp\n380,0.2\n780,1\n");
  const std::string lamp = file("lamp.csv");
  const std::vector<Words> commands{
      {"--light", "A", "--luminance", "0.1", "--stars", "5", "--star-luminance", "0.01"},
      {"--lamp", "3,4," + lamp + ",10", "--light", lamp, "--truth", file("t.pfm")},
      {"--truth", file("u.tif"), "--truth-electrons", file("u.pfm"), "--quiet"},
      {"--no-truth", "--truth-electrons", file("e.tif"), "--json", "--timings"},
      {"--sensor", "ELD_SonyA7S2", "--gain", "ISO 1600", "--camera", "Nikon_D5100", "--exposure", "0.5", "--f-number",
       "4", "--temperature", "30", "--cfa", "gbrg", "--masked-columns", "8"},
      {"--effects", "all,-prnu", "--sampling", "published", "--seed", "7", "--sensor-seed", "3", "--frames", "2",
       "--explain"},
      {"--tolerance", "0.2,0.01"},
      {"--system-gain",
       "0.5",
       "--read-noise",
       "3",
       "--full-well",
       "9000",
       "--bits",
       "12",
       "--black-level",
       "64",
       "--white-level",
       "4000",
       "--dark-current",
       "2,1,1",
       "--dark-temperature",
       "25",
       "--dark-doubling",
       "6",
       "--prnu",
       "0.01",
       "--dsnu",
       "0.1",
       "--hot-pixels",
       "0.001",
       "--hot-current",
       "100",
       "--row-noise",
       "0.5",
       "--column-noise",
       "0.5",
       "--pixel-pitch",
       "5",
       "--peak-qe",
       "0.6",
       "--iso",
       "200",
       "--quantise",
       "floor"},
      {"--white-luminance", "20", "--size", "64x48", "--force"},
      {"--dark-current",     "2",     "--dark-activation", "0.6", "--dark-floor", "0.5",
       "--telegraph-pixels", "0.01",  "--telegraph-noise", "5",   "--glow",       "20",
       "--glow-position",    "0,0.5", "--glow-length",     "0.2", "--crosstalk",  "0.02",
       "--lens-blur",        "0.8"},
      {"--frames", "2", "--shake", "3", "--roll", "1", "--dither", "0.5", "--bracket", "0,-1", "--reduce", "3"},
      {"--frames", "2", "--stars", "9", "--field-rotation", "1", "--field-centre", "10,-5.5", "--drift", "0.5,-1",
       "--horizon", "30", "--movers", "1", "--mover-size", "9.5", "--mover-speed", "2"},
  };
  std::set<std::string> used{"--help", "--help-all", "--no-config", "--output", "--list"};
  for (std::size_t i = 0; i < commands.size(); ++i) {
    simulated("chart", "out" + std::to_string(i) + ".dng", commands[i]);
    for (const std::string& word : commands[i]) {
      if (word.starts_with("--")) used.insert(word);
    }
  }
  EXPECT_EQ(lowlux({"simulate", "chart", "--output", file("long.dng"), "--size", "64x48"}).exit_code, 0);
  std::istringstream help(lowlux({"simulate", "--help-all"}).out);
  const std::regex option("^  (?:-., )?(--[a-z-]+).*");
  std::set<std::string> offered;
  std::smatch found;
  for (std::string line; std::getline(help, line);) {
    if (std::regex_match(line, found, option)) offered.insert(found[1]);
  }
  EXPECT_EQ(offered, used);
}

TEST_F(Simulate, TheListNamesWhatTheOptionsTake) {
  const auto list = lowlux({"simulate", "--list"});
  EXPECT_EQ(list.exit_code, 0);
  for (const char* name : {"thesis", "ELD_NikonD850", "ISO 6400", "HPS_generic", "LED-B3", "Nikon_D5100"}) {
    EXPECT_TRUE(holds(list.out, name)) << name;
  }
}

TEST_F(Simulate, JsonHoldsWhatExplainPrints) {
  const Words options{"--light", "A", "--explain", "--luminance", "0.001", "--prnu", "0.005", "--glow", "9"};
  const auto text = simulated("chart", "text.dng", options);
  Words with_json = options;
  with_json.emplace_back("--json");
  const Json json = Json::parse(simulated("chart", "json.dng", with_json).out);
  ASSERT_GE(json["regions"].size(), 2U);  // the chart's black frame is a region of its own
  std::size_t at = 0;
  const auto expect_next = [&](const std::string& words) {
    const std::size_t found = text.out.find(words, at);
    ASSERT_NE(found, std::string::npos) << words << " in " << text.out.substr(at);
    at = found;
  };
  for (const Json& region : json["regions"]) {
    expect_next(std::to_string(region["blocks"].get<int>()) + " blocks of " + three_digits(region["darkest_e"]) +
                " to " + three_digits(region["brightest_e"]) + " e-, glow up to " + three_digits(region["glow_e"]) +
                " e-");
    for (const Json& effect : region["effects"]) {
      expect_next(effect["effect"]);
      expect_next(three_digits(effect["predicted_delta_e"]));
      expect_next(three_digits(effect["predicted_relative_variance"]));
      expect_next(effect["kept"] ? "simulate" : "leave out");
      expect_next(effect["reason"]);
    }
    expect_next(three_digits(region["left_out_delta_e"]));
    expect_next(three_digits(region["left_out_relative_variance"]));
  }
  EXPECT_FALSE(json["cost"]["saved_ms"].empty());
  for (const auto& [effect, saved_ms] : json["cost"]["saved_ms"].items()) {
    EXPECT_TRUE(holds(text.out, "  without " + effect)) << effect;
  }
}

TEST_F(Simulate, JsonTellsTheRunAndInfoTheSameOfItsFile) {
  const Json json =
      Json::parse(simulated("flat", "a.dng",
                            {"--json", "--seed", "9", "--exposure", "0.25", "--f-number", "2.8", "--temperature", "35",
                             "--cfa", "grbg", "--masked-columns", "16", "--luminance", "3", "--black-level", "500"})
                      .out);
  EXPECT_EQ(json["files"], Json({file("a.dng"), file("a.truth.exr")}));
  EXPECT_EQ(json["seed"], 9);
  EXPECT_EQ(json["white_luminance_cd_m2"], 3);
  EXPECT_EQ(json["sensor"]["black_level_dn"], 500);
  EXPECT_FALSE(json["sensor"]["assumptions"].empty());
  const Json info = Json::parse(lowlux({"info", file("a.dng"), "--json"}).out)[0];
  EXPECT_EQ(info["cfa"], "GRBG");
  EXPECT_EQ(info["active"], Json({{"x", 16}, {"y", 0}, {"width", 64}, {"height", 48}}));
  EXPECT_EQ(info["masked"].size(), 1U);
  for (const char* figure : {"exposure_s", "f_number", "temperature_c"}) {
    EXPECT_NEAR(info["exposure"][figure], json[figure], 1e-6) << figure;  // relative 1e-7: rationals of the file
  }
  // The luminance at which the frame saturates, from the speed in the file: rationals again, and an ISO without
  // fraction.
  const double saturation = json["saturation_luminance_cd_m2"];
  EXPECT_NEAR(info["exposure"]["saturation_luminance_cd_m2"], saturation, 0.01 * saturation);
}

TEST_F(Simulate, TheSeedAloneMakesTheBytes) {
  const Words noisy{"--effects", "all", "--prnu", "0.02", "--luminance", "0.5"};
  const auto seeded = [&noisy](const char* seed) {
    Words words = noisy;
    words.insert(words.end(), {"--seed", seed});
    return words;
  };
  simulated("chart", "a.dng", seeded("5"));
  simulated("chart", "b.dng", seeded("5"));
  simulated("chart", "c.dng", seeded("6"));
  simulated("chart", "default.dng", noisy);
  simulated("chart", "one.dng", seeded("1"));
  EXPECT_EQ(test::read_file(file("a.dng")), test::read_file(file("b.dng")));
  EXPECT_EQ(test::read_file(file("default.dng")), test::read_file(file("one.dng")));
  EXPECT_NE(codes("a.dng"), codes("c.dng"));
  EXPECT_EQ(test::read_file(file("a.truth.exr")), test::read_file(file("c.truth.exr")));
}

TEST_F(Simulate, FramesAreNumberedAndShareTheFixedPatternOnly) {
  const Words pattern{"--frames",       "3", "--effects", "prnu,column-noise", "--prnu", "0.1",
                      "--column-noise", "5", "--no-truth"};
  simulated("flat", "pattern.dng", pattern);
  EXPECT_EQ(scratch_.names(), (Words{"pattern_0000.dng", "pattern_0001.dng", "pattern_0002.dng"}));
  EXPECT_EQ(codes("pattern_0000.dng"), codes("pattern_0001.dng"));
  EXPECT_EQ(codes("pattern_0000.dng"), codes("pattern_0002.dng"));
  simulated("flat", "other.dng", {"--effects", "prnu,column-noise", "--prnu", "0.1", "--seed", "2"});
  EXPECT_NE(codes("other.dng"), codes("pattern_0000.dng"));
  simulated("flat", "noise.dng", {"--frames", "2", "--effects", "all"});
  EXPECT_NE(codes("noise_0000.dng"), codes("noise_0001.dng"));
  simulated("flat", "single.dng", {"--effects", "all"});
  EXPECT_EQ(codes("single.dng"), codes("noise_0000.dng"));
}

TEST_F(Simulate, WithoutEffectsAFlatHasOneCodeForEachChannel) {
  simulated("flat", "a.dng", {"--effects", "none"});
  const RawDn frame = raw("a.dng");
  for (int y = 0; y < frame.dn.height(); ++y) {
    for (int x = 0; x < frame.dn.width(); ++x) ASSERT_EQ(frame.dn.at(x, y), frame.dn.at(x % 2, y % 2)) << x << ' ' << y;
  }
  EXPECT_EQ(frame.dn.at(0, 1), frame.dn.at(1, 0));
  EXPECT_NE(frame.dn.at(0, 0), frame.dn.at(1, 0));
}

TEST_F(Simulate, EveryFileIsReadAndDeveloped) {
  int count = 0;
  for (const char* size : {"22x22", "23x22", "22x25", "101x67"}) {
    for (const char* cfa : {"rggb", "grbg", "gbrg", "bggr"}) {
      const std::string name = std::string(cfa) + size, masked = ++count % 2 == 0 ? "32" : "0";
      simulated("chart", name + ".dng", {"--size", size, "--cfa", cfa, "--masked-columns", masked});
      const auto info = lowlux({"info", file(name + ".dng")});
      EXPECT_EQ(info.exit_code, 0) << name << info.err;
      const auto developed = lowlux({"develop", file(name + ".dng"), "-o", file(name + ".png"), "--json"});
      ASSERT_EQ(developed.exit_code, 0) << name << developed.err;
      const Json report = Json::parse(developed.out)[0];
      EXPECT_EQ(std::to_string(report["width"].get<int>()) + "x" + std::to_string(report["height"].get<int>()), size);
    }
  }
}

// The limit is that of `develop`: 22 x 22 is developed above.
TEST_F(Simulate, FramesTooSmallForRawDevelopersAreRefused) {
  for (const char* size : {"21x22", "22x21", "1x1"}) {
    const auto result = simulate("flat", "small.dng", {"--size", size, "--masked-columns", "30"});
    EXPECT_EQ(result.exit_code, 2);
    EXPECT_TRUE(holds(result.err, "22 to 64000 pixels")) << result.err;
  }
  simulated("flat", "f.dng", {"--size", "22x22", "--truth", file("small.exr")});
  ASSERT_EQ(lowlux({"develop", file("f.dng"), "-o", file("half.exr"), "--half"}).exit_code, 0);
  const auto picture = simulate(file("half.exr"), "small.dng");
  EXPECT_EQ(picture.exit_code, 1);
  EXPECT_TRUE(holds(picture.err, "11 x 11 pixels")) << picture.err;
  EXPECT_FALSE(scratch_.holds("small.dng"));
}

TEST_F(Simulate, NothingIsOverwrittenWithoutForce) {
  const Words options{"--frames", "3", "--truth", file("t.exr"), "--truth-electrons", file("e.exr")};
  for (const char* name : {"a_0000.dng", "a_0002.dng", "t.exr", "e.exr"}) {
    scratch_.write(name, "precious");
    const auto refused = simulate("flat", "a.dng", options);
    EXPECT_EQ(refused.exit_code, 1) << name;
    EXPECT_TRUE(holds(refused.err, name) && holds(refused.err, "--force")) << refused.err;
    EXPECT_EQ(scratch_.names(), Words{name});
    EXPECT_EQ(scratch_.read(name), "precious");
    std::filesystem::remove(file(name));
  }
  scratch_.write("a_0001.dng", "precious");
  Words forced = options;
  forced.emplace_back("--force");
  simulated("flat", "a.dng", forced);
  EXPECT_NE(scratch_.read("a_0001.dng"), "precious");
  EXPECT_EQ(scratch_.names().size(), 5U);
}

TEST_F(Simulate, TimingsNameTheStagesAndQuietSaysNothing) {
  const char* const stages[] = {"scene", "exposure and plan", "readout", "raw files", "truth"};
  const auto timed = simulated("flat", "a.dng", {"--timings"});
  const Json times = Json::parse(simulated("flat", "b.dng", {"--json"}).out)["times_s"];
  for (const char* stage : stages) {
    EXPECT_TRUE(holds(timed.out, std::string("  ") + stage)) << stage;
    EXPECT_TRUE(times.contains(stage)) << stage;
  }
  EXPECT_TRUE(holds(timed.out, "  sum"));
  EXPECT_FALSE(holds(simulated("flat", "c.dng").out, "  sum"));
  EXPECT_EQ(simulated("flat", "d.dng", {"--quiet"}).out, "");
}

// A run that is ended after 4 s, long past the second for which no progress is shown, on a busy computer too.
// None of the three simulations ends by itself. Two of them run half as long again as the other takes to show progress.
TEST_F(Simulate, ProgressIsShownOnTerminalsOnly) {
  using Clock = std::chrono::steady_clock;
  const auto command = [this](const std::string& name) {
    return Words{test::tested_command(),
                 "simulate",
                 "flat",
                 "--size",
                 "64x48",
                 "--no-truth",
                 "--sampling",
                 "published",
                 "--effects",
                 "all",
                 "--frames",
                 "10000",
                 "-o",
                 file(name)};
  };
  const auto on_terminal = [&](const std::string& name, const std::string& more) {
    std::string line = "echo $$ > " + file(name + ".pid") + "; exec";
    for (const std::string& word : command(name)) line += " " + word;
    return Words{"script", "-qefc", line + more, file(name + ".log")};
  };
  test::RunningProcess terminal(on_terminal("a.dng", "")), quiet(on_terminal("b.dng", " --quiet"));
  test::RunningProcess to_file(command("c.dng"));
  const auto start = Clock::now();
  const auto shows_progress = [&] {
    const std::string log = scratch_.read("a.dng.log");
    return holds(log, "\r") && holds(log, " % ");
  };
  while (!shows_progress() && Clock::now() - start < std::chrono::seconds(30)) {
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
  }
  EXPECT_TRUE(shows_progress()) << scratch_.read("a.dng.log");
  std::this_thread::sleep_for((Clock::now() - start) / 2);
  for (const char* name : {"a.dng.pid", "b.dng.pid"}) kill(std::stoi(scratch_.read(name)), SIGTERM);
  to_file.send(SIGTERM);
  constexpr int terminated = 128 + SIGTERM;  // else it was done before it had progress to show
  EXPECT_EQ(terminal.wait().exit_code, terminated);
  const auto quiet_result = quiet.wait(), file_result = to_file.wait();
  EXPECT_EQ(quiet_result.out, "");
  EXPECT_EQ(quiet_result.exit_code, terminated);
  EXPECT_EQ(file_result.out + file_result.err, "");
  EXPECT_EQ(file_result.exit_code, terminated);
}

}  // namespace
}  // namespace lowlux
