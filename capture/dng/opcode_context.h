#pragma once

#include <array>
#include <bitset>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "capture/dng/dng_storage.h"
#include "capture/dng/sample_changes.h"
#include "capture/dng/tiff_directory.h"
#include "isp/base/frame.h"
#include "isp/base/result.h"

namespace lowlux::capture {

/// Lists the opcodes of DNG 1.7, chapter 7.
enum OpcodeId : std::uint32_t {
  warp_rectilinear = 1,
  warp_fisheye,
  fix_vignette_radial,
  fix_bad_pixels_constant,
  fix_bad_pixels_list,
  trim_bounds,
  map_table,
  map_polynomial,
  gain_map,
  delta_per_row,
  delta_per_column,
  scale_per_row,
  scale_per_column,
  warp_rectilinear2
};

/// Reads consecutive big-endian numbers. Beyond the end it returns zeros and sets a flag.
class OpcodeReader {
 public:
  explicit OpcodeReader(std::span<const std::byte> bytes) : bytes_(bytes) {}

  std::uint16_t u16() { return take(2) ? load_u16(bytes_.data() + at_ - 2, true) : std::uint16_t{0}; }
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

/// Holds an opcode in the bytes of its list.
struct Opcode {
  std::uint32_t id = 0, version = 0, flags = 0;
  std::span<const std::byte> parameters;
  bool is_last = false;  // of all lists

  std::string name() const;  // in messages
  bool is_warp() const { return id == warp_rectilinear || id == warp_fisheye || id == warp_rectilinear2; }
  bool is_of_rows() const { return id == delta_per_row || id == scale_per_row; }
};

/// State of one list while it is read. Its results are added to the frame only when all of the list has been read.
struct OpcodeContext {
  int list;
  const DngImage& image;
  const RawFrame& frame;
  RawCorrections found = {};
  std::vector<SampleChange> changes = {};  // of lists 1 and 2
  std::vector<SampleChange> gains = {};    // of list 2, which are also in `found`
  std::size_t functions = 0;               // that `changes` evaluate for a sample
  std::bitset<65536> constants = {};       // values of defective pixels
  std::optional<Rect> trimmed = {};
  bool follows_trim = false;  // positions count from the corner of a TrimBounds that is not applied
  std::vector<std::string> warnings = {};

  std::string tag() const;  // of the list
  /// Returns the planes of the image that the list changes.
  int planes() const { return list < 3 ? image.samples : image.layout == SensorLayout::monochrome ? 1 : 3; }
  Rect area() const {
    const Rect& active = frame.raw.active;
    return list == 1 ? Rect{0, 0, image.width, image.height} : Rect{0, 0, active.width, active.height};
  }
  /// Adds the warning of an opcode that is not applied. It is kept where a DNG of the frame is to state it again.
  Result<void> not_applied(const Opcode& opcode, const std::string& why = {});
  tl::unexpected<Error> damaged(const Opcode& opcode, const std::string& why = {}) const;
  /// Returns an error if the frame would have more gains than any camera writes.
  Result<void> check_gains(std::size_t more) const;
};

/// Returns a number as an int that can be added to others.
int small(std::uint32_t value);

/// Reads a gain map, scales or deltas of rows or columns, a radial gain, a polynomial or a table into the context.
/// Errors: those that OpcodeContext::damaged and check_gains make.
Result<void> read_value_opcode(OpcodeContext& context, const Opcode& opcode);

/// Returns whether read_value_opcode reads an opcode.
bool changes_values(std::uint32_t id);

}  // namespace lowlux::capture
