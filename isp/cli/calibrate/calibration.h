#pragma once

#include <optional>
#include <string>
#include <vector>

#include "calib/profile/gain_profile.h"
#include "isp/base/camera_profile.h"
#include "isp/base/frame.h"
#include "isp/base/result.h"
#include "isp/cli/calibrate/calibrate_args.h"
#include "isp/cli/shared/noise_maps.h"
#include "isp/output/report/report.h"

namespace lowlux::cli {

/// What a calibration found, and how it is shown.
struct Calibration {
  CameraProfile profile;
  std::string text;
  isp::Report report;
  isp::Table frames;  // that were measured, for the report: list_frame
  std::vector<std::string> warnings;
  std::vector<PixelMap> maps;
};

/// What would keep files from being written is known before any work: they exist, or their folder is missing.
Result<void> check_outputs(const CalibrateArgs& args);

/// The profile to start from: --add-to's, or an empty one.
Result<CameraProfile> starting_profile(const CalibrateArgs& args);

/// A raw file, with what the options say where it states nothing. Errors name the file.
Result<RawFrame> read_calibration_frame(const std::string& file, const CalibrateArgs& args);

/// Makes the profile one of this camera; a profile or a frame without a camera's name fits any.
/// Error: it is another one's.
Result<void> put_camera(const FrameInfo& info, CameraProfile& profile);

/// Makes the profile one of this mosaic; a profile without one fits any. Error: it is another.
Result<void> put_mosaic(const std::string& mosaic, CameraProfile& profile);

/// Adds a frame and what it was taken with. @param use  "dark", "flat", "image"
void list_frame(const std::string& file, const std::string& use, const FrameInfo& info, isp::Table& frames);

/// For a report: when and by which version the figures were measured, and how to use the profile.
std::string measurement_text(const std::string& profile);

/// Source and date of what is measured today.
calib::Measured measured_today(std::vector<std::string> files);

/// Writes maps, report and profile, prints the text or JSON. @return the exit code
int finish(const CalibrateArgs& args, const Calibration& found);

/// Prints an error. @return the exit code
int calibration_failed(const CalibrateArgs& args, const Error& error);

int run_calibrate_black(const std::vector<std::string>& words);
int run_calibrate_noise(const std::vector<std::string>& words);
int run_calibrate_quoted(const std::vector<std::string>& words);

}  // namespace lowlux::cli
