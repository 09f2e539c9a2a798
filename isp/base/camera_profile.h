#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "isp/base/cfa.h"
#include "isp/base/estimate.h"
#include "isp/base/frame.h"
#include "isp/base/sensor.h"

namespace lowlux {

/// Holds the standard errors of the figures of a SensorModel, in the same units; 0 where a figure is quoted and not
/// measured.
struct SensorErrors {
  double system_gain_dn_per_e = 0;
  double read_noise_e = 0;
  double full_well_e = 0;
  std::array<double, 3> dark_current_e_per_s{};
  double dark_doubling_c = 0;
  double prnu = 0;
  double dsnu = 0;
};

/// Describes a pixel with much more dark current than the others, in active pixels.
struct HotPixelFigure {
  int x = 0;
  int y = 0;
  double excess_e_per_s = 0;  // at the model's dark_temperature_c
};

/// States the source of a set of figures.
struct Provenance {
  enum class Kind : std::uint8_t { measured, quoted } kind = Kind::measured;
  std::string figures;             // kind of figures: "photon transfer", "dark series"...
  std::string source;              // the program and its version, or the publication
  std::string date;                // YYYY-MM-DD
  std::vector<std::string> files;  // files that were measured
  double reduced_chi_square = 0;   // quality of the fit; 0 if nothing was fitted
  int degrees_of_freedom = 0;
};

/// Holds the range that figures were measured over, ends included.
struct MeasuredRange {
  double low = 0;
  double high = 0;
  friend bool operator==(const MeasuredRange&, const MeasuredRange&) = default;
};

/// Describes a camera at one gain setting.
struct GainProfile {
  std::string gain_setting;  // name that the camera uses
  std::optional<double> iso;
  std::optional<SensorModel> sensor;  // absent where the system gain is unknown: then no figure is in electrons
  SensorErrors errors;
  std::optional<PerSite<Estimate>> pedestal_dn;  // the model's black level, per CFA site; absent if it was not measured
  BlackPoint::Holds pedestal_holds = BlackPoint::Holds::pedestal_only;  // with the dark charge if it was not separated
  std::optional<MeasuredRange> dark_exposure_s;                // exposure times of the darks; absent if there were none
  std::optional<MeasuredRange> dark_temperature_c;             // temperatures of the darks, where they state them
  std::optional<std::array<Estimate, 3>> dark_chromaticity{};  // R : G : B of the dark current, sum 1
  std::vector<HotPixelFigure> hot_pixels;
  std::vector<Provenance> provenance;
};

/// Describes a camera's colours under one illuminant, and the error of the matrix: mean CIEDE2000 over the patches.
struct ColourProfile {
  std::string illuminant;
  ColourCalibration calibration;                    // camera_calibration is the identity
  std::optional<double> patches_ciede2000;          // error of the patches the matrix was fitted to
  std::optional<double> cross_validated_ciede2000;  // error of patches left out of the fit
  std::optional<double> condition_number;           // condition number of the equations solved
  /// Holds the weights of white-balanced R, G and B in scotopic luminance; their sum is S/P of the illuminant.
  std::optional<std::array<double, 3>> scotopic_weights{};
  Provenance provenance;
};

/// Holds what has been measured of a camera; written and read by calib/profile/profile_io.h.
struct CameraProfile {
  std::string make;
  std::string model;
  std::vector<GainProfile> gains;
  std::vector<ColourProfile> colours;
  std::string mosaic;  // mosaic of the measured frames: RGGB, GRBG, GBRG, BGGR or monochrome; empty if unknown
};

/// Returns the usual name of a camera: "Canon EOS 550D" for the make "Canon" and the model "Canon EOS 550D", "NIKON
/// D750" for "NIKON CORPORATION", "Nokia RX-51" for "Nokia" and "RX-51".
std::string camera_name(std::string_view make, std::string_view model);

/// Names a camera as a file or a decoder does.
struct CameraName {
  std::string_view make;
  std::string_view model;
};

/// Returns whether two frames name one camera. Decoders shorten the names of files: "Nikon" "D750" is "NIKON
/// CORPORATION" "NIKON D750". Makes agree if one contains the other, or if a model begins with the make of the other
/// ("PENTAX K-1" of "RICOH IMAGING COMPANY, LTD." is of "Pentax"); models, if one is the end of the other, from a word
/// on; both in any case of letters, and without a "digital camera" at the end. A missing make or model agrees with a
/// missing one alone. Names of more than 256 characters agree if they are equal.
bool is_same_camera(const CameraName& one, const CameraName& other);
/// Returns the same of names that may be incomplete, as those of profiles are: a missing make or model agrees with any.
bool may_be_same_camera(const CameraName& one, const CameraName& other);

}  // namespace lowlux
