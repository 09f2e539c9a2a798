#include <string>
#include <variant>
#include <vector>

#include <fmt/format.h>

#include "isp/cli/compare/compare_args.h"
#include "isp/cli/compare/compare_work.h"
#include "isp/cli/shared/exit_code.h"
#include "isp/cli/shared/lines.h"
#include "isp/cli/shared/report.h"
#include "isp/cli/verbs.h"

namespace lowlux::cli {
int run_compare(const std::vector<std::string>& words) {
  const Parsed<CompareArgs> parsed = parse_compare(words);
  if (const int* code = std::get_if<int>(&parsed)) return *code;
  const auto& args = std::get<CompareArgs>(parsed);
  const Result<CompareOutcome> done = compare_files(args);
  if (!done) return print_failure(done.error(), object_if(args.json));
  for (const std::string& warning : done->warnings) {
    print_err(fmt::format("{}\n", one_line("lowlux compare: warning: " + warning)));
  }
  if (args.json) {
    print_out(fmt::format("{}\n", compare_json(args, *done)));
  } else {
    print_out(fmt::format("{} against {}\n{}", one_line(args.test), one_line(args.reference), compare_text(*done)));
  }
  return exit_done;
}

}  // namespace lowlux::cli
