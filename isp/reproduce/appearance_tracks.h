#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "isp/base/result.h"
#include "isp/model/appearance/appearance_model.h"
#include "isp/model/appearance/entropy_model.h"
#include "isp/model/colour/colorimetry.h"
#include "isp/model/spectrum/spectral_data.h"

namespace lowlux::isp {

/// Returns the 14 luminances of a white in the thesis' section 5.2, which states their number and the ends, 0.002 and
/// 1000 cd/m2: here evenly spaced in the logarithm.
std::vector<double> track_levels_cd_m2();

/// Returns the reflectances of the thesis' ten chips.
std::vector<NamedSpectrum> track_chips();

/// Chooses among interpretations that the thesis leaves open.
struct TrackReading {
  double adaptation_fraction = 1;  // ratio of the luminance of the adaptation field to that of the white
  ShinUnits shin_units = ShinUnits::luminance_as_is;
  EntropyVariant variant = EntropyVariant::rendering;
};

/// Appearance of chips under the equal-energy light by one model, relative to the equal-energy white of Y = 1. Each
/// level is scaled so that the white of that level has Y = 1, as the thesis shows its patches: the intensity of the
/// white point is mapped to 255 (section 5.2.1).
struct AppearanceTracks {
  std::string model;
  std::vector<std::vector<Xyz>> seen;  // by chip, then by level
};

/// Applies a model of appearance_models() that leaves the equal-energy white its chromaticity or moves it permanently:
/// all but `entropy`, which shows it as D65. Errors: those of finding and applying the model; a model that shows the
/// white of a level black.
Result<AppearanceTracks> tracks_by_colour(std::string_view model, const TrackReading& reading,
                                          const std::vector<NamedSpectrum>& chips,
                                          const std::vector<double>& levels_cd_m2);

/// Applies the maximum-entropy model, whose input is the chips' own spectra. The chromaticity of the white it finds is
/// mapped to the equal-energy one by Bradford's matrix, luminance is L_mes over that of the white.
/// @param gamma_fixed  weight of entropy at all levels; absent: it grows as the eye adapts to the dark
/// Errors: those of entropy_model(); a spectrum that is not found.
Result<AppearanceTracks> tracks_by_spectrum(std::string name, const TrackReading& reading,
                                            std::optional<double> gamma_fixed, const std::vector<NamedSpectrum>& chips,
                                            const std::vector<double>& levels_cd_m2);

/// Returns the mean of Delta E ab between the appearances of one chip by two models, over the levels.
double mean_mutual_delta_e(const AppearanceTracks& first, const AppearanceTracks& second, std::size_t chip);

/// Returns the mean difference in a* and b* alone between the appearances of one chip by two models, over the levels.
double mean_chromatic_difference(const AppearanceTracks& first, const AppearanceTracks& second, std::size_t chip);

/// Returns CIELAB relative to the equal-energy white.
Lab lab_of_track(const Xyz& seen);

}  // namespace lowlux::isp
