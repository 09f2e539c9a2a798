#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "isp/codec/stored_rows.h"

namespace lowlux::isp {

/// Reads rows of floating-point samples from strips or tiles, one after another (DNG 1.4, chapter 3, Floating Point
/// Image Data). Memory is that of one row. Samples of 16 and 32 bits are those of IEEE 754; 24 bits are a sign, 7 bits
/// of exponent (bias 63) and 16 of mantissa.
///
/// With a predictor a row is stored as its samples' bytes of most weight, then those of the next weight, and so on;
/// each byte as the difference from the byte `predictor_step` before (Adobe Photoshop TIFF Technical Note 3).
class FloatRows {
 public:
  /// @param row_samples  samples of a row of a strip or tile, at least 1
  FloatRows(const RowStorage& storage, std::size_t row_samples);

  /// Returns the bytes of a row.
  static std::size_t row_bytes(int bits, std::size_t row_samples) {
    return row_samples * static_cast<std::size_t>(bits / 8);
  }

  /// Begins a strip or tile, whose bytes must stay until the next one.
  void open(std::span<const std::byte> part) { rows_.open(part); }
  /// Reads the next row of the part. Infinity and NaN are kept. @return false if the part is damaged or too short
  bool next(std::span<float> row);
  /// Returns whether the part ends within this number of further rows, with the checksum of its bytes if it has one.
  bool ends_within(int rows) { return rows_.ends_within(rows); }

 private:
  RowStorage storage_;
  std::size_t row_samples_;
  StoredRows rows_;
  std::vector<std::byte> restored_;  // one row without its predictor
};

}  // namespace lowlux::isp
