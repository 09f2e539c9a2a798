#pragma once

#include <string>
#include <vector>

#include "calib/sheet/data_sheet.h"
#include "isp/base/result.h"
#include "isp/cli/calibrate/calibrate_args.h"
#include "isp/cli/calibrate/calibration.h"

namespace lowlux::cli {

/// Reads the frames of a data sheet, one at a time. Darks are averaged by exposure time and temperature, flats paired;
/// the flats nearest half of saturation are read once more and averaged. Fills frames, warnings and camera of `found`.
/// Errors: those of reading; frames of several gain settings; more than max_dark_groups settings of darks; no two darks
/// of the shortest exposure; no pair of flats; those of fit_photon_transfer.
Result<calib::SheetFrames> read_sheet_frames(const CalibrateSheetArgs& args, Calibration& found);

/// Limits memory: 10 bytes for each pixel of each group while they are read, 8 afterwards.
inline constexpr std::size_t max_dark_groups = 24;

}  // namespace lowlux::cli
