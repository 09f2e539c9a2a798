#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <span>

#include "capture/dng/tiff_directory.h"
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

}  // namespace lowlux::capture
