#include "isp/cli/bench/bench_args.h"

#include <CLI/CLI.hpp>

#include "isp/cli/shared/option_values.h"

namespace lowlux::cli {

Parsed<BenchArgs> parse_bench(const std::vector<std::string>& words) {
  CLI::App app(
      "Measures accuracy against time: each stage at each of its levels, compared with other methods. All stages "
      "together take less than 15 minutes on two cores, with --quick less than one; the time is printed at the end.",
      "lowlux bench");
  BenchArgs args;
  app.add_option("--stage", args.stages, "stages to measure (default: all); --list names them")
      ->type_name("ID[,ID...]")
      ->delimiter(',')
      ->allow_extra_args(false);
  app.add_option("--method", args.methods,
                 "program to score: NAME='PROGRAM {in} {out}', or a known name such as dcraw; repeatable")
      ->type_name("NAME[=COMMAND]")
      ->allow_extra_args(false);
  add_seed(app, "--seed", "seed of the scenes and the noise of the stage methods (default: 1)", args.seed);
  add_text(app, "--time-limit", "S",
           "time limit in seconds for each frame and program of the stage methods (default: 120)",
           store_within({0.1, 86400, "s"}, args.time_limit_s));
  CLI::Option* const shard = add_shard(
      app, "run every N-th stage, starting with the I-th; with --method every N-th light level (default 1/1: all)",
      args.shard);
  app.add_flag("--calibrate-cost", args.calibrate_cost,
               "measure and store the speed of this machine for --budget-ms; takes 3 to 8 minutes")
      ->excludes("--stage")
      ->excludes("--method")
      ->excludes(shard);
  app.add_flag("--list", args.list, "list the stages");
  app.add_option("-o,--output", args.output,
                 "folder for bench.html, STAGE.csv, STAGE.json and crops of images; created if necessary")
      ->type_name("DIR");
  add_choice<isp::PictureSet>(
      app, "--pictures",
      {{"held-out", isp::PictureSet::held_out}, {"tuning", isp::PictureSet::tuning}, {"all", isp::PictureSet::all}},
      [&args](isp::PictureSet set) { args.pictures = set; },
      "set of clean images; the parameters of lowlux were chosen on the tuning set (default: held-out)");
  app.add_option("--pictures-folder", args.pictures_folder,
                 "folder with the clean images (default: the folder pictures next to the command)")
      ->type_name("DIR");
  app.add_flag("--quick", args.quick,
               "quick test on crops of two images at two light levels, in less than a minute on two cores");
  app.add_option("--threads", args.threads, "number of threads for work that is not timed (default: one per processor)")
      ->check(CLI::Range(1, 256))
      ->type_name("N");
  app.add_flag("--json", args.json, "print JSON instead of tables");
  app.add_flag("--force", args.force, "overwrite files that exist");
  if (const auto code = parse_arguments(app, words)) return *code;
  return args;
}

}  // namespace lowlux::cli
