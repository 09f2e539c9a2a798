#pragma once

#include <cstddef>
#include <span>
#include <string>
#include <vector>

#include "isp/base/executor.h"
#include "isp/base/image.h"
#include "isp/base/result.h"
#include "isp/codec/picture_file.h"

namespace lowlux::capture {

/// A picture as light: what a scene looks like that sends it to the camera.
struct ScenePicture {
  /// CIE 1931 X, Y, Z under the picture's own white, upright. Display pictures have their white at D65 and Y = 1;
  /// scene-linear pictures have RGB (1, 1, 1) at Y = 1 and go beyond it. Never below 0: X, Y or Z that a primary
  /// below the colours (the blue of ACES AP0) makes negative is 0.
  SceneLinear xyz;
  /// The file states what luminance Y = 1 stands for (OpenEXR whiteLuminance).
  bool absolute = false;
  double white_luminance_cd_m2 = 0;   // of Y = 1; 0 unless `absolute`
  std::vector<std::string> warnings;  // one line each
};

/// Reads PNG, JPEG, TIFF, OpenEXR or PFM, told apart by their first bytes, to scene-linear light.
///
/// 8 and 16 bits: by the embedded ICC profile (curves and a matrix, or grey; relative colorimetric, adapted to D65),
/// else as sRGB. EXIF orientation is honoured. Floats: linear; primaries of the OpenEXR chromaticities or of a linear
/// ICC profile, else Rec. 709. Alpha is dropped.
///
/// Errors: the file or its format (codec); NaN and infinite values, with their pixel; profiles of other kinds. Negative
/// values are not radiance: they become 0, with a warning that states their number and their fraction of the light;
/// above a twentieth of it they are an error.
/// @param executor  its threads share the rows
Result<ScenePicture> read_picture(const std::string& path, Executor& executor, const isp::DecodeLimits& limits = {});

/// The same from the bytes of a file; `name` is what errors call it.
Result<ScenePicture> read_picture(std::span<const std::byte> bytes, const std::string& name, Executor& executor,
                                  const isp::DecodeLimits& limits = {});

}  // namespace lowlux::capture
