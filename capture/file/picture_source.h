#pragma once

#include <cstddef>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "capture/file/picture_light.h"
#include "isp/base/executor.h"
#include "isp/base/frame.h"
#include "isp/base/image.h"
#include "isp/base/result.h"
#include "isp/codec/picture_file.h"

namespace lowlux::capture {

/// An image as light: a scene that sends this light to the camera.
struct ScenePicture {
  /// CIE 1931 X, Y, Z under the image's own white, upright. Display images have their white at D65 and Y = 1;
  /// scene-linear images have RGB (1, 1, 1) at Y = 1 and may exceed it. Never below 0: negative X, Y or Z of an
  /// imaginary primary (the blue of ACES AP0) is set to 0.
  SceneLinear xyz;
  /// Whether the file states the luminance of Y = 1 (OpenEXR whiteLuminance).
  bool absolute = false;
  double white_luminance_cd_m2 = 0;               // luminance of Y = 1; 0 unless `absolute`
  FrameInfo info;                                 // camera and exposure, as far as the file states them
  std::shared_ptr<const SourceTags> source_tags;  // author, lens, place and the like (raw_source_tags); null: none
  std::vector<std::string> warnings;              // one line each
};

/// Reads PNG, JPEG, TIFF, OpenEXR, PFM or PPM, identified by their first bytes, to scene-linear light.
///
/// 8 and 16 bits: by the embedded ICC profile (curves and a matrix, or grey; relative colorimetric, adapted to D65),
/// else as sRGB. EXIF orientation is honoured. Floats: linear; primaries of the OpenEXR chromaticities or of a linear
/// ICC profile, else Rec. 709. Alpha is dropped.
///
/// Errors: the file or its format (codec); NaN and infinite values, with their pixel; profiles of other kinds; negative
/// values, unless `negatives` allows them.
/// @param executor  its threads process the rows
Result<ScenePicture> read_picture(const std::string& path, Executor& executor, const isp::DecodeLimits& limits = {},
                                  Negatives negatives = Negatives::few);

/// Reads an image from the bytes of a file; errors refer to it as `name`.
Result<ScenePicture> read_picture(std::span<const std::byte> bytes, const std::string& name, Executor& executor,
                                  const isp::DecodeLimits& limits = {}, Negatives negatives = Negatives::few);

}  // namespace lowlux::capture
