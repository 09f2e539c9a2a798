#pragma once

#include <cstdlib>
#include <string>
#include <string_view>
#include <vector>

#include "tests/support/process.h"

namespace lowlux::test {

/// Returns the path of the command that is tested: that of this build, or of the variable LOWLUX_TESTED_COMMAND, by
/// which scripts/test has the commands of other builds, with sanitizers, tested.
inline std::string tested_command() {
  const char* const other = std::getenv("LOWLUX_TESTED_COMMAND");
  return other != nullptr ? other : LOWLUX_COMMAND;
}

/// Returns the path of a command that simulates: that of this build if LOWLUX_DEVELOP_ONLY states that the tested one
/// was built with this option.
inline std::string simulating_command() {
  return std::getenv("LOWLUX_DEVELOP_ONLY") != nullptr ? LOWLUX_COMMAND : tested_command();
}

/// Runs the command with these words to its end.
inline ProcessResult lowlux(std::vector<std::string> words) {
  words.insert(words.begin(), tested_command());
  return run_process(words);
}

inline bool holds(std::string_view text, std::string_view part) { return text.find(part) != std::string_view::npos; }

/// Returns whether the command has the verbs bench and reproduce, which builds may leave out.
inline bool has_measurement() { return holds(lowlux({"--help"}).out, "  reproduce "); }

/// Real raw files.
inline const std::string raws = LOWLUX_TESTDATA "/raws/";
inline const std::string dog = raws + "n900_dog_small_grbg10in16.dng";

}  // namespace lowlux::test
