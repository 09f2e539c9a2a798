#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>

#include "isp/base/frame.h"
#include "isp/base/image.h"
#include "isp/base/result.h"
#include "isp/model/colour/camera_colour.h"

namespace lowlux::isp {

/// Names the source of a white balance.
enum class WhiteSource : std::uint8_t { as_shot, estimated, temperature, daylight, none, preset, gains, picked };

/// Returns "as-shot", "auto", "temperature", "daylight", "none", "preset", "gains" or "picked".
std::string_view name_of(WhiteSource source);

/// Holds the camera RGB that is to become neutral, and its origin.
struct WhiteBalance {
  Vector3 neutral{1, 1, 1};         // largest component 1; divide by it to balance
  std::optional<WhitePoint> white;  // the scene white it stands for, if the colour matrices determine it
  WhiteSource source = WhiteSource::none;
  std::string reason;  // reason of a fallback or a limit that was applied, one line; empty if neither applies
};

/// Returns the camera's own choice: AsShotNeutral, else AsShotWhiteXY.
/// @return error insufficient if the source has neither, malformed if the value is not a colour of a light
Result<WhiteBalance> as_shot_white_balance(const CameraColour& colour);

/// A tint of 1 is a distance of 1/3000 in CIE 1960 uv.
inline constexpr double tint_per_duv = 3000;
inline constexpr double max_tint = 150;

/// Returns the white of a colour temperature, 1667..25000 K (white_of_temperature), through the camera's matrices.
/// @param tint  -150 to 150: moves the white from that of the temperature along the normal of the Planckian locus, by
///              tint / 3000 in CIE 1960 uv. Positive: the light is greener, and so the image becomes more magenta.
Result<WhiteBalance> white_balance_of_temperature(const CameraColour& colour, double kelvin, double tint = 0);

/// Lists lights by the names that cameras have for them.
enum class WhitePreset : std::uint8_t { daylight, cloudy, shade, tungsten, fluorescent, flash };
inline constexpr std::array all_white_presets{WhitePreset::daylight, WhitePreset::cloudy,      WhitePreset::shade,
                                              WhitePreset::tungsten, WhitePreset::fluorescent, WhitePreset::flash};
std::string_view name_of(WhitePreset preset);

/// Returns the chromaticity of a preset: the CIE illuminant (CIE 15:2018, tables T.3 and T.6) that DNG assigns to the
/// EXIF light source of that name. Daylight and flash are D55, cloudy D65, shade D75, tungsten A, fluorescent FL2.
Xy white_of(WhitePreset preset);

/// Returns the white of a preset, through the camera's matrices.
Result<WhiteBalance> white_balance_of_preset(const CameraColour& colour, WhitePreset preset);

/// Returns the balance of a neutral that was measured in the image or follows from given gains. Its white is absent
/// where the matrices have none for it.
/// @param neutral  camera RGB, above 0
WhiteBalance white_balance_of_neutral(const CameraColour& colour, const Vector3& neutral, WhiteSource source);

/// Holds the options of auto_white_balance().
struct AutoWhiteOptions {
  double norm = 6;       // exponent of the mean; 1 is grey world, infinity the brightest block; 6 is the paper's
  double clipped = 0.9;  // a block whose largest channel mean is above holds clipped pixels
  double signal_to_scatter = 4;  // minimum ratio of each channel of a block to the scatter of black blocks ...
  double signal_to_noise = 5;    // ... and to block_noise
  int min_blocks = 16;           // minimum number of blocks that qualify
  double min_k = 1900;           // range of whites, from high-pressure sodium ...
  double max_k = 12000;          // ... to blue shade
  double max_duv = 0.01;         // maximum distance to white_of_temperature in CIE 1960 uv
};

/// Holds the estimate of auto_white_balance before any fallback.
struct WhiteEstimate {
  WhiteBalance balance;     // without a reason
  int blocks = 0;           // number that qualified; below AutoWhiteOptions::min_blocks there is no balance
  std::string_view remark;  // on limits applied to the estimate, one line; empty if there are none
};

/// Estimates the white as auto_white_balance without its fallbacks; allocates nothing.
/// @param memory  for as many values as there are blocks
WhiteEstimate estimate_white(const RgbView<const float>& blocks, double block_noise, const CameraColour& colour,
                             const AutoWhiteOptions& options, std::span<float> memory);

/// Estimates white balance by shades of grey (Finlayson & Trezzi, Color Imaging Conf. 12 (2004) 37-41): the neutral is
/// proportional to (mean of c^norm)^(1/norm) of each channel c, over the blocks that are neither clipped nor near the
/// noise. The white it stands for is then limited to the whites of real lights: its temperature to min_k..max_k, and
/// its duv to within max_duv of the daylight and Planckian whites of that temperature, so that a green wood or a red
/// wall cannot turn the image into its complement. Without usable colour matrices it is not limited, which `reason`
/// states. With too few blocks it falls back to as shot, then to daylight (D65), then to equal channels, which `reason`
/// states.
/// @param blocks       thumbnail of camera RGB block means, not balanced, 1 at the white level; negative allowed
/// @param block_noise  standard deviation of the black noise of one block mean, same unit; 0 if unknown
WhiteBalance auto_white_balance(const RgbView<const float>& blocks, double block_noise, const CameraColour& colour,
                                const AutoWhiteOptions& options = {});

}  // namespace lowlux::isp
