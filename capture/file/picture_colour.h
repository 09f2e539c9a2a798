#pragma once

#include <array>
#include <cstddef>
#include <span>
#include <vector>

#include "isp/base/matrix3.h"
#include "isp/base/result.h"
#include "isp/codec/picture_file.h"

namespace lowlux::capture {

/// Colour of the codes of a display image: XYZ = to_xyz * (curve[0][R], curve[1][G], curve[2][B]) under D65, Y = 1 for
/// the white of the display.
struct DisplayColour {
  std::array<std::vector<float>, 3> curve;  // linear light 0..1 of each code
  Matrix3 to_xyz{};
  bool grey = false;  // the profile is for grey: it describes only R = G = B
};

/// Returns sRGB (IEC 61966-2-1, with its linear segment) for codes 0..codes-1.
DisplayColour srgb_colour(int codes);

/// Reads an ICC profile of the matrix type (three curves, three colorants) or of grey: relative colorimetric, PCS D50
/// adapted to D65 by Bradford. Others are rejected, including those that hold only tables.
/// @param codes  2 or more
Result<DisplayColour> icc_colour(std::span<const std::byte> bytes, int codes);

/// Returns the matrix from linear RGB to XYZ with RGB (1, 1, 1) at Y = 1 (SMPTE RP 177). Unlike isp::rgb_to_xyz it
/// accepts imaginary primaries, such as ACES AP0 and the axes of XYZ. Fails if they lie on one line, or white has no
/// XYZ.
Result<Matrix3> primaries_to_xyz(const isp::Chromaticities& primaries);

}  // namespace lowlux::capture
