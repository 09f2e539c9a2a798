#pragma once

#include <array>

#include "tests/hard_cases/hard_case.h"

/// What the eye's look and the models of appearance make of frames.
namespace lowlux::hard_cases {

/// A field in linear Rec. 709, white 1, under some luminance of white.
struct SeenField {
  double cd_m2 = 1;
  std::array<float, 3> rgb{};
  double scotopic_ratio = 2.46;  // S/P of white
};

/// Largest difference of the parts of a grid from those in plain double; the field fades across the picture.
double look_against_reference(const SeenField& field, Denormals mode);

/// Pixels of a developed even field that are no numbers or not like the first one, to 1e-5; of black, not black.
double look_through_file(const SeenField& field, Denormals mode);

/// Codes of a stream of it that are not those of the developed file.
double look_through_live(const SeenField& field, Denormals mode);

/// Values that are no numbers in pictures of black, negative, saturated and coloured fields by every model.
double models_through_file(Denormals mode);

}  // namespace lowlux::hard_cases
