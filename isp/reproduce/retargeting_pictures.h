#pragma once

#include <cstddef>
#include <functional>
#include <string>
#include <string_view>
#include <vector>

#include "isp/base/executor.h"
#include "isp/base/matrix3.h"
#include "isp/base/result.h"
#include "isp/model/appearance/shin.h"
#include "isp/render/retarget/retarget.h"
#include "isp/render/retarget/retarget_table.h"

namespace lowlux::isp {

/// Colours of a picture: sRGB code values 0..1 of pixels that are evenly spread over it.
struct PictureColours {
  std::string name;  // of the file
  std::vector<Vector3> codes;
};

/// How much of a picture is looked at.
struct Sampling {
  int crop_px = 0;              // side of the square in the middle; 0: the whole picture
  std::size_t colours = 60000;  // every n-th pixel of every n-th row, the smallest n that gives no more; > 0
};

/// All eight pictures of testdata/pictures as read_bench_picture() has them. Error: not_found, one for the folder;
/// those of reading.
Result<std::vector<PictureColours>> retargeting_pictures(const std::string& folder, const Sampling& sampling,
                                                         Executor& executor);

/// Which model says how alike two pictures look, and with which unit Shin's coefficients are looked up.
struct Judge {
  std::string_view model;
  ShinUnits units = ShinUnits::luminance_as_is;
};

/// A picture made for a display, as the judge sees it, against the original under the source's white.
struct RetargetScore {
  double delta_e_94c = 0;    // mean, of chromaticities alone
  double gamut_percent = 0;  // effective gamut ratio
};

/// What is shown where: the original at one luminance of white, what `shown` makes of its codes at another.
struct Showing {
  double source_cd_m2 = 250;
  double display_cd_m2 = 2;
  const RetargetTable* shown = nullptr;  // borrowed
};

/// One score for each picture.
/// Errors: those of finding and applying the judge's model.
Result<std::vector<RetargetScore>> retarget_scores(const std::vector<PictureColours>& pictures, const Showing& showing,
                                                   const Judge& judge, Executor& executor);

}  // namespace lowlux::isp
