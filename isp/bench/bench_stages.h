#pragma once

#include <cstdint>
#include <functional>
#include <span>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "isp/base/image.h"
#include "isp/base/result.h"
#include "isp/base/shard.h"
#include "isp/bench/methods/method.h"
#include "isp/bench/peers/nl_means.h"
#include "isp/output/report/report.h"
#include "isp/reproduce/bench_picture.h"
#include "isp/reproduce/reproduce.h"

namespace lowlux::isp {

/// Holds text or a number; a number that is not finite means that the value is missing.
using BenchCell = std::variant<std::string, double>;

/// Table of measurements, a line for each row; columns carry their units.
struct BenchTable {
  std::vector<std::string> columns;
  std::vector<std::vector<BenchCell>> rows;  // each as long as columns
};

/// An image for the report, in addition to the table.
struct BenchImage {
  std::string id;  // letters, digits and -: used as file name
  Encoded8 codes;  // sRGB
};

/// Two of the images, of the same size, to be overlaid for comparison.
struct BenchComparison {
  std::string title;
  std::string before_id;
  std::string before_label;
  std::string after_id;
  std::string after_label;
};

/// A condition of the measurement, by name.
struct BenchSetting {
  std::string name;
  std::string value;
};

/// Holds the results of one stage.
struct BenchOutcome {
  BenchTable table;
  std::vector<Finding> findings;  // checks that the stage must pass, in addition to its results
  std::vector<Plot> plots;
  std::vector<BenchImage> images;
  std::vector<std::string> remarks;  // how it was measured, and what was left out; one line each
  std::vector<BenchComparison> comparisons = {};
  int threads = 1;                          // number used by the timed work, where the table has no such column
  std::vector<BenchSetting> settings = {};  // settings to repeat it, for stages with additional options
  std::vector<Error> failures = {};         // parts of the work that failed, and are left out
};

/// Holds the options of all stages.
struct BenchOptions {
  std::string pictures_folder;  // folder of testdata/pictures
  PictureSet pictures = PictureSet::held_out;
  bool quick = false;                                                  // crops of two images in two lights
  int threads = 1;                                                     // for all work that is not timed
  const NlMeans* nl_means = nullptr;                                   // compared method; absent: its row is left out
  std::string why_no_nl_means;                                         // reason why nl_means is absent
  std::vector<ScoredMethod> methods;                                   // methods of the stage `methods`
  CommandLimits command_limits;                                        // of each run of a method's command
  std::uint64_t seed = 1;                                              // seed of the stage `methods`
  Shard shard;                                                         // shard of the lights of the stage `methods`
  std::function<void(double share, const std::string& what)> advance;  // adds to the fraction done; from any thread
};

/// A stage of the pipeline whose accuracy and time are measured.
struct BenchStage {
  std::string_view id;
  std::string_view title;
  Result<BenchOutcome> (*run)(const BenchOptions& options);
};

/// Returns all stages.
std::span<const BenchStage> bench_stages();

/// Returns the stage of an id. Error: no such stage; the message names the valid ids.
Result<BenchStage> bench_stage_named(std::string_view id);

/// Returns the table with numbers as text of `digits` significant digits, empty where the value is missing.
Table table_of(const BenchTable& table, int digits);

}  // namespace lowlux::isp
