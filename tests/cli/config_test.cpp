#include <gtest/gtest.h>

#include <filesystem>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "isp/cli/config/config_file.h"
#include "tests/cli/command.h"
#include "tests/support/scratch_directory.h"

namespace lowlux {
namespace {

using test::dog;
using test::holds;
using Json = nlohmann::json;
using Words = std::vector<std::string>;

class Config : public testing::Test {
 protected:
  void write(const std::string& text) {
    std::filesystem::create_directories(scratch_.path() + "/lowlux");
    scratch_.write("lowlux/config", text);
  }
  std::string file(const std::string& name) const { return scratch_.file(name); }

  /// Runs develop of a small file at half size with the configuration, to x.png.
  test::ProcessResult develop(const Words& more = {}) const {
    Words words{"develop", dog, "-o", file("x.png"), "--half", "--force", "--denoise", "off"};
    words.insert(words.end(), more.begin(), more.end());
    return run(words);
  }
  test::ProcessResult run(Words words) const {
    words.insert(words.begin(), {"env", "XDG_CONFIG_HOME=" + scratch_.path(), test::tested_command()});
    return test::run_process(words);
  }

  /// Expects one line that names the file and a line of it.
  void refused(const std::string& text, int line, const std::string& why) {
    write(text);
    const auto result = develop();
    EXPECT_EQ(result.exit_code, 2) << text;
    EXPECT_EQ(std::count(result.err.begin(), result.err.end(), '\n'), 1) << result.err;
    EXPECT_TRUE(holds(result.err, file("lowlux/config") + ":" + std::to_string(line) + ": ")) << result.err;
    EXPECT_TRUE(holds(result.err, why)) << result.err;
    EXPECT_FALSE(scratch_.holds("x.png"));
  }

