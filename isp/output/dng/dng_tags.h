#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "isp/base/frame.h"

struct tiff;  // libtiff's open file

namespace lowlux::isp {

/// Declares the tags of DNG 1.2 to 1.4 that libtiff does not know. Call it for the directory they are set in: libtiff
/// drops them when it begins another.
void declare_dng_tags(tiff* file);

/// Sets ActiveArea, MaskedAreas, DefaultCrop and the black and white levels. Precondition: check_dng_frame.
void set_dng_levels(tiff* file, const RawDn& raw);

/// Sets matrices, illuminants, analogue gains and the as-shot white. Precondition: check_dng_frame.
void set_dng_colour(tiff* file, const CameraColour& colour);

/// Sets NoiseProfile, the noise ratio (noise_ratio_bytes.h) and the opcode lists. Precondition: check_dng_frame.
void set_dng_noise_and_opcodes(tiff* file, const RawFrame& frame);

/// Holds the corrections of a frame as the opcode lists of DNG 1.4 (chapter 7); empty where there is nothing to
/// correct.
struct OpcodeLists {
  std::vector<std::byte> first;   // OpcodeList1, on the readout: FixBadPixelsList
  std::vector<std::byte> second;  // OpcodeList2, on values without black: GainMap, FixVignetteRadial
};

OpcodeLists opcode_lists(const RawFrame& frame);

/// Returns the LightSource of EXIF 2.32 whose colour temperature is nearest in 1/T, as camera matrices are
/// interpolated; the candidates are the CIE illuminants A, B, C, D50, D55, D65, D75 and F2, the ISO studio tungsten
/// lamp, and the centres of EXIF's ranges for fluorescent lamps. 0 (unknown) unless the temperature is positive and
/// finite.
std::uint16_t light_source_of(double cct_k);

}  // namespace lowlux::isp
