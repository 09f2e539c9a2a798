#include <gtest/gtest.h>

#include <algorithm>
#include <set>
#include <sstream>
#include <string>
#include <vector>

#include "tests/cli/command.h"

namespace lowlux {
namespace {

using test::holds;
using test::lowlux;

using Words = std::vector<std::string>;

std::vector<Words> all_verbs() {
  std::vector<Words> verbs{{"develop"},
                           {"denoise"},
                           {"merge"},
                           {"info"},
                           {"doctor"},
                           {"capture"},
                           {"calibrate", "black"},
                           {"calibrate", "noise"},
                           {"calibrate", "colour"},
                           {"calibrate", "quoted"},
                           {"retarget"},
                           {"resaturate"},
                           {"simulate"},
                           {"dataset"},
                           {"compare"}};
  if (test::has_measurement()) verbs.insert(verbs.end(), {{"bench"}, {"reproduce"}});
  return verbs;
}

std::string help_of(Words verb, const char* flag) {
  verb.emplace_back(flag);
  const auto help = lowlux(verb);
  EXPECT_EQ(help.exit_code, 0) << testing::PrintToString(verb) << help.err;
  EXPECT_EQ(help.err, "");
  return help.out;
}

/// Returns the options that lines of a help text begin with, in order.
Words options_in(const std::string& help) {
  Words options;
  std::istringstream lines(help);
  for (std::string line; std::getline(lines, line);) {
    if (!line.starts_with("  -")) continue;
    const std::size_t at = line.find("--");
    options.push_back(line.substr(at, line.find_first_of(" ,", at) - at));
  }
  return options;
}

TEST(Help, FewOptionsAreShownAndAllOnRequest) {
  for (const Words& verb : all_verbs()) {
    const Words few = options_in(help_of(verb, "--help")), all = options_in(help_of(verb, "--help-all"));
    const std::set<std::string> different(all.begin(), all.end());
    EXPECT_EQ(different.size(), all.size()) << testing::PrintToString(verb) << " lists an option twice";
    EXPECT_GE(few.size(), 1U);
    EXPECT_LE(few.size(), 15U) << testing::PrintToString(verb);
    EXPECT_TRUE(std::equal(few.begin(), few.end(), all.begin())) << testing::PrintToString(verb);
    EXPECT_TRUE(different.contains("--help-all"));
  }
  const std::string help = help_of({"develop"}, "--help");
  EXPECT_FALSE(holds(help, "--adaptation-degree"));
  EXPECT_TRUE(holds(help_of({"develop"}, "--help-all"), "\nNight look:\n  --scene-luminance auto|CD_M2\n"));
  EXPECT_EQ(help_of({"develop"}, "-h"), help);
}

TEST(Help, TheNumberOfFurtherOptionsIsThatOfTheFullHelp) {
  for (const Words& verb : all_verbs()) {
    const std::string few = help_of(verb, "--help");
    const std::size_t more = options_in(help_of(verb, "--help-all")).size() - options_in(few).size();
    EXPECT_TRUE(holds(few, "--help-all` lists " + std::to_string(more) + " more options.")) << few;
  }
}

TEST(Help, NoOptionIsWithoutAGroup) {
  for (const Words& verb : all_verbs()) EXPECT_FALSE(holds(help_of(verb, "--help-all"), "\nMore:\n")) << verb.front();
}

TEST(Help, LinesFitATerminalUnlessAWordIsLonger) {
  for (const Words& verb : all_verbs()) {
    std::istringstream lines(help_of(verb, "--help-all"));
    for (std::string line; std::getline(lines, line);) {
      const bool one_word = line.find(' ', line.find_first_not_of(' ')) == std::string::npos;
      const bool unbroken = one_word || line.starts_with("  -") || line.starts_with("  lowlux ");  // to be copied
      EXPECT_LE(line.size(), unbroken ? 100U : 80U) << line;
    }
  }
}

TEST(Help, PlaceholdersListTheValuesInOrderOfEffect) {
  const std::string help = help_of({"develop"}, "--help");
  EXPECT_TRUE(holds(help, "--denoise auto|off|draft|standard|high|best\n")) << help;
  EXPECT_TRUE(holds(help, "--format png|jpg|tif|exr|pfm\n")) << help;
  EXPECT_TRUE(holds(help, "--quality N ")) << help;
  EXPECT_TRUE(holds(help, "Usage: lowlux develop RAW... -o OUT [OPTIONS]\n")) << help;
  for (const Words& verb : all_verbs()) {
    const std::string all = help_of(verb, "--help-all");
    for (const char* leftover : {"INT", "TEXT", "NONNEGATIVE", "REQUIRED", "Excludes"}) {
      EXPECT_FALSE(holds(all, leftover)) << testing::PrintToString(verb) << leftover;
    }
  }
}

TEST(Help, ExamplesAreOfOptionsThatExist) {
  for (const Words& verb : all_verbs()) {
    const std::string help = help_of(verb, "--help-all");
    const Words options = options_in(help);
    ASSERT_TRUE(holds(help, "\nExamples:\n")) << testing::PrintToString(verb);
    std::istringstream words(help.substr(help.find("\nExamples:\n")));
    for (std::string word; words >> word;) {
      const bool known = !word.starts_with("--") || std::ranges::find(options, word) != options.end();
      EXPECT_TRUE(known) << word;
    }
  }
}

TEST(Help, VerbsOfOnePageHaveNoFurtherOne) {
  const auto both = lowlux({"develop", "--help", "--help-all"});
  EXPECT_EQ(both.exit_code, 0);
  for (const Words& words : {Words{"--help-all"}, Words{"calibrate", "--help-all"}}) {
    EXPECT_EQ(lowlux(words).exit_code, 0);
  }
  EXPECT_EQ(lowlux({"--help-all"}).out, lowlux({"--help"}).out);
  EXPECT_EQ(lowlux({"calibrate", "--help-all"}).out, lowlux({"calibrate", "-h"}).out);
}

}  // namespace
}  // namespace lowlux
