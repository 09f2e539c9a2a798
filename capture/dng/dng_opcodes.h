#pragma once

#include <cstddef>
#include <span>

#include "capture/dng/dng_storage.h"
#include "isp/base/frame.h"
#include "isp/base/result.h"

namespace lowlux::capture {

/// Reads a DNG opcode list (DNG 1.7, chapter 7). Lists 1 and 2 change the samples and levels of the frame; gains and
/// defects become its corrections. Precondition: the geometry, layout, phase, levels and samples of `frame.raw` are
/// filled, for list 1 with the codes that the file stores, for lists 2 and 3 after LinearizationTable.
///
/// | opcode | list 1, on codes | list 2, on fractions of white | list 3 |
/// |---|---|---|---|
/// | GainMap, FixVignetteRadial, ScalePerRow, ScalePerColumn | changes codes | correction | correction |
/// | DeltaPerRow, DeltaPerColumn | changes codes | changes the black level | not applied |
/// | MapTable, MapPolynomial | changes codes | changes samples (change_fractions) | not applied |
/// | FixBadPixelsList | correction | correction | correction |
/// | FixBadPixelsConstant | correction | not applied | not applied |
/// | TrimBounds, as the last opcode of all lists | not applied | crop | crop |
///
/// Gains of list 3 are meant for demosaiced data: applied to the mosaic they give the same image where nothing clips,
/// because demosaicing is linear and gains vary slowly. Gains of list 2 are applied later than its deltas and maps, in
/// whatever order they are listed: a function f that follows a gain g becomes f(g v) / g.
///
/// What is not applied becomes a warning, whether the file marks it optional or not, because the image without it is
/// still useful, and RawCorrections::not_applied if a DNG of the frame is to state it again. That excludes list 1 and
/// constants, which refer to codes that no other file has, and positions in mosaics that are interpolated or binned.
///
/// A list is applied completely or not at all: on an error, which names the damaged value or the exceeded limit,
/// `frame` stays as it was. A list holds up to 64 opcodes, the frame up to 64 gains and 2^20 defects; pixels of all
/// constants of a list are found in one pass. Constants of more than a sixteenth of the active pixels are not applied,
/// with a warning.
///
/// @param list     1, 2 or 3: positions count from the readout (1) or the active area (2, 3)
/// @param is_last  whether the file has no later list
Result<void> read_opcodes(std::span<const std::byte> bytes, int list, bool is_last, const DngImage& image,
                          RawFrame& frame);

}  // namespace lowlux::capture
