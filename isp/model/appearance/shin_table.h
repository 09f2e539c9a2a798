#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "isp/base/result.h"

namespace lowlux::isp {

/// Holds the coefficients of Shin's model at one level: for the achromatic signal (alpha: cones, beta: rods), the
/// red-green (l: cones, a: rods) and the blue-yellow one (m, b). In daylight alpha = l = m = 1, beta = a = b = 0.
struct ShinCoefficients {
  double alpha = 1;
  double beta = 0;
  double l = 1;
  double a = 0;
  double m = 1;
  double b = 0;
};

inline constexpr std::string_view shin_substitute_name = "SHIN-SUB-1";

/// Holds coefficients over E, the illuminance of a white surface [lx] (or luminance, see ShinUnits). Made by
/// read_shin_table() or shin_substitute(), so that nodes rise.
struct ShinTable {
  struct Node {
    double e = 0;
    ShinCoefficients coefficients;
  };
  std::string name;         // origin of the figures, for reports
  std::vector<Node> nodes;  // E rising; empty: the closed forms of SHIN-SUB-1
};

/// Reads a table from text: '#' comments, then lines of E and six numbers alpha, beta, l, a, m, b, separated by commas
/// or blanks; a first line of words is skipped. Errors: malformed for another number of columns, for a value that is
/// not a finite number, E that does not rise or is not positive, fewer than two lines; too_large above 1000 lines. The
/// message states the line.
Result<ShinTable> read_shin_table(std::string_view text, std::string name);

/// Returns the substitute for Table 1 of Shin et al., which was not available: closed forms that end where theirs do
/// and fade between as their abstract describes, not their figures. With E,
///     alpha = m of CIE 191 at L_p = E, L_s = 2.26 E;  beta = 1 - alpha;  a = b = 0
///     l = 0.1 + 0.9 clamp((log10 E + 1) / 4, 0, 1),   m = 0.1 + 0.9 clamp(log10 E / 3, 0, 1)
const ShinTable& shin_substitute();

/// Returns the coefficients at E, linear in log10 E between nodes, the outermost beyond. @param e > 0
ShinCoefficients shin_coefficients(const ShinTable& table, double e);

}  // namespace lowlux::isp
