#pragma once

#include <chrono>

#include "isp/cli/develop/develop_args.h"
#include "isp/cli/shared/report.h"

namespace lowlux::cli {

/// Prints the error, the warnings and what is asked for of one file.
void print_outcome(const DevelopArgs& args, const DevelopOutcome& outcome);

/// Prints which defaults of the user's file are used, with --explain.
void print_defaults(const DevelopArgs& args);

/// Holds how many files a batch has, and what became of them.
struct BatchCounts {
  int files = 0;
  int done = 0;
  int skipped = 0;
  int failed = 0;
};

/// Prints on stderr what became of the files, for a batch of several: "lowlux: 12 of 12 files written to out/, 4.1 s".
void print_counts(const DevelopArgs& args, const BatchCounts& counts, std::chrono::duration<double> took);

}  // namespace lowlux::cli
