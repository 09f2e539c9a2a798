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
#include "isp/render/exposure.h"
#include "isp/render/profile_tables.h"
#include "isp/render/white_balance.h"

namespace lowlux::isp {

/// Holds white balance, exposure, look, and what the kernels need of them.
struct Rendering {
  Vector3 neutral{1, 1, 1};         // camera RGB of white, largest 1
  std::optional<WhitePoint> white;  // absent without a colour calibration
  std::string_view white_balance_rule;
  /// Applied before missing colours are interpolated. In camera RGB it is that of the shot, and `transform` takes it
  /// back.
  std::array<float, 3> white_gain{1, 1, 1};
  double exposure_ev = 0;
  std::string_view exposure_rule;
  double limit = 1;                         // scene-linear value after exposure that becomes display white
  std::optional<LookPlan> look;             // absent: that of the camera
  std::optional<ProfileRendering> profile;  // tables of DevelopOptions::profile_tables, where they are applied
  RgbTransform transform;
  ToneTable tone;
  std::vector<std::string> warnings;
};

/// Decides white balance, exposure and look from the light of a thumbnail whose dark charge is subtracted. Errors:
/// those of plan_develop that concern colour, and of plan_look.
/// @param picked  result of picked_neutral(), for WhiteBalanceChoice::Mode::picked
Result<Rendering> decide_rendering(const RawFrame& frame, const Thumbnail& light, const DevelopOptions& requested,
                                   const Vector3& picked);

// Steps of decide_rendering, which allocate only to report an error.

/// Returns whether a frame has colours that are not known, in a space that needs them. An image for viewing shows
/// its white-balanced camera RGB as linear sRGB, with a warning.
bool has_unknown_colours(const RawFrame& frame, OutputSpace space);

/// Returns the factors of R, G and B that make a neutral equal in all channels; that of its largest channel is 1.
std::array<float, 3> white_gain_of(const Vector3& neutral);

/// Returns the standard deviation of the black noise in the mean of a thumbnail's block.
double block_noise_std(const RawDn& raw, const Thumbnail& thumbnail);

/// Returns the matrix from white-balanced camera RGB to linear values of the space, white at (1, 1, 1). Needs
/// balance.white, unless the space is camera RGB, the frame monochrome or its colours are unknown.
Result<Matrix3> balanced_to_output(const RawFrame& frame, const DevelopOptions& options, const WhiteBalance& balance);

/// Computes the luminance of each block as it will be rendered, before exposure.
/// @param balanced  result of balanced_to_output
/// @param out       one value for each block
void rendered_luminance(const CameraRgb& blocks, OutputSpace space, const std::array<float, 3>& white_gain,
                        const Matrix3& balanced, std::span<float> out);

/// Computes the largest channel of each block as it will be rendered, before exposure.
void rendered_largest(const CameraRgb& blocks, const std::array<float, 3>& white_gain, const Matrix3& balanced,
                      std::span<float> out);

/// Returns the options of an automatic exposure. The luminance of the scene follows from f-number, exposure time and
/// ISO speed where they are known; with a look it is left to that.
AutoExposureOptions exposure_options(const FrameInfo& info, const Thumbnail& light, const DevelopOptions& options);

/// Returns the kernels' transform for exposure and limit of `rendering`. Camera RGB is written unchanged; all other
/// spaces are clipped where the first channel saturates, so that clipped colours are neutral, unless highlights are
/// reconstructed.
RgbTransform transform_of(const Matrix3& balanced, const Rendering& rendering, const DevelopOptions& options);

/// Returns the clip of a rendering whose colours saturate at these fractions of white: where the first is saturated.
float clip_of(const Rendering& rendering, const std::array<double, 3>& saturation);

/// Returns the tone table for a limit; an empty one for float samples, which have no tone curve.
ToneTable tone_of(double limit, const DevelopOptions& options);

}  // namespace lowlux::isp
