#pragma once

#include <span>

#include "isp/base/frame.h"
#include "isp/base/matrix3.h"
#include "isp/base/result.h"
#include "isp/pipeline/plan.h"
#include "isp/raw/measure/thumbnail.h"

namespace lowlux::isp {

/// White balance, exposure, look, and what the kernels need of them: sets them in the plan. Errors: those of
/// plan_develop that are about colour, and of plan_look.
Result<void> decide_rendering(const RawFrame& frame, const Thumbnail& thumbnail, DevelopPlan& plan);

// Its steps, none of which allocates but to say what went wrong.

/// A white balance, and its reason among the warnings.
void set_white(DevelopPlan& plan, const WhiteBalance& balance);

/// Standard deviation of the black noise of the mean of a thumbnail's block.
double block_noise_std(const RawDn& raw, const Thumbnail& thumbnail);

/// White-balanced camera RGB -> linear values of the space, white at (1, 1, 1). Needs balance.white, unless the space
/// is camera RGB or the frame monochrome.
Result<Matrix3> balanced_to_output(const RawFrame& frame, const DevelopOptions& options, const WhiteBalance& balance);

/// Luminance of each block as it will be rendered, before exposure.
/// @param balanced  balanced_to_output
/// @param out       one for each block
void rendered_luminance(const CameraRgb& blocks, const DevelopPlan& plan, const Matrix3& balanced,
                        std::span<float> out);

/// The plan's transform for its exposure. Camera RGB is written as it is; everything else is clipped where the first
/// channel saturates: what is clipped is then neutral.
void set_transform(DevelopPlan& plan, const Matrix3& balanced);
/// The plan's tone table for its exposure, where its samples need one.
void set_tone(DevelopPlan& plan);

}  // namespace lowlux::isp
