#include <algorithm>
#include <array>
#include <cstdio>
#include <exception>
#include <new>
#include <string>
#include <string_view>
#include <vector>

#include <fmt/format.h>

#include "isp/cli/exit_code.h"
#include "isp/cli/option_values.h"
#include "isp/cli/report.h"
#include "isp/cli/verbs.h"
#include "isp/cli/version.h"
#include "isp/raw/raw_to_rgb.h"

namespace lowlux::cli {
namespace {

struct Verb {
  std::string_view name;
  std::string_view summary;
  int (*run)(const std::vector<std::string>& args);
};

constexpr std::array verbs{
    Verb{"bench", "accuracy against time, beside other methods", run_bench},
    Verb{"calibrate", "a camera's black point, noise and colour, measured", run_calibrate},
    Verb{"capture", "frames of a camera to pictures, raw files or a film", run_capture},
    Verb{"compare", "how far one picture is from another", run_compare},
    Verb{"denoise", "raw files without noise, for any raw developer", run_denoise},
    Verb{"develop", "raw files to pictures", run_develop},
    Verb{"info", "what a raw file says, and what was measured on it", run_info},
    Verb{"reproduce", "the published experiments, each finding beside ours", run_reproduce},
    Verb{"resaturate", "pictures whose colours dark current took", run_resaturate},
    Verb{"retarget", "pictures made to look right on dim displays", run_retarget},
    Verb{"simulate", "raw files of scenes of known truth", run_simulate},
};

void print_help(std::FILE* out) {
  fmt::print(out, "lowlux: a raw developer for pictures taken in the dark\n\nusage: lowlux VERB [OPTIONS]\n\nverbs:\n");
  for (const Verb& verb : verbs) fmt::print(out, "  {:<10} {}\n", verb.name, verb.summary);
  fmt::print(out,
             "\n`lowlux VERB --help` lists a verb's options, `lowlux --version` what is built in.\n"
             "exit codes: 0 done, 1 an input or the work failed, 2 the command line is wrong\n");
}

int run_verb(const std::vector<std::string>& args) {
  const std::string& first = args.front();
  for (const Verb& verb : verbs) {
    if (verb.name == first) return verb.run({args.begin() + 1, args.end()});
  }
  std::array<std::string_view, verbs.size()> names;
  std::ranges::transform(verbs, names.begin(), &Verb::name);
  fmt::print(stderr, "{}\n",
             one_line(fmt::format("lowlux: unknown verb '{}'{}; `lowlux --help` lists them", first,
                                  suggestion(first, names))));
  return exit_usage;
}

int run(std::vector<std::string> args) {
  if (args.empty()) {
    print_help(stderr);
    return exit_usage;
  }
  if (args.front() == "help" && args.size() > 1) {  // help VERB: VERB --help
    args.erase(args.begin());
    args.emplace_back("--help");
  }
  const std::string& first = args.front();
  if (first == "--help" || first == "-h" || first == "help") {
    print_help(stdout);
    return exit_done;
  }
  if (first == "--version" || first == "-v") {
    fmt::print("{}\n", version_text());
    return exit_done;
  }
  if (!isp::cpu_runs_raw_to_rgb()) {
    fmt::print(stderr, "lowlux: this processor lacks SSSE3, which the kernels need\n");
    return exit_failed;
  }
  return run_verb(args);
}

}  // namespace
}  // namespace lowlux::cli

int main(int argc, char** argv) {
  try {
    const int code = lowlux::cli::run({argv + 1, argv + argc});
    if (std::fflush(stdout) == 0 && std::ferror(stdout) == 0) return code;
    std::fprintf(stderr, "lowlux: cannot write to standard output\n");
    return lowlux::cli::exit_failed;
  } catch (const std::bad_alloc&) {
    std::fprintf(stderr, "lowlux: not enough memory\n");
    return lowlux::cli::exit_failed;
  } catch (const std::exception& failure) {
    std::fprintf(stderr, "lowlux: %s\n", failure.what());
    return lowlux::cli::exit_failed;
  }
}
