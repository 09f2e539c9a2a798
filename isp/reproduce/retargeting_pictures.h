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

/// Colours of an image: sRGB code values 0..1 of pixels that are evenly spread over it.
struct PictureColours {
  std::string name;  // of the file
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

}  // namespace lowlux::isp
