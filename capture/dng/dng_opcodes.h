#pragma once

#include <cstddef>
#include <span>
#include <string>
#include <vector>

#include "isp/base/frame.h"
#include "isp/base/result.h"

namespace lowlux::capture {

/// States what the samples went through before the opcodes are read.
struct SampleState {
  bool linearized = false;   // a LinearizationTable, which opcodes of list 1 precede
  bool polynomials = false;  // MapPolynomial of list 2
  bool is_x_trans = false;   // one for each site, of a frame that will have three planes
};

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
/// @param samples     which opcodes of list 1 and 2 the samples went through
Result<void> read_opcodes(std::span<const std::byte> bytes, int list, SampleState samples, RawFrame& frame);

/// Holds a MapPolynomial opcode: the sum of coefficient[i] x^i, for planes first_plane to first_plane + planes - 1.
struct Polynomial {
  int first_plane = 0, planes = 1;
  std::vector<double> coefficient;

  bool applies_to(int plane) const { return plane >= first_plane && plane - first_plane < planes; }
};

/// Returns the MapPolynomial opcodes of a list, in their order; other opcodes are skipped. Errors: a damaged list, or
/// a polynomial that is damaged, has a degree above 8 or leaves out a part of the active area.
Result<std::vector<Polynomial>> read_polynomials(std::span<const std::byte> bytes, const Rect& active);

}  // namespace lowlux::capture
