#pragma once

#include <cstddef>
#include <span>
#include <string>
#include <vector>

#include "isp/base/frame.h"
#include "isp/base/result.h"

namespace lowlux::capture {

/// Reads a DNG opcode list (DNG 1.4, chapter 7) into the corrections of a frame. Precondition: the geometry, layout,
/// phase and samples of `frame.raw` are filled.
///
/// GainMap and FixVignetteRadial of lists 2 and 3, FixBadPixelsList and FixBadPixelsConstant are kept; every other
/// opcode becomes a warning that names it. Gains of list 3 are meant for demosaiced data: applied to the mosaic they
/// give the same image where nothing clips, because demosaicing is linear and gains vary slowly. Opcodes that are not
/// applied become warnings whether the file marks them optional or not: the image without them is still useful.
///
/// The opcodes of a list build on each other, so a list is applied completely or not at all: on an error, which names
/// the damaged value or the exceeded limit, `frame` stays as it was. A list holds up to 64 opcodes, the frame up to 64
/// gains and 2^20 defects; pixels of all constants of a list are found in one pass. Constants of more than a sixteenth
/// of the active pixels are not applied, with a warning.
///
/// @param list        1, 2 or 3: positions count from the readout (1) or the active area (2, 3)
/// @param linearized  whether the samples went through a LinearizationTable, which opcodes of list 1 precede
Result<void> read_opcodes(std::span<const std::byte> bytes, int list, bool linearized, RawFrame& frame);

}  // namespace lowlux::capture
