#pragma once

#include <array>
#include <cstdint>

namespace lowlux {

enum class CfaColour : std::uint8_t { red, green, blue };

/// Lists the phases of a Bayer mosaic, named by the colours of its first 2x2 cell, row by row:
///     rggb  R G    grbg  G R    gbrg  G B    bggr  B G
///           G B          B G          R G          G R
/// Bit 0 of the enumerator states that red lies in odd columns, bit 1 that red lies in odd rows.
enum class BayerPhase : std::uint8_t { rggb = 0, grbg = 1, gbrg = 2, bggr = 3 };

/// Both functions return the position (0 or 1) of red in the 2x2 cell: its column and its row.
constexpr int red_column(BayerPhase phase) { return static_cast<int>(phase) & 1; }
constexpr int red_row(BayerPhase phase) { return static_cast<int>(phase) >> 1; }

/// Returns the colour of the site at column x, row y, both >= 0.
constexpr CfaColour colour_at(BayerPhase phase, int x, int y) {
  const bool in_red_column = (x & 1) == red_column(phase);
  const bool in_red_row = (y & 1) == red_row(phase);
  if (in_red_column && in_red_row) return CfaColour::red;
  return in_red_column || in_red_row ? CfaColour::green : CfaColour::blue;
}

/// Returns the phase of a crop whose corner is at (x, y) of a mosaic of this phase.
constexpr BayerPhase phase_of_crop(BayerPhase phase, int x, int y) {
  return static_cast<BayerPhase>(static_cast<int>(phase) ^ (x & 1) ^ ((y & 1) << 1));
}

/// Returns the index 0..3 of a site in its 2x2 cell: 2 * (y mod 2) + x mod 2. All per-site figures are in this order.
constexpr int site_of(int x, int y) { return ((y & 1) << 1) | (x & 1); }

template <class T>
using PerSite = std::array<T, 4>;

template <class T>
constexpr double mean_of_sites(const PerSite<T>& of_site) {
  return static_cast<double>(of_site[0] + of_site[1] + of_site[2] + of_site[3]) / 4;
}

}  // namespace lowlux
