#include "isp/cli/shared/standard_streams.h"

#include <unistd.h>

#include <algorithm>

#include "capture/file/dng_source.h"
#include "capture/file/file_bytes.h"
#include "isp/cli/develop/develop_args.h"

namespace lowlux::cli {

Result<RawFrame> read_standard_input(const capture::XTransUse& use) {
  const capture::ReadLimits limits;
  const std::string name = "standard input";
  const auto bytes = capture::read_stream_bytes(STDIN_FILENO, limits.max_file_bytes);
  if (!bytes) return fail(bytes.error().code, bytes.error().message, name);
  return capture::read_raw(*bytes, name, limits, use);
}

std::optional<std::string> stream_error(const DevelopArgs& args) {
  const auto streams = std::ranges::count_if(args.inputs, is_standard_stream);
  if (streams > 1) return "-: standard input is given twice";
  if (!is_standard_stream(args.output)) return std::nullopt;
  if (args.json || args.explain || args.timings) {
    return "-o -: standard output is the file: leave out --json, --explain and --timings";
  }
  if (args.options.denoise.maps || args.options.look.seeing_map) {
    return "-o -: maps need the name of a file";
  }
  if (isatty(STDOUT_FILENO) != 0) return "-o -: standard output is a terminal: send it to a file or a program";
  return std::nullopt;
}

}  // namespace lowlux::cli
