#pragma once

#include <cstddef>
#include <optional>
#include <string>

#include "isp/model/sensor/exposure_advice.h"
#include "isp/model/sensor/sensor_db.h"

namespace CLI {
class App;
}  // namespace CLI

namespace lowlux::cli {

/// Holds the arguments of `info --advise`; absent values come from the raw file, or are defaults. Without a sensor the
/// advice is for the frames of a merge.
struct AdviseArgs {
  bool wanted = false;
  std::string sensor;                     // by name, or a camera profile's file (.json)
  std::string gain;                       // only this setting; empty: all
  isp::SensorFigures figures;             // override those of the table
  std::string light = "D65";              // illuminant of the scene
  std::optional<double> midtone_cd_m2;    // --luminance
  std::optional<double> highlight_cd_m2;  // --highlight: 20, or 20x for a multiple of the mid tone
  std::optional<double> highlight_ratio;
  std::optional<double> f_number;
  std::optional<double> white_luminance_cd_m2;
  std::optional<double> longest_exposure_s;
  std::optional<double> speed_px_per_s;
  std::optional<double> blur_px;
  std::optional<double> temperature_c;
  std::optional<double> clipped_fraction;
  std::optional<double> snr_db;  // signal-to-noise ratio of the darkest tenth of a raw file, once frames are merged
  double patch_pixels = 256;
  int frames = 1;
  std::string report;  // HTML page to write; empty: none
  bool force = false;
};

/// Adds the options of `info --advise`.
void add_advise(CLI::App& app, AdviseArgs& args);

/// Returns the error of the options in combination; empty if there is none.
/// @param app    after parsing: which options were given
/// @param files  number of raw files among the arguments
std::string validate_advise(const CLI::App& app, const AdviseArgs& args, std::size_t files);

}  // namespace lowlux::cli
