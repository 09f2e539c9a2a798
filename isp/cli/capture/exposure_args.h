#pragma once

#include <optional>
#include <string>
#include <vector>

#include "capture/camera/camera.h"
#include "isp/model/sensor/exposure_choice.h"

namespace CLI {
class App;
}  // namespace CLI

namespace lowlux::cli {

/// Holds the arguments of `capture --auto-exposure`.
struct AutoExposureArgs {
  bool wanted = false;
  std::optional<double> longest_s;  // --max-exposure
  std::optional<double> max_gain;   // a factor
  std::optional<isp::Mains> mains;  // absent: those of either frequency
  std::optional<double> clipped_fraction;
  std::vector<capture::CameraGain> gain_codes;  // gain codes of a V4L2 camera, by rising factor
};

/// Adds the options of automatic exposure.
void add_auto_exposure(CLI::App& app, AutoExposureArgs& args);

/// Returns the error of the options in combination; nothing if there is none.
std::optional<std::string> auto_exposure_error(const CLI::App& app, const AutoExposureArgs& args);

}  // namespace lowlux::cli