  test::ScratchDirectory scratch_;
};

TEST_F(Config, DefaultsAreUsedAndStated) {
  write("# mine\n\n[ develop ]\nexposure = +1 EV\r\n  space=p3\nhalf = no\n[denoise]\ndenoise = best\n");
  const auto text = develop({"--explain"});
  EXPECT_EQ(text.exit_code, 0) << text.err;
  EXPECT_TRUE(text.out.starts_with("defaults: --exposure=+1 EV --space=p3 (" + file("lowlux/config") + ")\n"))
      << text.out;
  const Json json = Json::parse(develop({"--json"}).out)[0];
  EXPECT_EQ(json["exposure"]["ev"], 1);
  EXPECT_EQ(json["defaults"], "--exposure=+1 EV --space=p3 (" + file("lowlux/config") + ")");
}

TEST_F(Config, GivenOptionsComeBeforeDefaults) {
  write("[develop]\nexposure = 2\nquiet = yes\n");
  for (const Words& more : {Words{"--exposure", "-1"}, Words{"--exposure=-1"}}) {
    Words with = more;
    with.emplace_back("--json");
    const Json json = Json::parse(develop(with).out)[0];
    EXPECT_EQ(json["exposure"]["ev"], -1);
    EXPECT_TRUE(holds(json["defaults"].get<std::string>(), "--quiet (")) << json["defaults"];
  }
  const Json without = Json::parse(develop({"--no-config", "--exposure", "0", "--json"}).out)[0];
  EXPECT_TRUE(without["defaults"].is_null());
}

TEST_F(Config, DefaultsThatContradictTheArgumentsAreLeftOut) {
  // --half excludes --demosaic; --dark-noise needs --dark-frame; --format is for folders.
  write("[develop]\ndemosaic = malvar\ndark-noise = 0.2\nformat = jpg\n");
  const auto one = develop({"--explain"});
  EXPECT_EQ(one.exit_code, 0) << one.err;
  EXPECT_TRUE(holds(one.out, "defaults: --format=jpg (")) << one.out;
  EXPECT_EQ(run({"develop", dog, "-o", file("out/"), "--half"}).exit_code, 0);
  EXPECT_TRUE(std::filesystem::exists(file("out/n900_dog_small_grbg10in16.jpg")));
}

// Not known to the parser: checks of budgets and profiles, and isp::check_options, find contradictions of values.
TEST_F(Config, DefaultsThatAValueOfTheArgumentsExcludesAreLeftOut) {
  struct Case {
    const char* lines;
    Words more;
    const char* left;  // defaults that are used
  };
  const std::string profile = file("camera.json");
  EXPECT_EQ(run({"calibrate", "quoted", "imx219", "-o", profile}).exit_code, 0);
  for (const Case& c : {Case{"local-tone = 0.5\nquality = 95\n", {"--tone", "none"}, "--quality=95 ("},
                        Case{"brightness = 0.5\nquality = 95\n", {"--space", "linear-srgb"}, "--quality=95 ("},
                        Case{"contrast = 1.2\nquality = 95\n", {"--noise-limit", "2"}, "--quality=95 ("},
                        Case{"quality = 95\ncontrast = 1.2\nlocal-tone = 0.2\nsaturation = 1.1\n",
                             {"--look", "eye", "--scene-luminance", "1"},
                             "--quality=95 ("},
                        Case{"look = eye\nquality = 95\n", {"--brightness", "0.5"}, "--quality=95 ("},
                        Case{"space = linear-srgb\nquality = 95\n", {"--brightness", "0.5"}, "--quality=95 ("},
                        Case{"budget-ms = 500\nquality = 95\n", {"--budget-mpps", "1"}, "--quality=95 ("},
                        Case{"jobs = 2\nquality = 95\n", {"--budget-ms", "5000"}, "--quality=95 ("},
                        Case{"effects = all\nquality = 95\n", {"--tolerance", "1"}, "--quality=95 ("},
                        Case{"profile = no.json\nquality = 95\n",
                             {"--black", profile, "--gain-setting", "analogue gain 1"},
                             "--quality=95 ("},
                        Case{"brightness = 0.5\ncontrast = 1.2\n", {"--tone", "standard"}, "--brightness=0.5 --con"}}) {
    write(std::string("[develop]\n") + c.lines);
    Words words = c.more;
    words.emplace_back("--explain");
    const auto result = develop(words);
    EXPECT_EQ(result.exit_code, 0) << c.lines << result.err;
    EXPECT_TRUE(result.out.starts_with(std::string("defaults: ") + c.left)) << c.lines << result.out;
  }
}

TEST_F(Config, ContradictionsNameTheLineOfADefaultOnlyWhereTheFileIsAtFault) {
  refused("[develop]\nquality = 95\nspace = linear-srgb\nbrightness = 0.5\n", 4,
          "cannot be combined with --tone none, linear spaces");
  refused("[develop]\ntone = none\nlocal-tone = 0.5\n", 2, "--local-tone requires the standard tone curve");
  write("[develop]\ncontrast = 1.2\n");
  const auto result = develop({"--brightness", "0.5", "--tone", "none"});
  EXPECT_EQ(result.exit_code, 2);
  EXPECT_TRUE(result.err.starts_with("lowlux develop: --brightness and --contrast change")) << result.err;
}

TEST_F(Config, WrongLinesAreNamed) {
  refused("[develop]\nexposre = 1\n", 2, "develop has no option 'exposre' (did you mean exposure");
  refused("[devlop]\n", 1, "unknown verb 'devlop'");
  refused("\nexposure = 1\n", 2, "[develop]");
  refused("[develop]\nexposure\n", 2, "option = value");
  refused("[develop]\n= 1\n", 2, "option = value");
  refused("[develop]\nquiet = perhaps\n", 2, "yes or no");
  refused("[develop]\nquiet = no\n#\nexposure = bright\n", 4, "--exposure: 'bright' is neither");
  refused("[develop]\nquality = 95\nquality = 96\n", 3, "quality is set twice");
  refused("[develop]\nquality = 101\n", 2, "--quality");
  refused("[develop]\nhelp = yes\n", 2, "no option 'help'");
  refused("[develop]\ndark-frame =\n", 2, "dark-frame has no value");
  refused("[develop]\ninclude other\n", 2, "option = value");
}

TEST_F(Config, DefaultsThatNeedEachOtherAreKeptTogether) {
  std::filesystem::copy_file(dog, file("dark.dng"));
  const std::string dark = "dark-frame = " + file("dark.dng") + "\n";
  for (const std::string& text : {dark + "dark-noise = 0.2\n", "dark-noise = 0.2\n" + dark}) {
    write("[develop]\n" + text);
    const auto result = develop({"--explain"});
    EXPECT_TRUE(holds(result.out, "--dark-noise=0.2")) << result.out << result.err;
    EXPECT_TRUE(holds(result.out, "--dark-frame=")) << result.out;
  }
}

TEST_F(Config, AFileThatBeginsWithAByteOrderMarkIsRead) {
  write("\xEF\xBB\xBF[develop]\nexposure = 2\n");
  EXPECT_EQ(Json::parse(develop({"--json"}).out)[0]["exposure"]["ev"], 2);
}

// Found after the arguments are parsed, in the verb's own checks and in those of its work.
TEST_F(Config, LaterErrorsNameTheLineOfTheDefault) {
  write("[develop]\nquality = 90\ndenoise = off\n");
  auto result = run({"develop", dog, "-o", file("x.png"), "--maps"});
  EXPECT_EQ(result.exit_code, 2);
  EXPECT_TRUE(holds(result.err, file("lowlux/config") + ":3: --maps")) << result.err;
  EXPECT_EQ(std::count(result.err.begin(), result.err.end(), '\n'), 1) << result.err;
  write("[develop]\n# an image of 8 bits\nbits = 8\n");
  result = run({"develop", dog, "-o", file("x.exr")});
  EXPECT_EQ(result.exit_code, 2);
  EXPECT_TRUE(holds(result.err, file("lowlux/config") + ":3: --bits")) << result.err;
  result = run({"develop", dog, "-o", file("x.exr"), "--bits", "8"});
  EXPECT_FALSE(holds(result.err, "config")) << "the argument is at fault, and no default: " << result.err;
  EXPECT_FALSE(scratch_.holds("x.exr"));
}

TEST_F(Config, ADepthThatAFormatDoesNotHoldNamesItsLine) {
  write("[develop]\nbits = 16\n[retarget]\nbits = 16\n[resaturate]\nbits = 16\n");
  const std::string image = std::string(LOWLUX_TESTDATA) + "/pictures/kodim15.png";
  const Words develop{"develop", dog, "-o", file("x.jpg")}, retarget{"retarget", image, "-o", file("x.jpg")},
      resaturate{"resaturate", image, "-o", file("x.jpg"), "--black", "0,0,0"};
  int line = 2;
  for (const Words& words : {develop, retarget, resaturate}) {
    const auto result = run(words);
    EXPECT_EQ(result.exit_code, 2);
    EXPECT_TRUE(
        holds(result.err, file("lowlux/config") + ":" + std::to_string(line) + ": --bits: JPEG files hold 8 bits"))
        << result.err;
    line += 2;
  }
  const auto space = run({"develop", dog, "-o", file("x.exr"), "--bits", "32", "--space", "srgb"});
  EXPECT_TRUE(holds(space.err, "lowlux develop: --space: float images are scene-linear")) << space.err;
}

TEST_F(Config, DoctorNamesUnknownOptionsOfEveryVerb) {
  write("[develop]\nexposre = 1\nquality = 90\n[calibrate black]\nisso = 100\n[info]\njson = yes\n");
  const auto result = run({"doctor"});
  EXPECT_EQ(result.exit_code, 1);
  const std::string at = file("lowlux/config");
  EXPECT_TRUE(holds(result.out, at + ":2: develop has no option 'exposre' (did you mean exposure?)")) << result.out;
  EXPECT_TRUE(holds(result.out, at + ":5: calibrate black has no option 'isso' (did you mean iso?)")) << result.out;
  EXPECT_FALSE(holds(result.out, "quality")) << result.out;
  write("[develop]\nquality = 90\n[info]\njson = yes\n");
  EXPECT_TRUE(holds(run({"doctor"}).out, "2 in " + at));
}

TEST_F(Config, AnOptionWithoutItsValueTakesNoWordAfterIt) {
  const auto result = run({"develop", "--dark-frame=", dog, "-o", file("taken.png")});
  EXPECT_EQ(result.exit_code, 2);
  EXPECT_TRUE(holds(result.err, "--dark-frame has no value")) << result.err;
}

TEST_F(Config, AFileOfMoreThanItMayHoldIsRefused) {
  write(std::string(1 << 17, '#'));
  const auto result = develop();
  EXPECT_EQ(result.exit_code, 2);
  EXPECT_TRUE(holds(result.err, file("lowlux/config"))) << result.err;
}

TEST_F(Config, ALinkToItselfIsNoAbsentFile) {
  write("");
  std::filesystem::remove(file("lowlux/config"));
  EXPECT_EQ(develop().exit_code, 0);
  std::filesystem::create_symlink("config", file("lowlux/config"));
  const auto result = develop();
  EXPECT_EQ(result.exit_code, 2) << result.err;
  EXPECT_TRUE(holds(result.err, file("lowlux/config"))) << result.err;
  EXPECT_EQ(std::count(result.err.begin(), result.err.end(), '\n'), 1) << result.err;
}

TEST_F(Config, HelpAndDoctorWorkWithABrokenFile) {
  write("[develop]\nexposre = 1\n[fry]\n");
  const auto doctor = run({"doctor"});
  EXPECT_TRUE(holds(doctor.out + doctor.err, "config:3: unknown verb 'fry'")) << doctor.out << doctor.err;
  EXPECT_EQ(develop({"--no-config"}).exit_code, 0);
  EXPECT_EQ(run({"develop", "--help"}).exit_code, 0);
}

TEST(ConfigText, LinesKeepTheirNumbersAndVerbs) {
  const auto lines = cli::parse_config("[calibrate black]\n\nquiet = yes\n[info]\njson=yes", "f");
  ASSERT_TRUE(lines);
  ASSERT_EQ(lines->size(), 2U);
  EXPECT_EQ((*lines)[0].verb, "calibrate black");
  EXPECT_EQ((*lines)[0].number, 3);
  EXPECT_EQ((*lines)[1].option, "json");
  EXPECT_EQ((*lines)[1].value, "yes");
}

}  // namespace
}  // namespace lowlux
