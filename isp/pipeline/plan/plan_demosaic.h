#pragma once

#include <optional>
#include <string_view>
#include <vector>

#include "isp/base/frame.h"
#include "isp/pipeline/noise_reduction.h"
#include "isp/pipeline/plan/levels.h"
#include "isp/pipeline/plan/rendering.h"
#include "isp/raw/kernel/demosaic.h"
#include "isp/raw/measure/thumbnail.h"

namespace lowlux::isp {

/// Holds the decision on how missing colours are interpolated.
struct DemosaicPlan {
  Demosaic demosaic;
  std::string_view reason;  // empty: nothing is interpolated
};

/// Holds what the interpolation is decided by.
struct DemosaicRequest {
  std::optional<DemosaicMethod> method;                         // given; absent: chosen
  DemosaicMethod max_method = DemosaicMethod::residual_median;  // most expensive method that fits into the time
  std::optional<double> signal_e;  // signal of a green pixel in the median block; absent: not known
};

/// Decides how missing colours are interpolated: with medians of the colour differences where a green pixel of the
/// median block has less than 100 e-, which is better there on most scenes, but not on texture with weakly
/// correlated colours (CIEDE2000 at 20 e-: 9.18 with medians, 8.96 without, behind a lens; 17.88 and 17.71 without a
/// lens); by linear filters where noise is not reduced and it has less than 50 e-, because the mean of encoded noise is
/// biased.
DemosaicPlan plan_demosaic(const RawFrame& frame, const RawLevels& levels, const Rendering& rendering,
                           const NoiseReduction& noise, const DemosaicRequest& request);

/// Returns the median over the blocks of a thumbnail of the signal of a green pixel [e-]; absent where the gain is not
/// known.
/// @param light   dark charge subtracted
/// @param memory  grows to one value for each block
std::optional<double> median_green_e(const RawFrame& frame, const RawLevels& levels, const Thumbnail& light,
                                     std::vector<float>& memory);

}  // namespace lowlux::isp
