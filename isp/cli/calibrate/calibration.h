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

/// Holds the results of a calibration, and their text and report.
struct Calibration {
  CameraProfile profile;
  std::string text;
  isp::Report report;
  isp::Table frames;  // measured frames, for the report: list_frame
  std::vector<std::string> warnings;
  std::vector<PixelMap> maps;
};

/// Checks before any work that files can be written. Errors: a file exists, or its folder is missing.
Result<void> check_outputs(const CalibrateArgs& args);

/// Returns the profile to extend: --add-to's, or an empty one.
Result<CameraProfile> starting_profile(const CalibrateArgs& args);

/// Reads a raw file and completes values it does not state from the options. Errors name the file.
Result<RawFrame> read_calibration_frame(const std::string& file, const CalibrateArgs& args);

/// Assigns the profile to this camera; a profile or a frame without a camera's name fits any.
/// Error: it belongs to another camera.
Result<void> put_camera(const FrameInfo& info, CameraProfile& profile);

/// Assigns the profile to this mosaic; a profile without one fits any. Error: it belongs to another mosaic.
Result<void> put_mosaic(const std::string& mosaic, CameraProfile& profile);

/// Adds a frame and its capture settings. @param use  "dark", "flat", "image"
void list_frame(const std::string& file, const std::string& use, const FrameInfo& info, isp::Table& frames);

/// Returns the date and program version of the measurement and the use of the profile, for a report.
std::string measurement_text(const std::string& profile);

/// Returns the source and date of values measured today.
calib::Measured measured_today(std::vector<std::string> files);

/// Writes maps, report and profile; without an output none of them. Errors name the file.
Result<void> write_calibration(const CalibrateArgs& args, const Calibration& found);

/// Writes the files, prints the text or JSON. @return the exit code
int finish(const CalibrateArgs& args, const Calibration& found);

/// Prints an error. @return the exit code
int calibration_failed(const CalibrateArgs& args, const Error& error);

/// Each does the work of a kind of calibration; none writes a file.
Result<Calibration> calibrate_black(const CalibrateBlackArgs& args);
Result<Calibration> calibrate_noise(const CalibrateNoiseArgs& args);
Result<Calibration> calibrate_quoted(const CalibrateQuotedArgs& args);

int run_calibrate_black(const std::vector<std::string>& words);
int run_calibrate_noise(const std::vector<std::string>& words);
int run_calibrate_sheet(const std::vector<std::string>& words);
int run_calibrate_quoted(const std::vector<std::string>& words);

}  // namespace lowlux::cli
