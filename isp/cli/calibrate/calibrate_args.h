#pragma once

#include <optional>
#include <string>
#include <vector>

#include "calib/picture/picture_noise.h"
#include "calib/sheet/data_sheet.h"
#include "isp/cli/develop/develop_args.h"

namespace lowlux::cli {

/// Holds the arguments that all kinds of calibration have in common.
struct CalibrateArgs {
  std::vector<std::string> frames;
  std::string output;         // the profile
  std::string add_to;         // a profile to extend; empty: none
  std::string report;         // a page; empty: none
  std::optional<double> iso;  // for frames that do not state theirs
  std::optional<double> exposure_s;
  std::optional<double> temperature_c;
  bool force = false;
  bool json = false;
  bool quiet = false;
};

/// Holds the arguments of `calibrate black`.
struct CalibrateBlackArgs {
  CalibrateArgs common;
  std::optional<double> system_gain_dn_per_e;
  bool masked = false;  // measure the masked pixels of the frames
  std::string map;      // prefix of the maps' names; empty: none
};

/// Holds the arguments of `calibrate noise`.
struct CalibrateNoiseArgs {
  CalibrateArgs common;
  std::vector<std::string> darks;
  bool steady_light = false;
  std::optional<calib::PictureNoiseMethod> method;  // for a single image; absent: ponomarenko
};

/// Holds the arguments of `calibrate sheet`.
struct CalibrateSheetArgs {
  CalibrateArgs common;  // `frames` are flats; `output` is the page
  std::vector<std::string> darks;
  bool steady_light = false;
  std::optional<calib::Irradiance> irradiance;  // with steady light
};

/// Holds the arguments of `calibrate quoted`.
struct CalibrateQuotedArgs {
  CalibrateArgs common;  // `frames` holds the sensor's name
};

Parsed<CalibrateBlackArgs> parse_calibrate_black(const std::vector<std::string>& words);
Parsed<CalibrateNoiseArgs> parse_calibrate_noise(const std::vector<std::string>& words);
Parsed<CalibrateSheetArgs> parse_calibrate_sheet(const std::vector<std::string>& words);

/// Returns the file next to the page of a data sheet, with its figures.
std::string json_of_sheet(const std::string& page);

Parsed<CalibrateQuotedArgs> parse_calibrate_quoted(const std::vector<std::string>& words);

/// Holds the arguments of `calibrate colour`.
struct CalibrateColourArgs {
  std::string chart;       // a raw file; empty: spectral sensitivities
  std::string camera;      // an entry of the table, or a CSV file; empty: a chart
  std::string illuminant;  // a name or a CSV file; empty: chosen
  std::string output;
  std::string add_to;   // a profile; empty: a new one
  std::string report;   // HTML; empty: none
  std::string overlay;  // image; empty: none
  bool per_photon = false;
  bool preserve_white = false;
  bool even_light = false;
  bool force = false;
  bool json = false;
};

Parsed<CalibrateColourArgs> parse_calibrate_colour(const std::vector<std::string>& words);

}  // namespace lowlux::cli
