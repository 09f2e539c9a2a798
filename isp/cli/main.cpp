#include <fcntl.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <csignal>
#include <cstddef>
#include <cstdio>
#include <exception>
#include <new>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "isp/cli/help/help_files.h"
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
    Verb{"develop", "develop raw files to images", run_develop},
    Verb{"denoise", "denoise raw files and write DNG for other raw developers", run_denoise},
#ifndef LOWLUX_DEVELOP_ONLY
    Verb{"merge", "merge raw files of one scene to one raw file with less noise", run_merge},
    Verb{"info", "print metadata and measurements of raw files, and exposure advice", run_info},
    Verb{"capture", "take images, raw files or video from a camera", run_capture},
    Verb{"calibrate", "measure black level, noise and colour of a camera", run_calibrate},
    Verb{"retarget", "compensate images for dim displays", run_retarget},
    Verb{"resaturate", "restore colour lost to dark current in finished images", run_resaturate},
    Verb{"doctor", "test the installation and list missing components", run_doctor},
    Verb{"simulate", "simulate raw files with a known noise-free reference", run_simulate},
    Verb{"dataset", "simulate data sets for training, with settings drawn from distributions", run_dataset},
    Verb{"compare", "compare two images: CIEDE2000, gamut, PSNR, SSIM", run_compare},
#endif
#ifdef LOWLUX_WITH_MEASUREMENT
    Verb{"bench", "measure accuracy against time, compared with other methods", run_bench},
    Verb{"reproduce", "repeat published experiments and compare the findings", run_reproduce},
#endif
};
constexpr std::size_t photographers_verbs = 9;  // the first ones; the others are for measurement

std::string help_text() {
  std::string out = "lowlux: a raw developer for low light\n\nUsage: lowlux VERB [OPTIONS]\n\nPhotographs:\n";
  for (std::size_t i = 0; i < verbs.size(); ++i) {
    if (i == photographers_verbs) out += "\nMeasurement:\n";
    out += fmt::format("  {:<10}  {}\n", verbs[i].name, verbs[i].summary);
  }
  return out +
         "\nExamples:\n  lowlux develop night.nef -o night.jpg\n  lowlux develop raws/ -o pictures/ --format jpg\n\n"
         "`lowlux VERB --help` prints the most used options of a verb, `lowlux VERB --help-all` all,\n"
         "`lowlux --version` what is built in.\n"
         "Exit status: 0 success, 1 an input or the work failed, 2 usage error\n";
}

int run_verb(const std::vector<std::string>& args) {
  const std::string& first = args.front();
  for (const Verb& verb : verbs) {
    if (verb.name == first) return verb.run({args.begin() + 1, args.end()});
  }
  std::array<std::string_view, verbs.size()> names;
  std::ranges::transform(verbs, names.begin(), &Verb::name);
  const std::string wrong = fmt::format("unknown verb '{}'{}", first, suggestion(first, names));
  print_failure_json({}, {ErrorCode::invalid_argument, wrong, {}}, failure_json(first, args));
  print_err(one_line(fmt::format("lowlux: {}; `lowlux --help` lists them", wrong)) + "\n");
  return exit_usage;
}

void run_all(const std::string& argument) {
  for (const Verb& verb : verbs) verb.run({argument});
}

/// Prints what the build makes files of: names of pages, a manual page, a completion script. Its arguments begin with
/// --pages, --man or --completion.
int run_help(const std::vector<std::string>& args) {
  if (args.front() == "--man" && args.size() > 1) {
    std::vector<std::string> verb(args.begin() + 1, args.end());
    verb.emplace_back("--help-man");
    return run_verb(verb);
  }
  if (args.front() == "--man") {
    std::vector<std::pair<std::string_view, std::string_view>> names;
    names.reserve(verbs.size());
    for (const Verb& verb : verbs) names.emplace_back(verb.name, verb.summary);
    print_out(command_man_page(names));
  } else if (args.front() == "--pages") {
    run_all("--help-name");
  } else if (const auto shell = args.size() > 1 ? shell_named(args[1]) : std::nullopt) {
    print_out(completion_begin(*shell));
    run_all("--help-" + args[1]);
    print_out(completion_end(*shell));
  } else {
    print_err("lowlux help: --completion is for bash, zsh or fish\n");
    return exit_usage;
  }
  return exit_done;
}

/// Prints a failure of the command as a whole. @return exit_failed
int print_breakdown(const Error& error, const std::vector<std::string>& args) {
  if (!args.empty()) print_failure_json({}, error, failure_json(args.front(), args));
  print_err(one_line("lowlux: " + error.message) + "\n");
  return exit_failed;
}

int run(std::vector<std::string> args) {
  if (args.empty()) {
    print_err(help_text());
    return exit_usage;
  }
  if (args.front() == "help" && args.size() > 1 &&
      (args[1] == "--man" || args[1] == "--pages" || args[1] == "--completion")) {
    return run_help({args.begin() + 1, args.end()});
  }
  if (args.front() == "help" && args.size() > 1) {  // help VERB is VERB --help
    args.erase(args.begin());
    args.emplace_back("--help");
  }
  const std::string& first = args.front();
  if (first == "--help" || first == "-h" || first == "--help-all" || first == "help") {
    print_out(help_text());
    return exit_done;
  }
  if (first == "--version" || first == "-v") {
    print_out(fmt::format("{}\n", version_text()));
    return exit_done;
  }
  if (!isp::cpu_runs_raw_to_rgb()) {
    return print_breakdown(
        {ErrorCode::unsupported, "this processor does not support SSSE3, which the kernels require", {}}, args);
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
    code = print_breakdown({ErrorCode::too_large, "not enough memory", {}}, args);
  } catch (const std::exception& failure) {
    code = print_breakdown({ErrorCode::unsupported, failure.what(), {}}, args);
  }
  if (std::fflush(stdout) == 0 && std::ferror(stdout) == 0) return code;
  print_err("lowlux: cannot write to standard output\n");
  return code == exit_done ? exit_failed : code;
}

}  // namespace
}  // namespace lowlux::cli

int main(int argc, char** argv) { return lowlux::cli::run_process({argv + 1, argv + argc}); }
