#pragma once

#include <array>
#include <cstddef>
#include <functional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "isp/base/executor.h"
#include "isp/base/matrix3.h"
#include "isp/base/result.h"
#include "isp/model/appearance/shin.h"
#include "isp/render/retarget/retarget.h"
#include "isp/render/retarget/retarget_table.h"
#include "isp/reproduce/reproduce.h"

namespace lowlux::isp {

/// Colours of an image: sRGB code values 0..1 of pixels that are evenly spread over it.
struct PictureColours {
  std::string name;  // name of the file
  std::vector<Vector3> codes;
};

/// Selects the pixels of an image that are evaluated.
struct Sampling {
  int crop_px = 0;              // side of the central square; 0: the entire image
  std::size_t colours = 60000;  // every n-th pixel of every n-th row, the smallest n that gives no more; > 0
};

/// Reads all eight images of testdata/pictures as read_bench_picture() returns them. Errors: not_found, one for the
/// folder; those of reading.
Result<std::vector<PictureColours>> retargeting_pictures(const std::string& folder, const Sampling& sampling,
                                                         Executor& executor);

/// Names the model that judges how alike two images look, and the unit with which Shin's coefficients are looked up.
struct Criterion {
  std::string_view model;
  ShinUnits units = ShinUnits::luminance_as_is;
};

/// Score of an image made for a display, by the judge, against the original under the source's white.
struct RetargetScore {
  double delta_e_94c = 0;    // mean, of chromaticities alone
  double gamut_percent = 0;  // effective gamut ratio
};

/// Viewing of an image: the original at one luminance of white, the result of `shown` for its codes at another.
struct Showing {
  double source_cd_m2 = 250;
  double display_cd_m2 = 2;
  const RetargetTable* shown = nullptr;  // borrowed
};

/// Returns one score for each image.
/// Errors: those of finding and applying the judge's model.
Result<std::vector<RetargetScore>> retarget_scores(const std::vector<PictureColours>& pictures, const Showing& showing,
                                                   const Criterion& judge, Executor& executor);

/// White of the display for which the images are correct.
inline constexpr double retargeting_source_cd_m2 = 250;

/// The compared methods are listed in the order of plots. RetargetMethod::icam06 stands for the forward model here,
/// icam06_forward(), and not for the inverse that `lowlux develop` offers.
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

/// Returns the image that iCAM06 predicts for a display, without compensation: tone compression (Eq. 2.19 to 2.21, p =
/// 0.7) of the light that the display would emit, a white of display_cd_m2 being both the largest luminance and Y_w,
/// and the response shown as light, with gamma = 1, relative to the response to white. The thesis applies iCAM06 so
/// (section 5.4.2: max_L = 2 cd/m2; it predicts and is not designed for compensation). Local contrast is left out.
/// @return map of sRGB codes; white stays white, colours outside of the gamut are clipped
CodeMap icam06_forward(double display_cd_m2);

/// Inputs that all measurements have in common; borrowed.
struct RetargetingWork {
  const std::vector<PictureColours>& pictures;
  int table_levels;  // levels of the tables that represent the methods
  const RunOptions& options;
  Executor& executor;
};

/// Computes the scores of methods on one display. Errors: those of retargeting() and retarget_scores().
Result<DisplayScores> scores_on(double display_cd_m2, ShinUnits units, std::span<const RetargetMethod> which,
                                const RetargetingWork& work);

/// Describes coefficients, judge, colours and tables, in one line.
std::string measurement_method(const RetargetingWork& work);

/// Plots means over all displays, and the images of one display; all with all of retargeting_rows.
std::vector<Plot> plots_of_retargeting(std::span<const DisplayScores> all, const DisplayScores& one,
                                       const RetargetingWork& work);

}  // namespace lowlux::isp
