#pragma once

#include <array>
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

/// Holds the corrections of a frame as the opcode lists of DNG 1.7 (chapter 7), OpcodeList1 to 3: FixBadPixelsList, on
/// the readout; GainMap and FixVignetteRadial, on values without black; and what the reader of the frame did not apply.
/// Lists without opcodes are empty.
using OpcodeLists = std::array<std::vector<std::byte>, 3>;

OpcodeLists opcode_lists(const RawFrame& frame);

/// Returns the version of DNG that readers must know for the opcodes that they may not skip: 0x01030000 for 1.3; 0 if
/// there are none.
std::uint32_t opcodes_version(const RawCorrections& corrections);

/// Returns the LightSource of EXIF 2.32 whose colour temperature is nearest in 1/T, as camera matrices are
/// interpolated; the candidates are the CIE illuminants A, B, C, D50, D55, D65, D75 and F2, the ISO studio tungsten
/// lamp, and the centres of EXIF's ranges for fluorescent lamps. 0 (unknown) unless the temperature is positive and
/// finite.
std::uint16_t light_source_of(double cct_k);

}  // namespace lowlux::isp
