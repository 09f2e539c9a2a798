// Command lines from arbitrary text, a word on each line, the verb first: options, or an exit code that says why not.
#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <sstream>
#include <string>
#include <string_view>
#include <vector>

#ifdef LOWLUX_WITH_MEASUREMENT
#include "isp/cli/bench/bench_args.h"
#endif
#include "isp/cli/calibrate/calibrate_args.h"
#include "isp/cli/capture/capture_args.h"
#include "isp/cli/compare/compare_args.h"
#include "isp/cli/dataset/dataset_args.h"
#include "isp/cli/develop/develop_args.h"
#include "isp/cli/finished/resaturate_args.h"
#include "isp/cli/finished/retarget_args.h"
#include "isp/cli/shared/exit_code.h"
#include "isp/cli/shared/outputs.h"
#include "isp/cli/simulate/simulate_args.h"
#include "tests/fuzz/input.h"

namespace lowlux::cli {
namespace {

using Words = std::vector<std::string>;

bool asks_for_help(const Words& words) {
  // Short options may be run together.
  return std::ranges::any_of(words, [](const std::string& word) { return word == "--help" || word.starts_with("-"); });
}

template <auto parse>
void parsed(const Words& words) {
  const auto outcome = parse(words);
  const int* const code = std::get_if<int>(&outcome);
  test::require(code == nullptr || *code == exit_usage || (*code == exit_done && asks_for_help(words)));
}

Parsed<DevelopArgs> parsed_develop(const Words& words) { return parse_develop(words, options_contradict); }

struct Verb {
  std::string_view name;
  void (*parsed)(const Words& words);
};

constexpr std::array verbs{
#ifdef LOWLUX_WITH_MEASUREMENT
    Verb{"bench", parsed<parse_bench>},
#endif
    Verb{"calibrate black", parsed<parse_calibrate_black>},
    Verb{"calibrate colour", parsed<parse_calibrate_colour>},
    Verb{"calibrate noise", parsed<parse_calibrate_noise>},
    Verb{"calibrate sheet", parsed<parse_calibrate_sheet>},
    Verb{"calibrate quoted", parsed<parse_calibrate_quoted>},
    Verb{"capture", parsed<parse_capture>},
    Verb{"compare", parsed<parse_compare>},
    Verb{"dataset", parsed<parse_dataset>},
    Verb{"denoise", parsed<parse_denoise>},
    Verb{"develop", parsed<parsed_develop>},
    Verb{"info", parsed<parse_info>},
    Verb{"merge", parsed<parse_merge>},
    Verb{"reproduce", parsed<parse_reproduce>},
    Verb{"resaturate", parsed<parse_resaturate>},
    Verb{"retarget", parsed<parse_retarget>},
    Verb{"simulate", parsed<parse_simulate>},
};

}  // namespace
}  // namespace lowlux::cli

LOWLUX_FUZZ_TARGET(command_line)(const std::uint8_t* data, std::size_t size) {
  std::istringstream lines(std::string(reinterpret_cast<const char*>(data), size));
  std::string name, word;
  std::getline(lines, name);
  const auto* const verb = std::ranges::find(lowlux::cli::verbs, name, &lowlux::cli::Verb::name);
  if (verb == lowlux::cli::verbs.end()) return -1;  // not for the corpus
  lowlux::cli::Words words;
  while (std::getline(lines, word)) words.push_back(word);
  verb->parsed(words);
  return 0;
}
