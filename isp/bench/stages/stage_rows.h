#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "isp/bench/accuracy_time.h"
#include "isp/bench/bench_stages.h"

/// Rows of a stage that have more to tell than an error and a time.
namespace lowlux::isp {

/// What a level's time is of: of a megapixel, or of the whole work where levels differ in how much they read. Then
/// AccuracyLevel::megapixels is 1 for all.
enum class TimeOf : std::uint8_t { megapixel, whole };

struct StageRows {
  std::vector<std::string> further;          // columns, with their units
  std::vector<AccuracyRow> rows;             // levels, group by group
  std::vector<std::vector<double>> figures;  // of each row, as many as `further`; not finite where there is none

  /// Measures a group. @param figures_of  each of its levels
  void add(const AccuracyGroup& group, std::vector<std::vector<double>> figures_of, const AccuracyTiming& timing);
};

/// Table and plots. @param stage  begins the plots' ids
BenchOutcome outcome_of(const std::string& stage, const StageRows& rows, TimeOf time_of);

/// A finding of ours, with what is expected and what was found.
Finding check_of(std::string id, std::string claim, std::string expected, std::string found, bool holds);

}  // namespace lowlux::isp
