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
/// GainMap and FixVignetteRadial of lists 2 and 3, FixBadPixelsList and FixBadPixelsConstant are kept; what else is
/// there becomes a warning that names it. Gains of list 3 are meant for demosaiced data: applied to the mosaic they
/// give the same picture where nothing clips, because demosaicing is linear and gains vary slowly.
///
/// @param list        1, 2 or 3: positions count from the readout (1) or the active area (2, 3)
/// @param linearized  the samples went through a LinearizationTable, which opcodes of list 1 precede
Result<void> read_opcodes(std::span<const std::byte> bytes, int list, bool linearized, RawFrame& frame);

}  // namespace lowlux::capture
