#pragma once

#include "capture/decoder/decoded_raw.h"
#include "capture/dng/dng_file.h"
#include "isp/base/frame.h"
#include "isp/base/result.h"

namespace lowlux::capture {

/// What the tags say of one raw image of a DNG: the frame without its samples and what depends on them.
struct DngDescription {
  const TiffDirectory* directory;  // of the DngFile
  DngImage image;
  RawFrame frame;
};

/// Reads and checks the tags of a raw image, one of `dng.raw_images`.
Result<DngDescription> describe_dng(const DngFile& dng, const TiffDirectory& raw_image, std::size_t file_bytes);

/// Puts samples into the frame, and what the decoder alone knows. `described` is the raw image expected; where the
/// decoder chose another one of its size, that one is described instead. Without a colour matrix in the file the
/// decoder's table helps out, if it knows the camera.
Result<RawFrame> complete_dng(const DngFile& dng, DngDescription described, std::size_t file_bytes, DecodedRaw decoded);

}  // namespace lowlux::capture
