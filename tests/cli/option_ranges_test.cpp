// The range that the error of a number states is the range that the option takes: numbers below and above it are
// refused with the same range, and both of its ends are taken.
#include <gtest/gtest.h>

#include <cstddef>
#include <cstdlib>
#include <regex>
#include <set>
#include <sstream>
#include <string>
#include <vector>

#include "tests/cli/command.h"
#include "tests/support/process.h"
#include "tests/support/scratch_directory.h"

namespace lowlux {
namespace {

using Words = std::vector<std::string>;

/// Options of which a number is a file, which take several numbers, or of which the last number would take minutes.
const std::set<std::string> left_out{"output", "truth", "truth-electrons", "report",  "map",
                                     "size",   "lamp",  "black",           "bracket", "frames"};

struct Verb {
  Words name, arguments;
};

/// Verbs with arguments that are in order, but for files that are missing.
const std::vector<Verb> verbs{
    {{"develop"}, {"missing.dng", "-o", "x.png"}},
    {{"develop"}, {"missing.dng", "-o", "x.png", "--look", "eye"}},
    {{"develop"}, {"missing.dng", "-o", "x.png", "--dark-frame", "missing.dng"}},
    {{"denoise"}, {"missing.dng", "-o", "x.dng"}},
    {{"merge"}, {"missing.dng", "missing2.dng", "-o", "x.dng"}},
    {{"merge"}, {"missing.dng", "missing2.dng", "-o", "x.dng", "--drizzle", "2"}},
    {{"info"}, {"--advise", "--sensor", "ELD_NikonD850", "--luminance", "1"}},
    {{"info"}, {"missing.dng", "--advise"}},
    {{"capture"}, {"--v4l2", "/dev/missing", "-o", "x.dng"}},
    {{"capture"}, {"--v4l2", "/dev/missing", "-o", "x.dng", "--auto-exposure"}},
    {{"calibrate", "black"}, {"missing.dng", "-o", "x.json"}},
    {{"calibrate", "noise"}, {"missing.dng", "-o", "x.json"}},
    {{"calibrate", "sheet"}, {"--flats", "missing.dng", "--darks", "missing2.dng", "-o", "x"}},
    {{"calibrate", "colour"}, {"missing.dng", "-o", "x.json"}},
    {{"retarget"}, {"missing.png", "-o", "x.png"}},
    {{"resaturate"}, {"missing.png", "-o", "x.png"}},
    {{"simulate"}, {"flat", "--size", "64x64", "-o", "x.dng", "--no-truth", "--force"}},
    {{"simulate"},
     {"flat", "--size", "64x64", "-o", "x.dng", "--no-truth", "--force", "--dark-current", "1e6", "--hot-pixels", "0.1",
      "--telegraph-pixels", "0.1", "--glow", "1"}},
    {{"dataset"}, {"missing.json", "-o", "x"}},
    {{"compare"}, {"missing.png", "missing2.png"}},
#ifdef LOWLUX_WITH_MEASUREMENT
    {{"bench"}, {"--stage", "missing"}},
    {{"reproduce"}, {"missing"}},
#endif
};

std::string text_of(const Words& words) {
  std::string out;
  for (const std::string& word : words) out += word + " ";
  return out;
}

class Ranges {
 public:
  explicit Ranges(const Verb& verb) : verb_(verb) {}

  std::vector<std::string> options() const {
    Words words = verb_.name;
    words.emplace_back("--help-options");
    std::istringstream lines(run(words).out);
    std::vector<std::string> out;
    for (std::string option; lines >> option;) {
      const bool is_given = text_of(verb_.arguments).find("--" + option + " ") != std::string::npos;
      if (!is_given && !left_out.contains(option)) out.push_back(option);
    }
    return out;
  }

  /// Returns the error if an option has this value.
  std::string error_of(const std::string& option, const std::string& value) const {
    Words words = verb_.name;
    words.insert(words.end(), verb_.arguments.begin(), verb_.arguments.end());
    words.push_back("--" + option);
    words.push_back(value);
    return run(words).err;
  }

 private:
  test::ProcessResult run(const Words& words) const {
    Words all{"/bin/sh", "-c", "cd \"$1\" && shift && exec \"$@\"", "sh", scratch_.path(), test::tested_command()};
    all.insert(all.end(), words.begin(), words.end());
    return test::run_process(all);
  }

  const Verb& verb_;
  test::ScratchDirectory scratch_;
};

/// Returns the two ends of the range that a text states; no words if it states none.
Words range_in(const std::string& text) {
  static const std::regex form(
      R"((?:from|of|within|between) (-?[0-9.]+(?:e[+-]?[0-9]+)?) (?:to|and) (-?[0-9.]+(?:e[+-]?[0-9]+)?))");
  std::smatch found;
  return std::regex_search(text, found, form) ? Words{found[1], found[2]} : Words{};
}

bool refuses_number(const std::string& error) {
  static const std::regex form("at most|at least|above 0|must lie|must be|is not (?!a regular)|is neither");
  return std::regex_search(error, form);
}

// Every third option, beginning at another one for each verb; scripts/nightly tries all.
TEST(OptionRanges, TheRangeOfTheErrorIsTheRangeThatIsTaken) {
  const bool nightly = std::getenv("LOWLUX_NIGHTLY") != nullptr;
  std::size_t first = 0;
  int ranges = 0;
  for (const Verb& verb : verbs) {
    const Ranges of(verb);
    const auto options = of.options();
    EXPECT_FALSE(options.empty()) << text_of(verb.name);
    const std::size_t step = nightly ? 1 : 3;
    for (std::size_t i = first++ % step; i < options.size(); i += step) {
      const std::string& option = options[i];
      std::set<Words> stated;
      std::string errors;
      for (const char* const value : {"-1", "0", "1e13"}) {
        const std::string error = of.error_of(option, value);
        if (const Words range = range_in(error); !range.empty()) stated.insert(range), errors += error;
      }
      if (stated.empty()) continue;
      ++ranges;
      EXPECT_EQ(stated.size(), 1U) << text_of(verb.name) << "--" << option << ": " << errors;
      for (const std::string& end : *stated.begin()) {
        const std::string error = of.error_of(option, end);
        EXPECT_FALSE(refuses_number(error)) << text_of(verb.name) << "--" << option << " " << end << ": " << error;
      }
    }
  }
  EXPECT_GT(ranges, nightly ? 60 : 20);
}

}  // namespace
}  // namespace lowlux
