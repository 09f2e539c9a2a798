#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>

#include "isp/base/cfa.h"

namespace lowlux::capture {

inline constexpr int x_trans_period = 6;  // period of the pattern, in columns and in rows

/// States where the corner of an X-Trans mosaic lies in the pattern of 6 x 6 sites of x_trans_pattern.cpp: column and
/// row, 0 to 5. Of the 36 phases each has the same colours as one other, three columns and three rows away.
struct XTransPhase {
  int x = 0;
  int y = 0;
  friend bool operator==(const XTransPhase&, const XTransPhase&) = default;
};

/// Returns the colour of the site at column x, row y; both may be negative.
CfaColour colour_at(const XTransPhase& phase, int x, int y);

/// Returns the phase of a crop whose corner is at (x, y) of a mosaic of this phase.
XTransPhase phase_of_crop(const XTransPhase& phase, int x, int y);

/// Returns the first phase of a pattern of 36 colours (0 red, 1 green, 2 blue; row after row); nullopt if it is not
/// X-Trans, or has another size.
std::optional<XTransPhase> x_trans_phase(std::span<const std::uint8_t> pattern);

}  // namespace lowlux::capture
