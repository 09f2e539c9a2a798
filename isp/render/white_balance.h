#pragma once

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

/// Where a white balance comes from.
enum class WhiteSource : std::uint8_t { as_shot, estimated, temperature, daylight, none };

/// "as-shot", "auto", "temperature", "daylight" or "none".
std::string_view name_of(WhiteSource source);

/// The camera RGB that is to become neutral, and how it was found.
struct WhiteBalance {
  Vector3 neutral{1, 1, 1};         // largest component 1; divide by it to balance
  std::optional<WhitePoint> white;  // the scene white it stands for, where the colour matrices tell
  WhiteSource source = WhiteSource::none;
  std::string reason;  // of a fallback or a limit that was applied, one line; empty if there is nothing to say
};

/// What the camera chose: AsShotNeutral, else AsShotWhiteXY.
/// @return error insufficient if the source tells neither, malformed if what it tells is no colour of a light
Result<WhiteBalance> as_shot_white_balance(const CameraColour& colour);

/// The white of a colour temperature, 1667..25000 K (white_of_temperature), through the camera's matrices.
Result<WhiteBalance> white_balance_of_temperature(const CameraColour& colour, double kelvin);

struct AutoWhiteOptions {
  double norm = 6;               // of the mean; 1 is grey world, infinity the brightest block; 6 is the paper's
  double clipped = 0.9;          // a block whose largest channel mean is above holds clipped pixels
  double signal_to_scatter = 4;  // a block's every channel must stand this far above the scatter of black blocks ...
  double signal_to_noise = 5;    // ... and this far above block_noise
  int min_blocks = 16;           // that qualify; fewer are too little to tell
  double min_k = 1900;           // range of whites, from high-pressure sodium ...
  double max_k = 12000;          // ... to blue shade
  double max_duv = 0.01;         // distance to white_of_temperature in CIE 1960 uv
};

/// What auto_white_balance found before it fell back on anything.
struct WhiteEstimate {
  WhiteBalance balance;     // without a reason
  int blocks = 0;           // that qualified; below AutoWhiteOptions::min_blocks there is no balance
  std::string_view remark;  // what became of the estimate, one line; empty if there is nothing to say
};

/// auto_white_balance without its fallbacks; allocates nothing.
/// @param memory  for as many values as there are blocks
WhiteEstimate estimate_white(const RgbView<const float>& blocks, double block_noise, const CameraColour& colour,
                             const AutoWhiteOptions& options, std::span<float> memory);

/// Automatic white balance by shades of grey (Finlayson & Trezzi, Color Imaging Conf. 12 (2004) 37-41): the neutral is
/// proportional to (mean of c^norm)^(1/norm) of each channel c, over the blocks that are neither clipped nor near the
/// noise. The white it stands for is then held to what lights are: its temperature to min_k..max_k, and its duv to
/// within max_duv of the daylight and Planckian whites of that temperature, so that a green wood or a red wall cannot
/// turn the picture into its complement. Without usable colour matrices it is not held, and says so.
/// With too few blocks it falls back to as shot, then to daylight (D65), then to equal channels, and says why.
/// @param blocks       thumbnail of camera RGB block means, not balanced, 1 at the white level; negative allowed
/// @param block_noise  standard deviation of the black noise of one block mean, same unit; 0 if unknown
WhiteBalance auto_white_balance(const RgbView<const float>& blocks, double block_noise, const CameraColour& colour,
                                const AutoWhiteOptions& options = {});

}  // namespace lowlux::isp
