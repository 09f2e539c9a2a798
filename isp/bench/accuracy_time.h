#pragma once

#include <cstdint>
#include <functional>
#include <limits>
#include <span>
#include <string>
#include <vector>

#include "isp/bench/bench_stages.h"

/// Measures and reports accuracy against time for the levels of one stage.
namespace lowlux::isp {

/// One way of doing a stage's work.
struct AccuracyLevel {
  std::string name;
  double error = 0;           // against the group's reference or truth; 0 is the reference itself
  std::function<void()> run;  // one round of the work, on the calling thread unless it has an executor of its own
  double megapixels = 0;      // megapixels, or millions of samples, of one round; > 0
  double largest = std::numeric_limits<double>::quiet_NaN();  // maximum where `error` is a mean; else not a number
};

/// Groups ways of doing the same work on the same input, which are compared with each other.
struct AccuracyGroup {
  std::string name;      // "20 e-"
  std::string error_of;  // "mean CIEDE2000 against the truth": definition of the errors, with their unit
  std::vector<AccuracyLevel> levels;
};

/// One level with its measured results.
struct AccuracyRow {
  std::string group;
  std::string error_of;
  std::string level;
  double error = 0;
  double ms_per_mp = 0;  // median of the rounds
  /// Half the distance of the quartiles, over the median; not a number for one round.
  double spread = std::numeric_limits<double>::quiet_NaN();
  double times_memcpy = 0;   // ratio to the time of copying 4 bytes for each pixel in the same round, 16 MP at most
  bool undominated = false;  // Pareto-optimal in the group: no other level is faster and as good, or better and as fast
  double largest = std::numeric_limits<double>::quiet_NaN();
};

/// Parameters of timing the levels.
struct AccuracyTiming {
  int rounds = 7;           // number of rounds, each of which runs memcpy, then every level once
  double min_s = 0;         // a level is repeated within a round for at least this time
  bool wall_clock = false;  // false: the CPU time of the calling thread
};

/// Times every level of a group, all in turn, after one round that does not count.
std::vector<AccuracyRow> measure(const AccuracyGroup& group, const AccuracyTiming& timing);

/// Sets `undominated` of the rows, group by group.
void mark_undominated(std::span<AccuracyRow> rows);

/// Returns a table of the rows, one line each.
BenchTable accuracy_table(std::span<const AccuracyRow> rows);

/// Plots error against time, one plot for each group: levels as points, the Pareto-optimal ones joined by a line and
/// named.
/// @param stage  prefix of the plots' ids
std::vector<Plot> accuracy_plots(const std::string& stage, std::span<const AccuracyRow> rows);

/// Returns rows as an outcome: table, plots, and a remark on the timing.
BenchOutcome accuracy_outcome(const std::string& stage, std::span<const AccuracyRow> rows, const AccuracyTiming& timing,
                              int threads);

/// Describes the timing in one line: rounds, clock, threads, the kernels' vector instructions.
std::string timing_remark(const AccuracyTiming& timing, int threads);

/// Unit of work of a level's time: a megapixel, or the entire work where levels differ in how much they read. In the
/// latter case AccuracyLevel::megapixels is 1 for all.
enum class TimeOf : std::uint8_t { megapixel, whole };

/// Holds rows of a stage that report more than an error and a time.
struct StageRows {
  std::vector<std::string> further;          // names of added columns, with their units
  std::vector<AccuracyRow> rows;             // levels, group by group
  std::vector<std::vector<double>> figures;  // by row, as many as `further`; not finite where missing

  /// Measures a group. @param figures_of  values of each of its levels
  void add(const AccuracyGroup& group, std::vector<std::vector<double>> figures_of, const AccuracyTiming& timing);
};

/// Returns table and plots. @param stage  prefix of the plots' ids
BenchOutcome outcome_of(const std::string& stage, const StageRows& rows, TimeOf time_of);

/// Returns a check by this project, with the expected and the found value.
Finding check_of(std::string id, std::string claim, std::string expected, std::string found, bool holds);

}  // namespace lowlux::isp
