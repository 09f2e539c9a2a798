#pragma once

#include <vector>

#include "isp/raw/kernel/demosaic.h"
#include "tests/reference/raw_to_rgb_ref.h"

/// These functions compute what isp/raw/kernel/demosaic.h promises in plain double arithmetic, on whole frames, written
/// to be read against the papers that docs/references.md lists.
namespace lowlux::reference {

/// Returns linear camera RGB of all pixels, row by row, by any method. Measured samples keep their value.
/// @param clip  of the RgbTransform: values are limited to it before they are encoded
std::vector<Rgb> demosaiced(const LinearisedMosaic& mosaic, const isp::Demosaic& how, double clip);

}  // namespace lowlux::reference
