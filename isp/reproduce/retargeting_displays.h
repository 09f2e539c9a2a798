#pragma once

#include <array>
#include <span>
#include <string>
#include <vector>

#include "isp/base/executor.h"
#include "isp/base/result.h"
#include "isp/render/retarget/retarget.h"
#include "isp/reproduce/reproduce.h"
#include "isp/reproduce/retargeting_pictures.h"

namespace lowlux::isp {

/// White of the display for which the images are correct.
inline constexpr double retargeting_source_cd_m2 = 250;

/// The compared methods are listed in the order of plots.
inline constexpr std::array retargeting_rows{RetargetMethod::none,   RetargetMethod::shin,
                                             RetargetMethod::cao,    RetargetMethod::wanat,
                                             RetargetMethod::icam06, RetargetMethod::constrained};

using PictureScores = std::vector<RetargetScore>;  // one for each image, at least one

double mean_delta_e(const PictureScores& scores);
double mean_gamut(const PictureScores& scores);

/// Scores of methods on one display, judged by Shin's model.
struct DisplayScores {
  double display_cd_m2 = 0;
  ShinUnits units = ShinUnits::luminance_as_is;
  struct Row {
    RetargetMethod method;
    RetargetTable table;
    PictureScores scores;
  };
  std::vector<Row> rows;

  /// Returns the row of a method that was requested.
  const Row& row(RetargetMethod method) const;
  const PictureScores& of(RetargetMethod method) const { return row(method).scores; }
};

/// Inputs that all measurements have in common; borrowed.
struct RetargetingWork {
  const std::vector<PictureColours>& pictures;
  int table_levels;  // of the tables that represent the methods
  const RunOptions& options;
  Executor& executor;
};

/// Computes the scores of methods on one display. Errors: those of retargeting() and retarget_scores().
Result<DisplayScores> scores_on(double display_cd_m2, ShinUnits units, std::span<const RetargetMethod> which,
                                const RetargetingWork& work);

/// Describes coefficients, judge, colours and tables, in one line.
std::string measured_how(const RetargetingWork& work);

/// Plots means over all displays, and the images of one display; all with all of retargeting_rows.
std::vector<Plot> plots_of_retargeting(std::span<const DisplayScores> all, const DisplayScores& one,
                                       const RetargetingWork& work);

}  // namespace lowlux::isp
