#pragma once

#include <span>
#include <string>

#include "calib/dark/dark_series.h"
#include "calib/dark/dark_stack.h"
#include "calib/profile/gain_profile.h"
#include "isp/base/camera_profile.h"
#include "isp/cli/calibrate/calibration.h"

namespace lowlux::cli {

/// Adds a black level of one exposure time to a calibration's text and report.
void show_black(const calib::BlackFigures& black, const calib::FrameSetting& setting, Calibration& found);

/// Adds a dark series: values, dark charge against time, dark current against temperature, residuals and the black
/// point's chromaticity.
/// @param gain_source  origin of the system gain
void show_dark_series(const calib::DarkSeries& series, std::span<const calib::DarkGroup> groups,
                      const GainProfile& gain, const std::string& gain_source, Calibration& found);

/// Returns "ISO 1600", or "one gain" if the frames state none.
std::string name_of_gain(const calib::FrameSetting& setting);

}  // namespace lowlux::cli
