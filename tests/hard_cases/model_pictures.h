#pragma once

#include <string_view>

#include "tests/hard_cases/hard_case.h"

/// What models of appearance make of pictures, as `lowlux develop --look MODEL` has it.
namespace lowlux::hard_cases {

inline constexpr std::string_view through_tables = "images are processed by a table of the model: see tables of models";
inline constexpr std::string_view no_models = "streams support the looks camera and eye only";

/// A row of a model's figures for one colour.
void model_row(const About& about, const Bound& bound, const Measure& measure);

/// Values that are no numbers in pictures of black, negative, saturated and coloured fields by every model.
double models_through_file(Denormals mode);

/// Colours through every model's table: largest difference from the table in plain double, over the sum of a colour's
/// magnitudes times what the table makes of a grey's.
double tables_against_reference(Denormals mode);

/// Developed patches of colours against the model itself: the CIEDE2000, of the worst model and light, that all but a
/// hundredth of the colours stay below, and five standard errors of that share.
double pictures_against_models(Denormals mode);

}  // namespace lowlux::hard_cases
