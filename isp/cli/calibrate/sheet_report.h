#pragma once

#include <string>

#include "calib/sheet/data_sheet.h"
#include "isp/cli/calibrate/calibration.h"

namespace lowlux::cli {

/// Adds a data sheet to a calibration's text and report: all figures, the photon transfer, spectrograms and histograms.
void show_data_sheet(const calib::DataSheet& sheet, const calib::SheetFrames& frames, Calibration& found);

/// Returns the sheet as one JSON object: camera, method, figures with their standard errors (null where the frames do
/// not determine them), spectrograms, warnings.
std::string sheet_json(const calib::DataSheet& sheet, const calib::SheetFrames& frames, const Calibration& found);

}  // namespace lowlux::cli
