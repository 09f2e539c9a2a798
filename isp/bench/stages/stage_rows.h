#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "isp/bench/accuracy_time.h"
#include "isp/bench/bench_stages.h"

/// Rows of a stage that report more than an error and a time.
namespace lowlux::isp {

/// Unit of work of a level's time: a megapixel, or the entire work where levels differ in how much they read. In the
/// latter case AccuracyLevel::megapixels is 1 for all.
enum class TimeOf : std::uint8_t { megapixel, whole };

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
