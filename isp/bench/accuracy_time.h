#pragma once

#include <functional>
#include <limits>
#include <span>
#include <string>
#include <vector>

#include "isp/bench/bench_stages.h"

/// Accuracy against time of the levels of one stage: how it is measured, and how it is told.
namespace lowlux::isp {

/// One way of doing a stage's work.
struct AccuracyLevel {
  std::string name;
  double error = 0;           // against the group's reference or truth; 0 is that itself
  std::function<void()> run;  // one round of the work, on the calling thread unless it has an executor of its own
  double megapixels = 0;      // or millions of samples, of one round; > 0
  double largest = std::numeric_limits<double>::quiet_NaN();  // where `error` is a mean: the largest; else not a number
};

/// Ways of doing the same work on the same input: they compete.
struct AccuracyGroup {
  std::string name;      // "20 e-"
  std::string error_of;  // "mean CIEDE2000 against the truth": what the errors are, with their unit
  std::vector<AccuracyLevel> levels;
};

/// A level as measured.
struct AccuracyRow {
  std::string group;
  std::string error_of;
  std::string level;
  double error = 0;
  double ms_per_mp = 0;  // median of the rounds
  /// Half the distance of the quartiles, over the median; not a number of one round.
  double spread = std::numeric_limits<double>::quiet_NaN();
  double times_memcpy = 0;   // of the time that copying 4 bytes for each pixel takes in the same round, 16 MP at most
  bool undominated = false;  // no other level of the group is faster and as good, or better and as fast
  double largest = std::numeric_limits<double>::quiet_NaN();
};

/// How levels are timed.
struct AccuracyTiming {
  int rounds = 7;           // of which each runs memcpy, then every level once, in turn
  double least_s = 0;       // a level is repeated within a round until it took so long
  bool wall_clock = false;  // else the CPU time of the calling thread
};

/// Times every level of a group, all in turn, after one round that does not count.
std::vector<AccuracyRow> measure(const AccuracyGroup& group, const AccuracyTiming& timing);

/// Sets `undominated` of the rows, group by group.
void mark_undominated(std::span<AccuracyRow> rows);

/// The rows as a table, a line each.
BenchTable accuracy_table(std::span<const AccuracyRow> rows);

/// Error against time, one plot for each group: levels as points, the undominated joined by a line and named.
/// @param stage  begins the plots' ids
std::vector<Plot> accuracy_plots(const std::string& stage, std::span<const AccuracyRow> rows);

/// Rows as an outcome: table, plots, and how the times were taken.
BenchOutcome accuracy_outcome(const std::string& stage, std::span<const AccuracyRow> rows, const AccuracyTiming& timing,
                              int threads);

/// How the times were taken: rounds, clock, threads, the kernels' vector instructions. One line.
std::string timing_remark(const AccuracyTiming& timing, int threads);

}  // namespace lowlux::isp
