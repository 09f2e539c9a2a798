#pragma once

#include <memory>
#include <string>
#include <vector>

#include "calib/flat/flat_field.h"
#include "isp/base/frame.h"
#include "isp/base/result.h"
#include "isp/cli/develop/dark_files.h"
#include "isp/cli/develop/develop_args.h"
#include "isp/cli/shared/outputs.h"

namespace lowlux::cli {

/// Names the files that are only read in addition to the raw files of the jobs.
struct CalibrationFiles {
  DarkNames darks;
  std::vector<std::string> flats;
};

/// Returns the calibration files that the arguments name. Errors: those of dark_files and raw_files_of_lists; a flat
/// that is itself among the raw files; an output that would replace any file that is read.
Result<CalibrationFiles> calibration_files(const DevelopArgs& args, const std::vector<Job>& jobs);

/// Reads flats of one camera and exposure and computes their flat field, once for all images. Each flat's black level
/// is measured on its masked pixels or read from its tag. Errors: those of reading, of isp::choose_black, of
/// calib::DarkStack and of calib::make_flat_field.
Result<std::shared_ptr<const calib::FlatField>> read_flats(const std::vector<std::string>& files);

/// Makes the flat field the gain map of an image, in place of the gains that its file asks for, which correct the same
/// vignetting. The warnings of the image state that, and another f-number. Error: flats of another camera, size, mosaic
/// or white level.
Result<void> use_flat(const calib::FlatField& flat, RawFrame& picture);

}  // namespace lowlux::cli
