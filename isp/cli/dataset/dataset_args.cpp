#include "isp/cli/dataset/dataset_args.h"

#include <CLI/CLI.hpp>

#include "isp/cli/shared/option_values.h"

namespace lowlux::cli {
Parsed<DatasetArgs> parse_dataset(const std::vector<std::string>& words) {
  CLI::App app(
      "Make a data set of simulated raw files: scenes, sensors and settings drawn from distributions. Each sample is a "
      "raw file, its noise-free truth, a mask and its parameters. A run that ended early continues if it is repeated.",
      "lowlux dataset");
  DatasetArgs args;
  app.add_option("SPEC", args.spec, "description of the data set: a JSON file, see docs/using.md")->required();
  app.add_option("-o,--output", args.output, "folder of the samples")->type_name("DIR");
  add_shard(app, "make every N-th sample from the I-th on (default 1/1: all)", args.shard);
  app.add_flag("--dry-run", args.dry_run, "predict bytes and time from up to 8 samples; write nothing to DIR");
  app.add_flag("--force", args.force, "replace samples of another spec or version in DIR");
  app.add_flag("--json", args.json, "print one JSON object on stdout");
  app.add_flag("--quiet", args.quiet, "print no warnings and no progress");
  if (const auto code = parse_arguments(app, words)) return *code;
  if (args.output.empty() && !args.dry_run) return refuse(app, "-o is required: the folder of the samples");
  return args;
}

}  // namespace lowlux::cli
