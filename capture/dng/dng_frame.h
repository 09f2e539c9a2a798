#pragma once

#include "capture/decoder/decoded_raw.h"
#include "capture/dng/dng_file.h"
#include "capture/dng/dng_storage.h"
#include "capture/x_trans/x_trans_frame.h"
#include "isp/base/frame.h"
#include "isp/base/result.h"

namespace lowlux::capture {

/// Contents of the tags of one raw image of a DNG: the frame without its samples and the values that depend on them.
struct DngDescription {
  const TiffDirectory* directory;  // of the DngFile
  DngImage image;
  RawFrame frame;
};

/// Reads and checks the tags of a raw image, one of `dng.raw_images`.
Result<DngDescription> describe_dng(const DngFile& dng, const TiffDirectory& raw_image, std::size_t file_bytes);

/// Adds the samples to the frame, and what only the decoder knows. An X-Trans mosaic is used as use_mosaic states.
/// `described` is the raw image expected; if the decoder chose another one of its size, that one is described instead.
/// Without a colour matrix in the file the decoder's table is used, if it has the camera.
Result<RawFrame> complete_dng(const DngFile& dng, DngDescription described, std::size_t file_bytes, DecodedRaw decoded,
                              const XTransUse& use = {});

/// Adds the samples of an image in lossy JPEG or JPEG XL, given its codes. Errors: those of linearize_codes.
Result<RawFrame> complete_linearized_dng(const DngFile& dng, DngDescription described, Plane<std::uint16_t> codes,
                                         const XTransUse& use = {});

/// Adds the samples of an image of integers that LibRaw did not decode, given its codes, to which LinearizationTable is
/// applied. Errors: a damaged table.
Result<RawFrame> complete_code_dng(const DngFile& dng, DngDescription described, Plane<std::uint16_t> codes,
                                   const XTransUse& use = {});

/// Adds floating-point samples to the frame. Errors: those of unusable_sample (isp/base/float_samples.h).
Result<RawFrame> complete_float_dng(const DngFile& dng, DngDescription described, Plane<float> samples,
                                    const XTransUse& use = {});

}  // namespace lowlux::capture
