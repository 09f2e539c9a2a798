#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "isp/base/cfa.h"
#include "isp/base/estimate.h"
#include "isp/base/sensor.h"

namespace lowlux {

/// Standard errors of the figures of a SensorModel, in the same units; 0 where a figure is quoted and not measured.
struct SensorErrors {
  double system_gain_dn_per_e = 0;
  double read_noise_e = 0;
  double full_well_e = 0;
  std::array<double, 3> dark_current_e_per_s{};
  double dark_doubling_c = 0;
  double prnu = 0;
  double dsnu = 0;
};

/// A pixel with much more dark current than the others, in active pixels.
struct HotPixelFigure {
  int x = 0;
  int y = 0;
  double excess_e_per_s = 0;  // at the model's dark_temperature_c
};

/// Where figures come from.
struct Provenance {
  enum class Kind : std::uint8_t { measured, quoted } kind = Kind::measured;
  std::string figures;             // which: "photon transfer", "dark series"...
  std::string source;              // the program and its version, or the publication
  std::string date;                // YYYY-MM-DD
  std::vector<std::string> files;  // that were measured
  double reduced_chi_square = 0;   // of the fit; 0 if nothing was fitted
  int degrees_of_freedom = 0;
};

/// A camera at one gain setting.
struct GainProfile {
  std::string gain_setting;  // as the camera calls it
  std::optional<double> iso;
  SensorModel sensor;
  SensorErrors errors;
  PerSite<Estimate> pedestal_dn{};  // the model's black level, site by site
  std::vector<HotPixelFigure> hot_pixels;
  std::vector<Provenance> provenance;
};

/// What has been measured of a camera; written and read by calib/profile_io.h.
struct CameraProfile {
  std::string make;
  std::string model;
  std::vector<GainProfile> gains;
};

}  // namespace lowlux
