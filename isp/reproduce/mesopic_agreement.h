#pragma once

#include <array>
#include <cstddef>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "isp/base/result.h"
#include "isp/reproduce/appearance_tracks.h"
#include "isp/reproduce/reproduce.h"

namespace lowlux::isp {

/// Name of the spectral model among tracks; the others have those of appearance_models().
inline constexpr std::string_view spectral_model = "spectral";

/// Name of the patch of the thesis' Tables 5-1 and 5-2.
inline constexpr std::string_view agreement_chip = "10GY_6_10";

/// Returns all readings of what the thesis leaves open. The first is used for plots and single values: one luminance
/// for white and adaptation, Shin's coefficients looked up with it unconverted, whites kept white. The others vary: a
/// fifth of the white for adaptation, coefficients by lux, Eq. 5.1 as printed.
std::span<const TrackReading> track_readings();
inline constexpr std::size_t readings = 8;
inline constexpr std::size_t reading_as_printed = 1;  // the first except for Eq. 5.1, which is taken as printed
inline constexpr std::size_t reading_by_lux = 2;      // the first except for the unit of Shin's coefficients

/// A value of the tables: mean Delta E ab between two models' appearances of the patch at 14 levels.
struct PublishedPair {
  std::string_view first, second;
  double delta_e;
};

/// A published value with the values computed here.
struct Agreement {
  PublishedPair pair;
  std::array<double, readings> ours{};
  double without_lightness = 0;  // mean difference in a* and b* alone, in the first reading
};

/// Computes the agreements of all pairs. Errors: those of tracks_by_colour() and tracks_by_spectrum().
Result<std::vector<Agreement>> agreements(std::span<const PublishedPair> pairs, std::optional<double> gamma_fixed);

/// Returns the agreement of a pair that is in `all`, in either order.
const Agreement& agreement_of(std::span<const Agreement> all, std::string_view first, std::string_view second);

/// Returns the finding of a published value. It agrees if the first reading or the one with Eq. 5.1 as printed is
/// within a tenth of it, has the same direction if the range of the readings contains it, and else does not hold.
/// @param experiment, table  "mesopic-tracks", "Table 5-1"
Finding figure_of(const std::string& experiment, const std::string& table, const Agreement& agreement);

/// Plots ten chips in the chromaticity diagram by one model.
Plot track_plot(const std::string& id, const AppearanceTracks& tracks, const std::vector<NamedSpectrum>& chips);

/// Plots Delta E ab of the patch over luminance, for pairs of models, in the first reading.
Result<Plot> difference_plot(const std::string& id, std::span<const PublishedPair> pairs,
                             std::optional<double> gamma_fixed);

}  // namespace lowlux::isp
