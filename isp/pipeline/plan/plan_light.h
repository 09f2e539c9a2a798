#pragma once

#include <optional>
#include <span>

#include "isp/base/frame.h"
#include "isp/base/matrix3.h"
#include "isp/base/result.h"
#include "isp/model/colour/camera_colour.h"
#include "isp/pipeline/options.h"
#include "isp/pipeline/plan/look.h"

namespace lowlux::isp {

/// Holds what a look is decided by: the light of a frame, and how it would be rendered without the look.
struct FrameLight {
  std::span<const float> block_luminance;  // white balanced, 1 at the white level, signed
  double black_noise_std = 0;              // of one pixel, same unit
  std::optional<WhitePoint> white;         // absent without a colour calibration
  double exposure_ev = 0;
  Matrix3 balanced = identity3();  // result of balanced_to_output()
  double headroom_ev = 0;          // by which the tone curve's range is extended
};

// Steps of plan_look() that concern the light of the scene, in this order.

/// Decides S/P of the white, stated or estimated from its chromaticity, and what the rods' luminance follows from.
void decide_light(const RawFrame& frame, const FrameLight& light, const LookChoice& choice, LookPlan& plan);

/// Decides the degree of chromatic adaptation, and the matrix for it; needs plan.mean_cd_m2. The colours of a
/// monochrome frame are unknown: nothing is changed. Error: invalid_argument where CAT02 has no such adaptation.
Result<void> decide_adaptation(const FrameLight& light, const DevelopOptions& options, LookPlan& plan);

/// Sets the weights of luminance, of scotopic luminance relative to white, and the rods' tint, in the primaries of the
/// pixels. @param balanced  result of balanced_to_output()
void set_primaries(OutputSpace space, const Matrix3& balanced, LookPlan& plan);

}  // namespace lowlux::isp
