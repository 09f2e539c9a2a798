#pragma once

#include <memory>
#include <string>
#include <vector>

#include "calib/flat/flat_field.h"
#include "isp/base/frame.h"
#include "isp/base/result.h"

namespace lowlux::cli {

/// Reads flats of one camera and exposure and computes their flat field, once for all images. Each flat's black level
/// is measured on its masked pixels or read from its tag. Errors: those of reading, of isp::choose_black, of
/// calib::DarkStack and of calib::make_flat_field.
Result<std::shared_ptr<const calib::FlatField>> read_flats(const std::vector<std::string>& files);

/// Makes the flat field the gain map of an image, in place of the gains that its file asks for, which correct the same
/// vignetting. The warnings of the image state that, and another f-number. Error: flats of another camera, size, mosaic
/// or white level.
Result<void> use_flat(const calib::FlatField& flat, RawFrame& picture);

}  // namespace lowlux::cli
