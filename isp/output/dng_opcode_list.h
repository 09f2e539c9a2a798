#pragma once

#include <cstddef>
#include <vector>

#include "isp/base/frame.h"

namespace lowlux::isp {

/// The corrections of a frame as the opcode lists of DNG 1.4 (chapter 7); empty where there is nothing to correct.
struct OpcodeLists {
  std::vector<std::byte> first;   // OpcodeList1, on the readout: FixBadPixelsList
  std::vector<std::byte> second;  // OpcodeList2, on values without black: GainMap, FixVignetteRadial
};

OpcodeLists opcode_lists(const RawFrame& frame);

}  // namespace lowlux::isp
