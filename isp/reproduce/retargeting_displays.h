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

/// White of the display the pictures are right for.
inline constexpr double retargeting_source_cd_m2 = 250;

/// The methods compared, in the order of plots.
inline constexpr std::array retargeting_rows{RetargetMethod::none,   RetargetMethod::shin,
                                             RetargetMethod::cao,    RetargetMethod::wanat,
                                             RetargetMethod::icam06, RetargetMethod::constrained};

using PictureScores = std::vector<RetargetScore>;  // one for each picture, at least one

double mean_delta_e(const PictureScores& scores);
double mean_gamut(const PictureScores& scores);

/// Methods on one display, judged by Shin's model.
struct DisplayScores {
  double display_cd_m2 = 0;
  ShinUnits units = ShinUnits::luminance_as_is;
  struct Row {
    RetargetMethod method;
    RetargetTable table;
    PictureScores scores;
  };
  std::vector<Row> rows;

  /// Of a method that was asked for.
  const Row& row(RetargetMethod method) const;
  const PictureScores& of(RetargetMethod method) const { return row(method).scores; }
};

/// What all measurements share; borrowed.
struct RetargetingWork {
  const std::vector<PictureColours>& pictures;
  int table_levels;  // of the tables that stand for the methods
  const RunOptions& options;
  Executor& executor;
};

/// Errors: those of retargeting() and retarget_scores().
Result<DisplayScores> scores_on(double display_cd_m2, ShinUnits units, std::span<const RetargetMethod> which,
                                const RetargetingWork& work);

/// Coefficients, judge, colours and tables, in a line.
std::string measured_how(const RetargetingWork& work);

/// Means over all displays, and the pictures of one; all with all of retargeting_rows.
std::vector<Plot> plots_of_retargeting(std::span<const DisplayScores> all, const DisplayScores& one,
                                       const RetargetingWork& work);

}  // namespace lowlux::isp
