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
                 "program to score: NAME='PROGRAM {in} {out}', or a known one such as dcraw; repeatable")
      ->type_name("NAME[=COMMAND]")
      ->allow_extra_args(false);
  add_seed(app, "--seed", "seed of the scenes and noise of the stage methods (default: 1)", args.seed);
  add_number_within(app, "--time-limit", "S",
                    "time limit for each frame and program of the stage methods [s] (default: 120)", 0.1, 86400,
                    args.time_limit_s);
  CLI::Option* const shard = add_shard(
      app,
      "run every N-th stage from the I-th on; of methods, if that is the only one, every N-th light (default 1/1: all)",
      args.shard);
  app.add_flag("--calibrate-cost", args.calibrate_cost,
               "measure the speed of this machine for develop --budget-ms, and store it; 3 to 8 minutes")
      ->excludes("--stage")
      ->excludes("--method")
      ->excludes(shard);
  app.add_flag("--list", args.list, "list the stages");
  app.add_option(
         "-o,--output", args.output,
         "folder, created if necessary, for the page bench.html, STAGE.csv, STAGE.json and parts of pictures (PNG)")
      ->type_name("DIR");
  add_choice<isp::PictureSet>(
      app, "--pictures",
      {{"held-out", isp::PictureSet::held_out}, {"tuning", isp::PictureSet::tuning}, {"all", isp::PictureSet::all}},
      [&args](isp::PictureSet set) { args.pictures = set; },
      "set of clean pictures to use; parameters are chosen on the tuning set (default: held-out)");
  app.add_option("--pictures-folder", args.pictures_folder,
                 "folder of the clean pictures (default: pictures next to the command, as its build makes them)")
      ->type_name("DIR");
  app.add_flag(
      "--quick", args.quick,
      "use parts of two pictures in two lights, as a quick test: less than a minute on two cores, no final figures");
  app.add_option("--threads", args.threads,
                 "number of threads for work that is not timed (default: one for each processor)")
      ->check(CLI::Range(1, 256))
      ->type_name("N");
  app.add_flag("--json", args.json, "print JSON instead of tables");
  app.add_flag("--force", args.force, "overwrite files that exist");
  if (const auto code = parse_words(app, words)) return *code;
  return args;
}

}  // namespace lowlux::cli
