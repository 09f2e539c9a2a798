#pragma once

#include <array>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "isp/base/frame.h"
#include "isp/base/matrix3.h"
#include "isp/base/result.h"
#include "isp/base/tone_table.h"
#include "isp/model/colour/camera_colour.h"
#include "isp/pipeline/options.h"
#include "isp/pipeline/plan/look.h"
#include "isp/raw/kernel/raw_to_rgb.h"
#include "isp/raw/measure/thumbnail.h"
#include "isp/render/white_balance.h"

namespace lowlux::isp {

/// White balance, exposure, look, and what the kernels need of them.
struct Rendering {
  Vector3 neutral{1, 1, 1};         // camera RGB of white, largest 1
  std::optional<WhitePoint> white;  // absent without a colour calibration
  std::string_view white_balance_rule;
  std::array<float, 3> white_gain{1, 1, 1};
  double exposure_ev = 0;
  std::string_view exposure_rule;
  std::optional<LookPlan> look;  // absent: as the camera has it
  RgbTransform transform;
  ToneTable tone;
  std::vector<std::string> warnings;
};

/// Decides white balance, exposure and look by the light of a thumbnail, its dark charge subtracted. Errors: those of
/// plan_develop that are about colour, and of plan_look.
Result<Rendering> decide_rendering(const RawFrame& frame, const Thumbnail& light, const DevelopOptions& options);

// Its steps, none of which allocates but to say what went wrong.

/// Factors of R, G and B that make a neutral equal in all channels, its largest channel's 1.
std::array<float, 3> white_gain_of(const Vector3& neutral);

/// Standard deviation of the black noise of the mean of a thumbnail's block.
double block_noise_std(const RawDn& raw, const Thumbnail& thumbnail);

/// White-balanced camera RGB -> linear values of the space, white at (1, 1, 1). Needs balance.white, unless the space
/// is camera RGB or the frame monochrome.
Result<Matrix3> balanced_to_output(const RawFrame& frame, const DevelopOptions& options, const WhiteBalance& balance);

/// Luminance of each block as it will be rendered, before exposure.
/// @param balanced  balanced_to_output
/// @param out       one for each block
void rendered_luminance(const CameraRgb& blocks, OutputSpace space, const std::array<float, 3>& white_gain,
                        const Matrix3& balanced, std::span<float> out);

/// The kernels' transform for an exposure. Camera RGB is written as it is; everything else is clipped where the first
/// channel saturates: what is clipped is then neutral.
RgbTransform transform_of(const Matrix3& balanced, double exposure_ev, const DevelopOptions& options);

/// The tone table for an exposure; of float samples, which have no tone, an empty one.
ToneTable tone_of(double exposure_ev, const DevelopOptions& options);

}  // namespace lowlux::isp
