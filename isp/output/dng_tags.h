#pragma once

#include "isp/base/frame.h"

struct tiff;  // libtiff's open file

namespace lowlux::isp {

/// Teaches libtiff the tags of DNG 1.2 to 1.4 it does not know. To be called for the directory they are set in: libtiff
/// forgets them when it begins another.
void declare_dng_tags(tiff* file);

/// Sets ActiveArea, MaskedAreas, DefaultCrop and the black and white levels. Precondition: check_dng_frame.
void set_dng_levels(tiff* file, const RawDn& raw);

/// Sets matrices, illuminants, analogue gains and the as-shot white. Precondition: check_dng_frame.
void set_dng_colour(tiff* file, const CameraColour& colour);

/// Sets NoiseProfile and the opcode lists. Precondition: check_dng_frame.
void set_dng_noise_and_opcodes(tiff* file, const RawFrame& frame);

}  // namespace lowlux::isp
