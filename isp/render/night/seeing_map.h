#pragma once

#include <array>

#include "isp/base/executor.h"
#include "isp/base/image.h"
#include "isp/base/plane.h"
#include "isp/render/night/look_parameters.h"

namespace lowlux::isp {

/// Writes for each cell the probability that a patch with the mean light of the cell is seen by a dark-adapted eye:
/// probability_of_seeing() (isp/model/vision/detection.h) of its photopic and scotopic luminance, with the pupil of the
/// scene's mean. It depends on the light alone, not on the size of the cell, on contrast or on neighbours.
/// @param camera  means of 4 x 4 pixels of camera RGB (RawToRgb::quarter), matrix and clip as in NightLookGrid::make
/// @param probability  one value for each cell, 0..1
/// @return the fraction of cells that are seen with more than 0.5
double map_seeing(const RgbView<const float>& camera, const std::array<float, 9>& matrix, float clip,
                  const NightLook& look, const PlaneView<float>& probability, Executor& executor);

}  // namespace lowlux::isp
