#pragma once

#include <string>
#include <vector>

#include "isp/cli/args.h"

namespace lowlux::cli {

struct CalibrateColourArgs {
  std::string chart;       // a raw file; empty: spectral sensitivities
  std::string camera;      // a name of the table, or a CSV file; empty: a chart
  std::string illuminant;  // a name or a CSV file; empty: chosen
  std::string output;
  std::string add_to;   // a profile; empty: a new one
  std::string report;   // HTML; empty: none
  std::string overlay;  // picture; empty: none
  bool per_photon = false;
  bool preserve_white = false;
  bool even_light = false;
  bool force = false;
  bool json = false;
};

Parsed<CalibrateColourArgs> parse_calibrate_colour(const std::vector<std::string>& words);

}  // namespace lowlux::cli
