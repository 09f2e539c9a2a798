#include <fcntl.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <csignal>
#include <cstdio>
#include <exception>
#include <new>
#include <string>
#include <string_view>
#include <vector>

#include <fmt/format.h>

#include "isp/cli/shared/exit_code.h"
#include "isp/cli/shared/interruption.h"
#include "isp/cli/shared/lines.h"
#include "isp/cli/shared/machine.h"
#include "isp/cli/shared/option_values.h"
#include "isp/cli/shared/report.h"
#include "isp/cli/verbs.h"
#include "isp/raw/kernel/raw_to_rgb.h"

namespace lowlux::cli {
namespace {

struct Verb {
  std::string_view name;
  std::string_view summary;
  int (*run)(const std::vector<std::string>& args);
};

constexpr std::array verbs{
    Verb{"bench", "accuracy against time, compared with other methods", run_bench},
    Verb{"calibrate", "a camera's black point, noise and colour, measured", run_calibrate},
    Verb{"capture", "frames of a camera to pictures, raw files or video", run_capture},
    Verb{"compare", "how far one picture is from another", run_compare},
    Verb{"denoise", "raw files without noise, for any raw developer", run_denoise},
    Verb{"develop", "raw files to pictures", run_develop},
    Verb{"info", "what a raw file says, and what was measured on it", run_info},
    Verb{"reproduce", "the published experiments, each finding next to ours", run_reproduce},
    Verb{"resaturate", "pictures whose colours dark current took", run_resaturate},
    Verb{"retarget", "pictures made to look right on dim displays", run_retarget},
    Verb{"simulate", "raw files of scenes of known truth", run_simulate},
};

std::string help_text() {
  std::string out =
      "lowlux: a raw developer for pictures taken in the dark\n\nusage: lowlux VERB [OPTIONS]\n\nverbs:\n";
  for (const Verb& verb : verbs) out += fmt::format("  {:<10} {}\n", verb.name, verb.summary);
  return out +
         "\n`lowlux VERB --help` lists a verb's options, `lowlux --version` what is built in.\n"
         "exit codes: 0 done, 1 an input or the work failed, 2 the command line is wrong\n";
}

int run_verb(const std::vector<std::string>& args) {
  const std::string& first = args.front();
  for (const Verb& verb : verbs) {
    if (verb.name == first) return verb.run({args.begin() + 1, args.end()});
  }
  std::array<std::string_view, verbs.size()> names;
  std::ranges::transform(verbs, names.begin(), &Verb::name);
  print_err(fmt::format("{}\n", one_line(fmt::format("lowlux: unknown verb '{}'{}; `lowlux --help` lists them", first,
                                                     suggestion(first, names)))));
  return exit_usage;
}

int run(std::vector<std::string> args) {
  if (args.empty()) {
    print_err(help_text());
    return exit_usage;
  }
  if (args.front() == "help" && args.size() > 1) {  // help VERB is VERB --help
    args.erase(args.begin());
    args.emplace_back("--help");
  }
  const std::string& first = args.front();
  if (first == "--help" || first == "-h" || first == "help") {
    print_out(help_text());
    return exit_done;
  }
  if (first == "--version" || first == "-v") {
    print_out(fmt::format("{}\n", version_text()));
    return exit_done;
  }
  if (!isp::cpu_runs_raw_to_rgb()) {
    print_err("lowlux: this processor lacks SSSE3, which the kernels need\n");
    return exit_failed;
  }
  return run_verb(args);
}

/// Opens closed standard streams; otherwise the first files of the command would get their numbers and its messages.
/// Writing to them still fails.
void open_standard_streams() {
  int descriptor = 0;
  while (descriptor >= 0 && descriptor <= STDERR_FILENO) descriptor = open("/dev/null", O_RDONLY);
  if (descriptor > STDERR_FILENO) close(descriptor);
}

/// Runs the process from the first line of main() on.
int run_process(const std::vector<std::string>& args) {
  open_standard_streams();
  for (const int number : {SIGPIPE, SIGXFSZ}) std::signal(number, SIG_IGN);  // writing then fails, which is reported
  clean_up_on_signals();
  int code = exit_failed;
  try {
    code = run(args);
  } catch (const std::bad_alloc&) {
    print_err("lowlux: not enough memory\n");
  } catch (const std::exception& failure) {
    print_err(fmt::format("{}\n", one_line(std::string("lowlux: ") + failure.what())));
  }
  if (std::fflush(stdout) == 0 && std::ferror(stdout) == 0) return code;
  print_err("lowlux: cannot write to standard output\n");
  return code == exit_done ? exit_failed : code;
}

}  // namespace
}  // namespace lowlux::cli

int main(int argc, char** argv) { return lowlux::cli::run_process({argv + 1, argv + argc}); }
