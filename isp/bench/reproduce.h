#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "isp/base/result.h"
#include "isp/output/report.h"

namespace lowlux::isp {

/// One published finding beside ours.
struct Finding {
  std::string id;         // EXPERIMENT/what
  std::string claim;      // what was published, with its figure, equation or section
  std::string published;  // the figure in it; "-" where the claim has none
  std::string ours;       // the same quantity, computed
  bool holds = false;
  std::string note;  // how it was computed; why it does not hold
};

/// What one experiment yields.
struct Outcome {
  std::vector<Finding> findings;
  std::vector<Plot> plots;
};

struct RunOptions {
  std::uint64_t seed = 1;
  bool quick = false;  // fewer samples: the same findings with wider confidence intervals
};

/// A published experiment: its result depends on the options only. Errors: what it computes cannot be computed.
struct Experiment {
  std::string_view id;
  std::string_view title;
  Result<Outcome> (*run)(const RunOptions& options);
};

/// All of them, in the order of the thesis.
std::span<const Experiment> experiments();

/// The experiment of an id. Error: there is none; the message names near ones.
Result<Experiment> experiment_named(std::string_view id);

/// Findings as a table: finding, claim, published, ours, holds, note.
Table table_of(std::span<const Finding> findings);

/// "holds" or "does not hold".
std::string_view verdict_of(const Finding& finding);

}  // namespace lowlux::isp
