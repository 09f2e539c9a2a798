#include <cstdio>

#include <fmt/format.h>

#include "capture/file/dng_source.h"
#include "isp/cli/advise.h"
#include "isp/cli/args.h"
#include "isp/cli/exit_code.h"
#include "isp/cli/print.h"
#include "isp/cli/report.h"
#include "isp/cli/verbs.h"

namespace lowlux::cli {

int run_info(const std::vector<std::string>& words) {
  const Parsed<InfoArgs> parsed = parse_info(words);
  if (const int* code = std::get_if<int>(&parsed)) return *code;
  const auto& args = std::get<InfoArgs>(parsed);
  if (args.advise.wanted) return run_advise(args);

  int code = exit_done;
  std::string json;
  for (const std::string& file : args.inputs) {
    const Result<RawFrame> frame = capture::read_raw(file);
    if (!frame) {
      code = exit_failed;
      print_err(fmt::format("{}\n", error_line(file, frame.error())));
    }
    if (args.json) {
      json += (json.empty() ? "" : ",\n") + (frame ? info_json(file, *frame) : error_json(file, frame.error()));
    } else if (frame) {
      print_out(fmt::format("{}", info_text(file, *frame)));
    }
  }
  if (args.json) print_out(fmt::format("[{}]\n", json));
  return code;
}

}  // namespace lowlux::cli
