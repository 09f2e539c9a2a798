#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "tests/cli/command.h"
#include "tests/cli/simulate/simulate_command.h"

namespace lowlux {
namespace {

using test::dog;
using test::holds;
using test::lowlux;
using test::raws;

using Json = nlohmann::json;
using Words = std::vector<std::string>;

class Usage : public test::SimulateCommand {
 protected:
  static void refused(const Words& args, const std::string& why) {
    const auto result = lowlux(args);
    EXPECT_EQ(result.exit_code, 2) << testing::PrintToString(args) << result.err;
    EXPECT_TRUE(holds(result.err, why)) << why << "\n" << result.err;
    EXPECT_EQ(std::count(result.err.begin(), result.err.end(), '\n'), 1) << result.err;
    EXPECT_EQ(result.out, "");
  }
};

TEST_F(Usage, ACommandWithoutArgumentsPrintsHelpAsAnError) {
  const auto bare = lowlux({}), help = lowlux({"--help"});
  EXPECT_EQ(bare.exit_code, 2);
  EXPECT_EQ(bare.err, help.out);
  EXPECT_EQ(bare.out, "");
  EXPECT_EQ(lowlux({"help"}).out, help.out);
}

TEST_F(Usage, HelpOfAVerbIsFoundBothWays) {
  for (const Words& verb : {Words{"develop"}, Words{"calibrate"}, Words{"calibrate", "black"}}) {
    Words before{"help"}, after = verb;
    before.insert(before.end(), verb.begin(), verb.end());
    after.emplace_back("--help");
    const auto help = lowlux(before);
    EXPECT_EQ(help.exit_code, 0);
    EXPECT_EQ(help.out, lowlux(after).out);
  }
  EXPECT_EQ(lowlux({"-v"}).out, lowlux({"--version"}).out);
  EXPECT_EQ(lowlux({"-v"}).exit_code, 0);
}

TEST_F(Usage, MisspelledNamesGetASuggestion) {
  refused({"devlop", dog}, "unknown verb 'devlop' (did you mean develop?); `lowlux");
  refused({"help", "devlop"}, "did you mean develop?");
  refused({"fry"}, "unknown verb 'fry'; `lowlux --help` lists them");
  refused({"calibrate", "color"}, "did you mean colour?");
  refused({"develop", dog, "-o", file("x.png"), "--exposre", "1"},
          "unknown option --exposre (did you mean --exposure?);");
  refused({"develop", dog, "-o", file("x.png"), "--exposre=1"}, "unknown option --exposre (did you mean --exposure?);");
  refused({"develop", "--halff"}, "unknown option --halff (did you mean --half?)");  // before what is missing
  refused({"simulate", "flat", "-o", file("x.dng"), "--lumniance", "1"}, "did you mean --luminance?");
  refused({"info", dog, "--xml"}, "unknown option --xml; --help lists the options");
}

TEST_F(Usage, FilesThatBeginWithADashAreReadAfterTwoDashes) {
  std::filesystem::copy_file(dog, file("-dash.dng"));
  const std::string in_folder = "cd " + scratch_.path() + " && " + test::tested_command() + " ";
  const auto hint = test::run_process({"sh", "-c", in_folder + "info -dash.dng"});
  EXPECT_EQ(hint.exit_code, 2);
  EXPECT_TRUE(holds(hint.err, "write ./-dash.dng")) << hint.err;
  for (const char* words : {"info -- -dash.dng", "info ./-dash.dng", "info --json -- -dash.dng"}) {
    const auto read = test::run_process({"sh", "-c", in_folder + words});
    EXPECT_EQ(read.exit_code, 0) << words << read.err;
    EXPECT_TRUE(holds(read.out, "-dash.dng"));
  }
}

TEST_F(Usage, InfoIsWrittenAsPhotographersWrite) {
  const auto kiss = lowlux({"info", raws + "canon_kissx4_ml_colorchart.dng"});
  EXPECT_TRUE(holds(kiss.out, "camera         Canon EOS Kiss X4")) << kiss.out;
  simulated("flat", "f.dng", {"--exposure", "1/60 s", "--f-number", "f/5.6", "--no-truth"});
  const auto text = lowlux({"info", file("f.dng")});
  EXPECT_TRUE(holds(text.out, "1/60 s, f/5.6, ISO")) << text.out;
  const Json exposure = Json::parse(lowlux({"info", file("f.dng"), "--json"}).out)[0]["exposure"];
  EXPECT_NEAR(exposure["exposure_s"].get<double>(), 1.0 / 60, 1e-6);  // a rational of the DNG
  EXPECT_NEAR(exposure["f_number"].get<double>(), 5.6, 1e-6);
}

TEST_F(Usage, DarkFramesHaveATruthOnlyWhereItIsNamed) {
  simulated("dark", "d.dng");
  EXPECT_EQ(scratch_.names(), Words{"d.dng"});
  simulated("dark", "n.dng", {"--truth", file("named.exr")});
  simulated("dark", "stars.dng", {"--stars", "3"});
  EXPECT_TRUE(scratch_.holds("named.exr") && scratch_.holds("stars.truth.exr"));
  EXPECT_FALSE(scratch_.holds("n.truth.exr"));
}

TEST_F(Usage, NoEffectsAreAcceptedWithoutALook) {
  const auto none = lowlux({"develop", dog, "-o", file("x.png"), "--half", "--effects", "none"});
  EXPECT_EQ(none.exit_code, 0) << none.err;
  refused({"develop", dog, "-o", file("x.png"), "--effects", "hue"}, "--look eye");
}

TEST_F(Usage, AnImpossibleBlackLevelNamesTheOptionThatHelps) {
  const auto result = lowlux({"develop", dog, "-o", file("x.png"), "--black", "2000"});
  EXPECT_EQ(result.exit_code, 1);
  EXPECT_TRUE(holds(result.err, "is not above the black level 2000 DN: give it with --black DN")) << result.err;
}

// A frame without an ISO, and a profile of four.
TEST_F(Usage, AGainSettingIsChosenWhereTheRawStatesNoIso) {
  ASSERT_EQ(lowlux({"calibrate", "quoted", "ELD_NikonD850", "-o", file("p.json")}).exit_code, 0);
  Json profile = Json::parse(scratch_.read("p.json"));
  profile["make"] = profile["model"] = "";  // of any camera
  scratch_.write("p.json", profile.dump());
  const auto developed = [&](const Words& more) {
    Words words{"develop", dog, "-o", file("x.png"), "--force", "--profile", file("p.json"), "--json"};
    words.insert(words.end(), more.begin(), more.end());
    return lowlux(words);
  };
  const auto lost = developed({});
  EXPECT_EQ(lost.exit_code, 1);
  EXPECT_TRUE(holds(lost.err, "--gain-setting: 'ISO 100', 'ISO 400', 'ISO 1600', 'ISO 6400'")) << lost.err;
  for (const char* setting : {"ISO 1600", "1600", "800"}) {
    const auto found = developed({"--gain-setting", setting});
    EXPECT_EQ(found.exit_code, 0) << setting << found.err;
  }
  const auto other = developed({"--gain-setting", "high"});
  EXPECT_EQ(other.exit_code, 1);
  EXPECT_TRUE(holds(other.err, "no gain setting 'high', it has 'ISO 100'")) << other.err;
  refused({"develop", dog, "-o", file("x.png"), "--gain-setting", "100"}, "name the profile with --profile");
}

TEST_F(Usage, AnEmptyValueIsRefused) {
  for (const char* option : {"--bits", "--gain-setting", "--wb", "--quality", "--jobs", "--profile", "--dark-frame"}) {
    refused({"develop", dog, "-o", file("x.png"), option, ""}, option);
  }
  refused({"develop", dog, "-o", ""}, "--output has no value");
  for (const char* option : {"--movers", "--masked-columns", "--reduce", "--horizon", "--bits", "--stars", "--light"}) {
    refused({"simulate", "flat", "-o", file("x.dng"), option, ""}, option);
  }
  EXPECT_TRUE(scratch_.names().empty());
}

TEST_F(Usage, NegativeFiguresOfTheDarkCurrentAreRefusedWithoutADarkCurrentToo) {
  for (const char* option : {"--dark-activation", "--dark-floor"}) {
    refused({"simulate", "dark", "-o", file("x.dng"), option, "-1"}, "'-1' is not a number of at least 0");
    simulated("dark", std::string(option) + ".dng", {option, "0"});
  }
}

TEST_F(Usage, WrongNumbersAndRepeatedOptionsAreNamedInPlainWords) {
  refused({"develop", dog, "-o", file("x.png"), "--bits", "nan"}, "--bits: 'nan' is none of 8, 16, 32;");
  refused({"develop", dog, "-o", file("x.png"), "--bits", "12"}, "--bits: '12' is none of 8, 16, 32;");
  refused({"simulate", "flat", "-o", file("x.dng"), "--bits", "nan"}, "--bits: 'nan' is not a whole number;");
  refused({"develop", dog, "-o", file("x.png"), "--bits", "8", "--bits", "8"}, ": --bits is given more than once;");
  refused({"develop", dog, "-o", file("x.png"), "--jobs", "1", "--jobs", "2"}, ": --jobs is given more than once;");
}

TEST_F(Usage, EveryLampIsAddedToTheScene) {
  const auto with = [&](const Words& lamps) {
    Words words = lamps;
    words.insert(words.end(), {"--effects", "none", "--no-truth", "--force"});
    simulated("flat", "lamps.dng", words);
    return scratch_.read("lamps.dng");
  };
  const Words left{"--lamp", "8,8,D65,100"}, right{"--lamp", "40,8,A,100"};
  const Words both{left[0], left[1], right[0], right[1]};
  const std::string two = with(both);
  EXPECT_NE(two, with(left));
  EXPECT_NE(two, with(right));
}

}  // namespace
}  // namespace lowlux
