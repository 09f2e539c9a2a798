#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "tests/support/process.h"

namespace lowlux::test {

/// Runs the command with these words to its end.
inline ProcessResult lowlux(std::vector<std::string> words) {
  words.insert(words.begin(), LOWLUX_COMMAND);
  return run_process(words);
}

inline bool holds(std::string_view text, std::string_view part) { return text.find(part) != std::string_view::npos; }

/// Real raw files.
inline const std::string raws = LOWLUX_TESTDATA "/raws/";
inline const std::string dog = raws + "n900_dog_small_grbg10in16.dng";

}  // namespace lowlux::test
