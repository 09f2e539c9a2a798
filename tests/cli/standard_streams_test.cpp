// The name "-": raw files from standard input, images to standard output.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <string>

#include <nlohmann/json.hpp>

#include "tests/cli/command.h"
#include "tests/support/scratch_directory.h"

namespace lowlux {
namespace {

using test::dog;
using test::holds;
using test::lowlux;

class StandardStreams : public testing::Test {
 protected:
  std::string file(const std::string& name) const { return scratch_.file(name); }
  std::string quoted(const std::string& name) const { return "'" + file(name) + "'"; }
  /// Runs a line of the shell in which lowlux is the command.
  static test::ProcessResult shell(const std::string& line) {
    return test::run_process({"sh", "-c", "lowlux() { '" + test::tested_command() + "' \"$@\"; }; " + line});
  }
  static int lines_of(const std::string& text) { return static_cast<int>(std::count(text.begin(), text.end(), '\n')); }

  test::ScratchDirectory scratch_;
};

TEST_F(StandardStreams, AnImageOnStandardOutputIsTheFileThatWouldBeWritten) {
  for (const char* const format : {"png", "jpg", "tif", "exr", "pfm"}) {
    const std::string written = file(std::string("x.") + format), piped = file(std::string("piped.") + format);
    ASSERT_EQ(lowlux({"develop", dog, "-o", written, "--half", "--quiet"}).exit_code, 0);
    const auto result = shell(fmt::format("lowlux develop '{}' -o - --half --format {} > '{}'", dog, format, piped));
    EXPECT_EQ(result.exit_code, 0) << result.err;
    EXPECT_TRUE(test::read_file(piped) == test::read_file(written)) << format;
  }
}

TEST_F(StandardStreams, ARawFileOfStandardInputIsThatOfItsName) {
  ASSERT_EQ(lowlux({"develop", dog, "-o", file("a.png"), "--half", "--quiet"}).exit_code, 0);
  const auto both = shell("lowlux develop - -o - --half < '" + dog + "' > " + quoted("b.png"));
  EXPECT_EQ(both.exit_code, 0) << both.err;
  EXPECT_TRUE(test::read_file(file("a.png")) == test::read_file(file("b.png")));
  EXPECT_EQ(shell("lowlux develop - -o " + quoted("out/") + " --half < '" + dog + "'").exit_code, 0);
  EXPECT_TRUE(std::filesystem::exists(file("out/stdin.png")));
  const auto clean = shell("lowlux denoise - -o - < '" + dog + "' 2> /dev/null | lowlux info --json -");
  ASSERT_EQ(clean.exit_code, 0) << clean.err;
  EXPECT_EQ(nlohmann::json::parse(clean.out)[0]["make"], "Nokia") << clean.out;
}

TEST_F(StandardStreams, AFileOfThatNameIsNotTheOutput) {
  ASSERT_EQ(lowlux({"develop", dog, "-o", file("a.png"), "--half", "--quiet"}).exit_code, 0);
  const auto result =
      shell("cd " + quoted("") + " && echo other > ./- && lowlux develop - -o - --half --skip-existing " + "< '" +
            std::filesystem::absolute(dog).string() + "' > b.png");
  EXPECT_EQ(result.exit_code, 0) << result.err;
  EXPECT_TRUE(test::read_file(file("a.png")) == test::read_file(file("b.png"))) << result.err;
  EXPECT_EQ(std::filesystem::file_size(file("-")), 6U) << "is left as it is";
}

TEST_F(StandardStreams, AReaderThatEndsGivesOneLine) {
  const auto result =
      shell("(lowlux develop '" + dog + "' -o - --quiet; echo \"status $?\" >&2) | head -c 10 > /dev/null");
  EXPECT_TRUE(holds(result.err, "cannot write to the output stream")) << result.err;
  EXPECT_TRUE(holds(result.err, "status 1")) << result.err;
  EXPECT_EQ(lines_of(result.err), 2) << result.err;
}

TEST_F(StandardStreams, RefuseWhatCannotBeInOneLine) {
  const std::string raw = "'" + dog + "'";
  for (const auto& [line, code, why] : {std::tuple{"develop - - -o " + quoted("out/"), 2, "given twice"},
                                        {"develop " + raw + " -o - --json", 2, "standard output is the file"},
                                        {"develop " + raw + " -o - --json --nonsense", 2, "unknown option"},
                                        {"develop " + raw + " -o- --json --nonsense", 2, "unknown option"},
                                        {"develop " + raw + " --output=- --json --jobs 0", 2, "--jobs"},
                                        {"develop " + raw + " -o - --explain", 2, "standard output is the file"},
                                        {"denoise " + raw + " -o - --timings", 2, "standard output is the file"},
                                        {"develop " + raw + " -o - --maps", 2, "maps need the name of a file"},
                                        {fmt::format("develop {} {} -o -", raw, raw), 2, "folder"},
                                        {"merge - " + raw + " -o " + quoted("m.dng"), 2, "more than once"},
                                        {"develop --merge - " + raw + " -o " + quoted("m.png"), 2, "more than once"},
                                        {"develop - -o " + quoted("e.png") + " < /dev/null", 1, "the file is empty"}}) {
    const auto result = shell("lowlux " + line);
    EXPECT_EQ(result.exit_code, code) << line << result.err;
    EXPECT_TRUE(holds(result.err, why)) << line << result.err;
    EXPECT_EQ(lines_of(result.err), 1) << result.err;
    EXPECT_TRUE(result.out.empty()) << line;
  }
  EXPECT_FALSE(std::filesystem::exists(file("e.png")));
}

}  // namespace
}  // namespace lowlux
