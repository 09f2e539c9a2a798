#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <span>
#include <string>
#include <vector>

#include "capture/dng/tiff_directory.h"
#include "isp/base/frame.h"
#include "isp/base/result.h"

namespace lowlux::capture {

/// Reads consecutive big-endian numbers. Beyond the end it returns zeros and sets a flag.
class OpcodeReader {
 public:
  explicit OpcodeReader(std::span<const std::byte> bytes) : bytes_(bytes) {}

  std::uint32_t u32() { return take(4) ? load_u32(bytes_.data() + at_ - 4, true) : 0; }
  double f64() { return take(8) ? load_f64(bytes_.data() + at_ - 8, true) : 0; }
  float f32() { return take(4) ? load_f32(bytes_.data() + at_ - 4, true) : 0; }
  std::span<const std::byte> block(std::size_t size) {
    return take(size) ? bytes_.subspan(at_ - size, size) : std::span<const std::byte>{};
  }
  std::size_t left() const { return bytes_.size() - at_; }
  bool complete() const { return complete_; }

 private:
  bool take(std::size_t size) {
    if (size > left()) {
      complete_ = false;
      return false;
    }
    at_ += size;
    return true;
  }

  std::span<const std::byte> bytes_;
  std::size_t at_ = 0;
  bool complete_ = true;
};

/// Calls `use` with the number and the parameters of each opcode of OpcodeList1 to 3. It ends with the first error:
/// that of `use`, or of a list that is damaged or holds more than 64 opcodes.
Result<void> each_opcode(std::span<const std::byte> bytes, int list,
                         const std::function<Result<void>(std::uint32_t, std::span<const std::byte>)>& use);

/// States what the samples went through before the opcodes are read.
struct SampleState {
  bool linearized = false;   // a LinearizationTable, which opcodes of list 1 precede
  bool polynomials = false;  // MapPolynomial of list 2
  bool is_x_trans = false;   // one for each site, of a frame that will have three planes
};

/// Reads a DNG opcode list (DNG 1.4, chapter 7) into the corrections of a frame. Precondition: the geometry, layout,
/// phase and samples of `frame.raw` are filled.
///
/// GainMap, ScalePerRow, ScalePerColumn (as gain maps with a point in each row or column) and FixVignetteRadial of
/// lists 2 and 3, FixBadPixelsList and FixBadPixelsConstant are kept; every other opcode becomes a warning that names
/// it. Gains of list 3 are meant for demosaiced data: applied to the mosaic they give the same image where nothing
/// clips, because demosaicing is linear and gains vary slowly. Opcodes that are not applied become warnings whether the
/// file marks them optional or not: the image without them is still useful.
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
