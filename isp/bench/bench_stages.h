#pragma once

#include <functional>
#include <span>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "isp/base/image.h"
#include "isp/base/result.h"
#include "isp/bench/peers/nl_means.h"
#include "isp/reproduce/bench_picture.h"
#include "isp/output/report/report.h"
#include "isp/reproduce/reproduce.h"

namespace lowlux::isp {

/// Text or a figure; one that is not finite is one that there is not.
using BenchCell = std::variant<std::string, double>;

/// What was measured, a line for each row; columns carry their units.
struct BenchTable {
  std::vector<std::string> columns;
  std::vector<std::vector<BenchCell>> rows;  // each as long as columns
};

/// A picture for the report, beside the table.
struct BenchImage {
  std::string id;  // letters, digits and -: it names the file
  Encoded8 codes;  // sRGB
};

/// Two of the pictures, of the same size, to be laid over each other.
struct BenchComparison {
  std::string title;
  std::string before_id;
  std::string before_label;
  std::string after_id;
  std::string after_label;
};

/// What one stage yields.
struct BenchOutcome {
  BenchTable table;
  std::vector<Finding> findings;  // what the stage must show, beside what it shows
  std::vector<Plot> plots;
  std::vector<BenchImage> images;
  std::vector<std::string> remarks;  // how it was measured, and what was left out; one line each
  std::vector<BenchComparison> comparisons = {};
  int threads = 1;  // that did what was timed, where the table has no such column
};

struct BenchOptions {
  std::string pictures_folder;  // that of testdata/pictures
  PictureSet pictures = PictureSet::held_out;
  bool quick = false;                                                  // parts of two pictures in two lights
  int threads = 1;                                                     // for all but what is timed
  const NlMeans* nl_means = nullptr;                                   // the other method; absent: its row is left out
  std::string why_no_nl_means;                                         // then
  std::function<void(double share, const std::string& what)> advance;  // another share of the whole is done; any thread
};

/// A stage of the pipeline whose accuracy and time are measured.
struct BenchStage {
  std::string_view id;
  std::string_view title;
  Result<BenchOutcome> (*run)(const BenchOptions& options);
};

/// All of them.
std::span<const BenchStage> bench_stages();

/// The stage of an id. Error: there is none; the message names those there are.
Result<BenchStage> bench_stage_named(std::string_view id);

/// The table with figures as text of so many significant digits, empty where there is none.
Table table_of(const BenchTable& table, int digits);

}  // namespace lowlux::isp
