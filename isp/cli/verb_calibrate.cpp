#include <cstdio>

#include <fmt/format.h>

#include "isp/cli/calibrate_colour.h"
#include "isp/cli/exit_code.h"
#include "isp/cli/verbs.h"

namespace lowlux::cli {

int run_calibrate(const std::vector<std::string>& words) {
  if (!words.empty() && words.front() == "colour") return run_calibrate_colour({words.begin() + 1, words.end()});
  const bool help = !words.empty() && (words.front() == "--help" || words.front() == "-h");
  fmt::print(help ? stdout : stderr,
             "lowlux calibrate: what is to be calibrated: colour; "
             "`lowlux calibrate colour --help` lists the options\n");
  return help ? exit_done : exit_usage;
}

}  // namespace lowlux::cli
