#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string_view>
#include <vector>

#include "isp/base/result.h"
#include "isp/model/appearance/cao.h"
#include "isp/reproduce/appearance_tracks.h"
#include "isp/reproduce/reproduce.h"

namespace lowlux::isp {

/// Lists ways to continue the weights of Cao's rods below 0.1 cd/m2 along the line from 0.62 to 0.1 cd/m2.
enum class CaoExtrapolation : std::uint8_t {
  logarithm,  // weights linear in the logarithm of luminance, as they are interpolated
  luminance,  // weights linear in luminance
  power,      // logarithms of weights linear in the logarithm of luminance
};

/// Lists directions of the model: the colour that cones see at 10 cd/m2 as an eye sees the given one at a low level, or
/// the colour at that low level that looks as the given one at 10 cd/m2.
enum class CaoDirection : std::uint8_t { appearance, compensation };

/// Describes one interpretation of the extrapolation in the thesis.
struct CaoReading {
  CaoExtrapolation extrapolation = CaoExtrapolation::logarithm;
  CaoDirection direction = CaoDirection::appearance;
};

/// Returns all readings: the appearance by each extrapolation, then the compensation by each.
std::span<const CaoReading> cao_readings();

/// Returns cao_weights() from 0.1 cd/m2 up, extrapolated weights below. @param luminance_cd_m2 > 0
CaoWeights extrapolated_cao_weights(double luminance_cd_m2, CaoExtrapolation extrapolation);

/// Returns the XYZ of a colour under the equal-energy light in a reading, without scaling.
Xyz cao_colour(const CaoReading& reading, double luminance_cd_m2, const Xyz& colour);

/// Selects chromaticity coordinates: x and y, or all three of x, y and z = 1 - x - y.
enum class Coordinates : std::uint8_t { xy, xyz };

/// Returns the highest level [cd/m2], within a hundredth of it, from 0.1 down to `lowest_cd_m2` at which a coordinate
/// of one of the colours is negative or one has no chromaticity; nullopt if there is none.
std::optional<double> negative_from_cd_m2(const CaoReading& reading, std::span<const Xyz> colours,
                                          Coordinates coordinates, double lowest_cd_m2);

/// Returns the findings on Cao's model extrapolated below 0.1 cd/m2, next to tracks of the ten chips by other models.
std::vector<Finding> cao_extrapolation_findings(const std::vector<NamedSpectrum>& chips,
                                                std::span<const AppearanceTracks> tracks);

}  // namespace lowlux::isp
