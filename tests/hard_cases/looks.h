#pragma once

#include <span>

#include "isp/model/colour/colorimetry.h"
#include "tests/hard_cases/hard_case.h"
#include "tests/hard_cases/rec709_camera.h"

/// What the eye's look makes of frames.
namespace lowlux::hard_cases {

/// An even field in linear Rec. 709, white 1, under some light.
struct SeenField {
  double cd_m2 = 1;  // luminance of white
  Rec709 rgb{};
  isp::Xyz light{0.95047, 1, 1.08883};  // of white, as it is in the scene; a camera sees it as 1, 1, 1
};

/// Largest difference of the parts of a grid from those in plain double; the field fades across the picture.
double look_against_reference(std::span<const SeenField> fields, Denormals mode);

/// Largest difference of developed fields, without a tone curve, from what the look in plain double makes of them.
double look_through_file(std::span<const SeenField> fields, Denormals mode);

/// The same of streams in 8-bit codes, without rounding those expected.
double look_through_live(std::span<const SeenField> fields, Denormals mode);

}  // namespace lowlux::hard_cases
