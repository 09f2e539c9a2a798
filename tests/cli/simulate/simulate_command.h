#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <string>
#include <vector>

#include "tests/cli/command.h"
#include "tests/support/scratch_directory.h"

namespace lowlux::test {

/// Runs `lowlux simulate`, its files going to a folder of the test's own.
class SimulateCommand : public testing::Test {
 protected:
  /// `scene`, the output NAME.dng and, unless it is a file, a size that takes no time, then `more`.
  ProcessResult simulate(const std::string& scene, const std::string& name, const std::vector<std::string>& more = {}) {
    std::vector<std::string> args{simulating_command(), "simulate", scene, "-o", file(name)};
    if (!std::filesystem::exists(scene) && std::find(more.begin(), more.end(), "--size") == more.end()) {
      args.insert(args.end(), {"--size", "64x48"});
    }
    args.insert(args.end(), more.begin(), more.end());
    return run_process(args);
  }

  /// The same, expected to be done without a word on stderr.
  ProcessResult simulated(const std::string& scene, const std::string& name,
                          const std::vector<std::string>& more = {}) {
    ProcessResult result = simulate(scene, name, more);
    EXPECT_EQ(result.exit_code, 0) << testing::PrintToString(more) << result.err;
    EXPECT_EQ(result.err, "") << testing::PrintToString(more);
    return result;
  }

  std::string file(const std::string& name) const { return scratch_.file(name); }

  ScratchDirectory scratch_;
};

}  // namespace lowlux::test
