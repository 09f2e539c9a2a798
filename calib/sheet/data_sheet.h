#pragma once

#include <array>
#include <optional>
#include <string>
#include <vector>

#include "calib/dark/dark_stack.h"
#include "calib/flat/pair_statistics.h"
#include "calib/flat/photon_transfer.h"
#include "calib/sheet/dark_rates.h"
#include "calib/sheet/spatial_parts.h"
#include "isp/base/result.h"

namespace lowlux::calib {

/// Light of known power on the sensor, constant over all flats.
struct Irradiance {
  double w_per_m2 = 0;
  double wavelength_nm = 0;  // single or central wavelength
  double pixel_um2 = 0;      // area of a pixel
};

/// Returns the mean number of photons that reach a pixel in a time (EMVA 1288 R4 Eq. 3): E A t lambda / (h c).
double photons_of(const Irradiance& light, double exposure_s);

/// Frames of one gain setting.
struct SheetFrames {
  std::vector<PairStatistics> dark_pairs;  // pairs of darks of the shortest exposure
  std::vector<PairStatistics> flat_pairs;
  std::vector<DarkGroup> darks;     // by exposure and temperature; the first is of the shortest exposure
  std::optional<DarkGroup> bright;  // flats near half of saturation; absent: PRNU is not split
  bool steady_light = false;
  std::optional<Irradiance> irradiance;  // only with steady light
};

/// Data sheet of one gain setting by EMVA 1288 release 4.0 linear; figures that the frames do not determine are absent.
/// SNR_max = sqrt(mu_sat); the absolute sensitivity threshold is the mean at which the SNR is 1,
///     mu_min = sqrt(sigma_d^2 + 1 / (12 K^2) + 1/4) + 1/2  [e-],
/// and the dynamic range mu_sat / mu_min (R4, sections 2.6 and 6.6). Quantum efficiency and PRNU1288 take the darks of
/// the flats' exposure time (DarkLevels); where there are none, PRNU1288 contains the nonuniformity of the dark
/// current, and there is a warning.
struct DataSheet {
  PhotonTransfer transfer;
  std::optional<Estimate> saturation_e;  // mu_sat: EMVA's saturation capacity
  std::optional<Estimate> snr_max;
  std::optional<Estimate> threshold_e;
  std::optional<Estimate> dynamic_range;
  std::optional<DarkRates> dark_rates;
  Nonuniformity dsnu_e;
  std::optional<Nonuniformity> prnu;                          // relative
  std::optional<std::array<Estimate, 3>> quantum_efficiency;  // values of R, G, B; without filters three equal values
  std::vector<std::string> warnings;                          // figures that contain dark current, saturated darks
};

/// Computes the sheet. Errors: those of fit_photon_transfer and spatial_parts; those of dark_rates but for
/// insufficient.
Result<DataSheet> make_data_sheet(const SheetFrames& frames);

}  // namespace lowlux::calib
