#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "isp/base/shard.h"
#include "isp/cli/develop/develop_args.h"
#include "isp/reproduce/bench_picture.h"

namespace lowlux::cli {

/// Holds the arguments of `bench`.
struct BenchArgs {
  std::vector<std::string> stages;  // by id; empty: all
  std::string output;               // folder for table, plots, images and the page; empty: none
  std::string pictures_folder;      // empty: next to the command
  isp::PictureSet pictures = isp::PictureSet::held_out;
  std::vector<std::string> methods;  // NAME=COMMAND, or the name of a ready one
  std::uint64_t seed = 1;            // seed of the stage `methods`
  double time_limit_s = 120;         // time limit of one run of a method
  Shard shard;                       // shard of the stages; of the lights of `methods` if that is the only one
  int threads = 0;                   // 0: one for each processor
  bool list = false;
  bool calibrate_cost = false;  // then nothing else is run
  bool quick = false;
  bool json = false;
  bool force = false;
};

Parsed<BenchArgs> parse_bench(const std::vector<std::string>& words);

}  // namespace lowlux::cli
