#include <gtest/gtest.h>

#include <algorithm>
#include <set>
#include <sstream>
#include <string>
#include <vector>

#include "tests/cli/command.h"
#include "tests/support/scratch_directory.h"

namespace lowlux {
namespace {

using test::holds;
using test::lowlux;

using Words = std::vector<std::string>;

std::string printed(const Words& words) {
  const auto result = lowlux(words);
  EXPECT_EQ(result.exit_code, 0) << testing::PrintToString(words) << result.err;
  EXPECT_EQ(result.err, "");
  return result.out;
}

Words words_in(const std::string& text) {
  std::istringstream in(text);
  Words words;
  for (std::string word; in >> word;) words.push_back(word);
  return words;
}

/// Returns the verbs that have a page, each as its words.
std::vector<Words> pages() {
  std::vector<Words> all;
  std::istringstream lines(printed({"help", "--pages"}));
  for (std::string line; std::getline(lines, line);) all.push_back(words_in(line));
  return all;
}

/// Returns long options at the beginnings of lines of --help-all.
std::set<std::string> options_of(Words verb) {
  verb.emplace_back("--help-all");
  std::set<std::string> options;
  std::istringstream lines(printed(verb));
  for (std::string line; std::getline(lines, line);) {
    const std::size_t at = line.find("--");
    if (line.starts_with("  -")) options.insert(line.substr(at, line.find_first_of(" ,", at) - at));
  }
  return options;
}

std::string without_backslashes(std::string text) {
  std::erase(text, '\\');
  return text;
}

bool has_program(const std::string& name) {
  return test::run_process({"sh", "-c", "command -v " + name + " > /dev/null"}).exit_code == 0;
}

/// Returns what bash offers for a command line whose last word is incomplete.
Words bash_offers(const test::ScratchDirectory& scratch, const std::string& line) {
  const Words words = words_in(line + "|");
  std::string script = "source " + scratch.file("lowlux.bash") + "; COMP_WORDS=(";
  for (const std::string& word : words) script += "'" + word.substr(0, word.find('|')) + "' ";
  script += "); COMP_CWORD=" + std::to_string(words.size() - 1) + "; _lowlux; echo \"${COMPREPLY[@]}\"";
  const auto result = test::run_process({"bash", "-c", script});
  EXPECT_EQ(result.exit_code, 0) << result.err;
  EXPECT_EQ(result.err, "");
  return words_in(result.out);
}

TEST(HelpFiles, EveryVerbHasAPageAndEveryOptionIsOnIt) {
  EXPECT_EQ(pages().size(), test::has_measurement() ? 18U : 16U);
  const std::string main_page = printed({"help", "--man"});
  for (const Words& verb : pages()) {
    Words man{"help", "--man"};
    man.insert(man.end(), verb.begin(), verb.end());
    const std::string page = printed(man), text = without_backslashes(page);
    EXPECT_TRUE(page.starts_with(".TH LOWLUX\\-")) << page.substr(0, 80);
    EXPECT_TRUE(holds(main_page, "\\fB" + verb.front() + "\\fR"));
    for (const std::string& option : options_of(verb)) EXPECT_TRUE(holds(text, "fB" + option + "fR")) << option;
  }
}

TEST(HelpFiles, ManPrintsThePagesWithoutWarnings) {
  if (!has_program("man")) GTEST_SKIP() << "man is not installed";
  const test::ScratchDirectory scratch;
  for (const Words& verb : pages()) {
    Words man{"help", "--man"};
    man.insert(man.end(), verb.begin(), verb.end());
    scratch.write("page.1", printed(man));
    const auto shown = test::run_process(
        {"sh", "-c",
         "LC_ALL=C.UTF-8 MANWIDTH=80 man --warnings -E UTF-8 -l -Tutf8 -Z " + scratch.file("page.1") + " > /dev/null"});
    EXPECT_EQ(shown.exit_code, 0);
    EXPECT_EQ(shown.err, "") << verb.front();
  }
}

TEST(HelpFiles, EveryShellCompletesEveryOption) {
  for (const char* shell : {"bash", "zsh", "fish"}) {
    const std::string script = printed({"help", "--completion", shell});
    for (const Words& verb : pages()) {
      for (const std::string& option : options_of(verb)) {
        EXPECT_TRUE(holds(script, std::string(shell) == "fish" ? " -l " + option.substr(2) + " " : option))
            << shell << option;
      }
    }
    const test::ScratchDirectory scratch;
    scratch.write("script", script);
    if (!has_program(shell)) continue;
    const auto parsed = test::run_process({shell, "-n", scratch.file("script")});
    EXPECT_EQ(parsed.exit_code, 0) << shell << parsed.err;
    EXPECT_EQ(parsed.err, "") << shell;
  }
  EXPECT_EQ(lowlux({"help", "--completion", "csh"}).exit_code, 2);
  EXPECT_EQ(lowlux({"help", "--completion"}).exit_code, 2);
  EXPECT_EQ(lowlux({"help", "--man", "fry"}).exit_code, 2);
}

TEST(HelpFiles, BashOffersVerbsOptionsAndValues) {
  const test::ScratchDirectory scratch;
  scratch.write("lowlux.bash", printed({"help", "--completion", "bash"}));
  EXPECT_EQ(bash_offers(scratch, "lowlux de"), (Words{"denoise", "develop"}));
  EXPECT_EQ(bash_offers(scratch, "lowlux calibrate "), (Words{"black", "colour", "noise", "quoted", "sheet"}));
  EXPECT_EQ(bash_offers(scratch, "lowlux develop --den"), (Words{"--denoise"}));
  EXPECT_EQ(bash_offers(scratch, "lowlux calibrate black --ma"), (Words{"--map", "--masked"}));
  EXPECT_EQ(bash_offers(scratch, "lowlux develop --denoise d"), (Words{"draft"}));
  EXPECT_EQ(bash_offers(scratch, "lowlux develop --wb f"), (Words{"flash", "fluorescent"}));
  EXPECT_EQ(bash_offers(scratch, "lowlux develop --denoise = d"), (Words{"draft"})) << "as bash divides --denoise=d";
  EXPECT_EQ(bash_offers(scratch, "lowlux develop --denoise ="), bash_offers(scratch, "lowlux develop --denoise "));
  EXPECT_EQ(bash_offers(scratch, "lowlux develop --profile "), Words{});  // the shell then offers files
  EXPECT_EQ(bash_offers(scratch, "lowlux fry --d"), Words{});
  const Words all = bash_offers(scratch, "lowlux develop --");
  const std::set<std::string> offered(all.begin(), all.end()), known = options_of({"develop"});
  EXPECT_EQ(offered, known);
}

TEST(HelpFiles, FishOffersVerbsOptionsAndValues) {
  if (!has_program("fish")) GTEST_SKIP() << "fish is not installed";
  const test::ScratchDirectory scratch;
  scratch.write("lowlux.fish", printed({"help", "--completion", "fish"}));
  const auto offers = [&](const std::string& line) {
    const auto result = test::run_process(
        {"env", "HOME=" + scratch.path(), "fish", "--no-config", "-c",
         "source " + scratch.file("lowlux.fish") + "; complete -C '" + line + "' | string replace -r '\\t.*' ''"});
    EXPECT_EQ(result.err, "");
    Words words = words_in(result.out);
    const std::string typed = line.substr(line.rfind(' ') + 1);  // fish 4 also offers words with its letters in between
    std::erase_if(words, [&](const std::string& word) { return !word.starts_with(typed); });
    return words;
  };
  EXPECT_EQ(offers("lowlux dev"), (Words{"develop"}));
  EXPECT_EQ(offers("lowlux develop --den"), (Words{"--denoise"}));
  EXPECT_EQ(offers("lowlux develop --denoise d"), (Words{"draft"}));
  EXPECT_EQ(offers("lowlux calibrate bla"), (Words{"black"}));
  EXPECT_EQ(offers("lowlux calibrate black --mask"), (Words{"--masked"}));
}

}  // namespace
}  // namespace lowlux
