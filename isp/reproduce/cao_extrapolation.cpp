#include "isp/reproduce/cao_extrapolation.h"

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>
#include <cstddef>
#include <optional>
#include <string>

#include <fmt/format.h>

#include "isp/model/spectrum/cie_data.h"
#include "isp/model/vision/mesopic.h"
#include "isp/reproduce/mesopic_agreement.h"

namespace lowlux::isp {
namespace {

constexpr double low_cd_m2 = 0.1, middle_cd_m2 = 0.62;  // the last two levels with published weights
constexpr double photopic_cd_m2 = 10;
constexpr double lowest_level_cd_m2 = 1e-6;  // darker than the absolute threshold of rods

constexpr std::array<CaoReading, 6> all_readings{{{CaoExtrapolation::logarithm, CaoDirection::appearance},
                                                  {CaoExtrapolation::luminance, CaoDirection::appearance},
                                                  {CaoExtrapolation::power, CaoDirection::appearance},
                                                  {CaoExtrapolation::logarithm, CaoDirection::compensation},
                                                  {CaoExtrapolation::luminance, CaoDirection::compensation},
                                                  {CaoExtrapolation::power, CaoDirection::compensation}}};
constexpr std::size_t extrapolations = 3;
static_assert(all_readings.size() == 2 * extrapolations);

/// Returns the cones' signals in a reading; `rods` is 1 for the equal-energy white.
Matrix3 signals_at(double luminance_cd_m2, CaoExtrapolation extrapolation) {
  return cao_signals(extrapolated_cao_weights(luminance_cd_m2, extrapolation),
                     cao_receptors(identity3(), scotopic_weights));
}

bool is_negative(const Xyz& colour, Coordinates coordinates) {
  const auto xy = xy_of(colour);
  return !xy || xy->x < 0 || xy->y < 0 || (coordinates == Coordinates::xyz && colour.z < 0);
}

std::string onset_text(const std::optional<double>& level) {
  return level ? fmt::format("from {:.2g}", *level) : std::string("none");
}

/// Returns the levels from which x or y is negative by each extrapolation, and z where it is so elsewhere.
std::string onsets_text(std::span<const CaoReading> readings, std::span<const Xyz> colours) {
  constexpr std::array names{"logarithm", "linear", "power"};
  std::string out;
  for (const CaoReading& reading : readings) {
    const auto xy = negative_from_cd_m2(reading, colours, Coordinates::xy, lowest_level_cd_m2);
    const auto all = negative_from_cd_m2(reading, colours, Coordinates::xyz, lowest_level_cd_m2);
    if (!out.empty()) out += ", ";
    out += fmt::format("{} {}", names.at(static_cast<std::size_t>(reading.extrapolation)), onset_text(xy));
    if (all != xy) out += fmt::format(" (z {})", onset_text(all));
  }
  return out;
}

/// Returns in how many readings x or y is negative at some level.
std::ptrdiff_t negative_readings(std::span<const CaoReading> readings, std::span<const Xyz> colours) {
  return std::ranges::count_if(readings, [&](const CaoReading& reading) {
    return negative_from_cd_m2(reading, colours, Coordinates::xy, lowest_level_cd_m2).has_value();
  });
}

/// Returns the tracks of a patch in a reading, scaled to a white of Y = 1 as the published ones are.
AppearanceTracks tracks_in(const CaoReading& reading, const Xyz& colour) {
  AppearanceTracks out{"cao", {{}}};
  for (const double level : track_levels_cd_m2()) {
    const Xyz seen = cao_colour(reading, level, colour);
    const double white = cao_colour(reading, level, {1, 1, 1}).y;
    out.seen.front().push_back({seen.x / white, seen.y / white, seen.z / white});
  }
  return out;
}

constexpr const char* claim_of_negative =
    "Cao's weights, extrapolated below 0.1 cd/m2, make x or y negative near and below the scotopic limit (section 5.2)";

Finding negative_as_appearance(std::span<const Xyz> colours) {
  const auto as_seen = cao_readings().first(extrapolations);
  return {"mesopic-tracks/cao-negative",
          claim_of_negative,
          "negative",
          onsets_text(as_seen, colours),
          negative_readings(as_seen, colours) > 0,
          fmt::format("ten chips as they appear, from 0.1 down to {:.0e} cd/m2, by weights linear in the logarithm of "
                      "luminance, as they are interpolated, linear in luminance, or a power of it; the rods' signal is "
                      "added to all three cones and not subtracted",
                      lowest_level_cd_m2)};
}

Finding negative_as_compensation(std::span<const Xyz> colours) {
  const auto compensated = cao_readings().last(extrapolations);
  const std::ptrdiff_t negative = negative_readings(compensated, colours);
  return {"mesopic-tracks/cao-negative-inverse",
          std::string(claim_of_negative) + ", by the inverse model",
          "negative",
          onsets_text(compensated, colours) + " cd/m2",
          negative > 0,
          "colours at a low level that look as the ten chips at 10 cd/m2: the rods' signal is subtracted; x or y is "
          "negative by a power of luminance alone; which extrapolation and direction the thesis used is not known",
          Finding::Kind::published,
          negative < static_cast<std::ptrdiff_t>(extrapolations)};
}

/// Compares the patch of Table 5-1 in all readings with Shin's model.
Finding extrapolated_differences(const Xyz& colour, std::size_t patch, std::span<const AppearanceTracks> tracks) {
  constexpr double published = 256.33;
  const auto found = std::ranges::find(tracks, "shin", &AppearanceTracks::model);
  assert(found != tracks.end());
  const AppearanceTracks shin{"shin", {found->seen[patch]}};
  std::array<double, all_readings.size()> ours{};
  for (std::size_t i = 0; i < ours.size(); ++i) {
    ours[i] = mean_mutual_delta_e(tracks_in(all_readings[i], colour), shin, 0);
  }
  const auto [seen_least, seen_most] = std::ranges::minmax(std::span(ours).first(extrapolations));
  const auto inverted = std::span(ours).last(extrapolations);
  const auto [least, most] = std::ranges::minmax(ours);
  return {"mesopic-tracks/cao-extrapolated",
          "mean Delta E ab of Shin and the extrapolated Cao, 10GY 6/10 at 14 levels (Table 5-1)",
          fmt::format("{:.2f}", published),
          fmt::format("{:.2f} to {:.2f}; inverse {:.2f}, {:.2f}, {:.2f}", seen_least, seen_most, inverted[0],
                      inverted[1], inverted[2]),
          least <= published && published <= most,
          "as it appears, by three extrapolations, and by the inverse model with weights by logarithm, linear and by a "
          "power; only the last is of the published size: there x and y of the white itself are above 1 at the lowest "
          "level, so that the figure depends on the levels, of which only the ends are published",
          Finding::Kind::published,
          !std::ranges::any_of(ours, [](double delta_e) {
            return figures_agree({{published, delta_e}});
          })};
}

}  // namespace

std::span<const CaoReading> cao_readings() { return all_readings; }

CaoWeights extrapolated_cao_weights(double luminance_cd_m2, CaoExtrapolation extrapolation) {
  if (luminance_cd_m2 >= low_cd_m2) return cao_weights(luminance_cd_m2);
  const CaoWeights low = cao_weights(low_cd_m2), middle = cao_weights(middle_cd_m2);
  if (extrapolation == CaoExtrapolation::luminance) {
    const double t = (luminance_cd_m2 - low_cd_m2) / (middle_cd_m2 - low_cd_m2);
    return {std::lerp(low.k1, middle.k1, t), std::lerp(low.k2, middle.k2, t)};
  }
  const double t = std::log(luminance_cd_m2 / low_cd_m2) / std::log(middle_cd_m2 / low_cd_m2);
  if (extrapolation == CaoExtrapolation::power) {
    return {low.k1 * std::pow(middle.k1 / low.k1, t), low.k2 * std::pow(middle.k2 / low.k2, t)};
  }
  return {std::lerp(low.k1, middle.k1, t), std::lerp(low.k2, middle.k2, t)};
}

Xyz cao_colour(const CaoReading& reading, double luminance_cd_m2, const Xyz& colour) {
  const Matrix3 dim = signals_at(luminance_cd_m2, reading.extrapolation);
  const Matrix3 bright = signals_at(photopic_cd_m2, reading.extrapolation);
  const bool forward = reading.direction == CaoDirection::appearance;
  const auto back = inverse(forward ? bright : dim);
  if (!back) return {};  // black: it has no chromaticity
  return xyz_of(*back * ((forward ? dim : bright) * vector_of(colour)));
}

std::optional<double> negative_from_cd_m2(const CaoReading& reading, std::span<const Xyz> colours,
                                          Coordinates coordinates, double lowest_cd_m2) {
  constexpr double step = 1.01;
  for (double level = low_cd_m2; level >= lowest_cd_m2; level /= step) {
    const bool negative = std::ranges::any_of(
        colours, [&](const Xyz& colour) { return is_negative(cao_colour(reading, level, colour), coordinates); });
    if (negative) return level;
  }
  return std::nullopt;
}

std::vector<Finding> cao_extrapolation_findings(const std::vector<NamedSpectrum>& chips,
                                                std::span<const AppearanceTracks> tracks) {
  std::vector<Xyz> colours;
  colours.reserve(chips.size());
  for (const NamedSpectrum& chip : chips) colours.push_back(*xyz_of_reflectance(chip.spectrum, *light_named("E")));
  std::vector<Finding> out{negative_as_appearance(colours), negative_as_compensation(colours)};
  const auto patch =
      static_cast<std::size_t>(std::ranges::find(chips, agreement_chip, &NamedSpectrum::name) - chips.begin());
  out.push_back(extrapolated_differences(colours[patch], patch, tracks));
  return out;
}

}  // namespace lowlux::isp
