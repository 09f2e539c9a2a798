#pragma once

#include <optional>
#include <string>
#include <vector>

#include "calib/picture_noise.h"
#include "isp/cli/args.h"

namespace lowlux::cli {

/// What the kinds of calibration have in common.
struct CalibrateArgs {
  std::vector<std::string> frames;
  std::string output;         // the profile
  std::string add_to;         // a profile to start from; empty: none
  std::string report;         // a page; empty: none
  std::optional<double> iso;  // of frames that do not state theirs
  std::optional<double> exposure_s;
  std::optional<double> temperature_c;
  bool force = false;
  bool json = false;
  bool quiet = false;
};

struct CalibrateBlackArgs {
  CalibrateArgs common;
  std::optional<double> system_gain_dn_per_e;
  bool masked = false;  // the frames' masked pixels are what is dark
  std::string map;      // prefix of the maps' names; empty: none
};

struct CalibrateNoiseArgs {
  CalibrateArgs common;
  std::vector<std::string> darks;
  bool steady_light = false;
  std::optional<calib::PictureNoiseMethod> method;  // for one picture; absent: ponomarenko
};

struct CalibrateQuotedArgs {
  CalibrateArgs common;  // `frames` holds the sensor's name
};

Parsed<CalibrateBlackArgs> parse_calibrate_black(const std::vector<std::string>& words);
Parsed<CalibrateNoiseArgs> parse_calibrate_noise(const std::vector<std::string>& words);
Parsed<CalibrateQuotedArgs> parse_calibrate_quoted(const std::vector<std::string>& words);

}  // namespace lowlux::cli
