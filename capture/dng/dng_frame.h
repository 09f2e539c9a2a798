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

/// Adds the codes that LibRaw delivers, without LinearizationTable, to the frame, and what only the decoder knows. They
/// become linear samples, and an X-Trans mosaic is used as use_mosaic states.
/// `described` is the raw image expected; if the decoder chose another one of its size, that one is described instead.
/// Without a colour matrix in the file the decoder's table is used, if it has the camera.
Result<RawFrame> complete_dng(const DngFile& dng, DngDescription described, std::size_t file_bytes, DecodedRaw decoded,
                              const XTransUse& use = {});

/// Adds the codes of an image that LibRaw did not decode. Errors: a damaged LinearizationTable; an OpcodeList2 that is
/// damaged, if is_encoded.
Result<RawFrame> complete_dng(const DngFile& dng, DngDescription described, Plane<std::uint16_t> codes,
                              const XTransUse& use = {});

/// Adds floating-point samples to the frame. Errors: those of unusable_sample (isp/base/float_samples.h).
Result<RawFrame> complete_dng(const DngFile& dng, DngDescription described, Plane<float> samples,
                              const XTransUse& use = {});

}  // namespace lowlux::capture
