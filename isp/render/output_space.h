#pragma once

#include <array>
#include <optional>
#include <string_view>

#include "isp/base/image.h"
#include "isp/base/matrix3.h"
#include "isp/model/colour/colorimetry.h"

namespace lowlux::isp {

/// Pairs an output space with its name on the command line.
struct NamedOutputSpace {
  OutputSpace space;
  std::string_view name;
};

inline constexpr std::array<NamedOutputSpace, 7> output_spaces{{{OutputSpace::srgb, "srgb"},
                                                                {OutputSpace::display_p3, "p3"},
                                                                {OutputSpace::rec2020, "rec2020"},
                                                                {OutputSpace::linear_srgb, "linear-srgb"},
                                                                {OutputSpace::linear_rec2020, "linear-rec2020"},
                                                                {OutputSpace::xyz, "xyz"},
                                                                {OutputSpace::camera, "camera"}}};

std::string_view name_of(OutputSpace space);

/// D65 is the white of every space but `camera`.
inline constexpr Xy output_white = white_d65;

/// Returns the matrix from XYZ under output_white (Y = 1 at white) to linear values of the space, white at (1, 1, 1);
/// identity for `xyz`, nullopt for `camera`, which has no known primaries.
std::optional<Matrix3> xyz_to_output(OutputSpace space);

/// Returns the weights w of luminance in the space's linear values, Y = w . value, 1 at white; (0, 1, 0) for `xyz`,
/// nullopt for `camera`.
std::optional<Vector3> luminance_weights(OutputSpace space);

/// Converts a display-linear value to a code value, both 0..1 for the displayable range; negative values by odd
/// symmetry.
///     srgb, p3:  12.92 v for v <= 0.0031308, else 1.055 v^(1/2.4) - 0.055         (IEC 61966-2-1)
///     rec2020:   4.5 v for v < b, else a v^0.45 - (a - 1)                         (BT.2020, table 4)
///     others:    v
/// with a = 1.0993, b = 0.0181, BT.2020's rounding for 12 bits. Its published constants leave a step of 1e-5 at b.
double encode_transfer(OutputSpace space, double linear);

/// Inverts encode_transfer. In the step of the Rec.2020 curve it takes the code value of b as the border.
double decode_transfer(OutputSpace space, double code);

/// Returns the matrix that moves linear colours away from the neutral of their luminance, or to it: out = Y + factor
/// (rgb
/// - Y). Luminance and neutrals stay as they are.
/// @param luminance  weights of Y, sum 1
Matrix3 saturation_matrix(double factor, const Vector3& luminance);

}  // namespace lowlux::isp
