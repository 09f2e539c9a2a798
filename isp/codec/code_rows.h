#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include "isp/codec/stored_rows.h"

namespace lowlux::isp {

/// Reads rows of integer samples of 8 to 16 bits from strips or tiles, one after another. Memory is that of one row.
///
/// Samples of 8 and 16 bits are complete bytes; others are packed, the most significant bit first, and rows begin at
/// bytes (TIFF 6.0, FillOrder 1; DNG 1.4, BitsPerSample). With a predictor a sample of 8 or 16 bits is stored as the
/// difference from the one `predictor_step` samples before (TIFF 6.0, section 14).
class CodeRows {
 public:
  /// @param row_samples  samples of a row of a strip or tile, at least 1
  CodeRows(const RowStorage& storage, std::size_t row_samples);

  /// Returns the bytes of a row.
  static std::size_t row_bytes(int bits, std::size_t row_samples) {
    return (row_samples * static_cast<std::size_t>(bits) + 7) / 8;
  }

  /// Begins a strip or tile, whose bytes must stay until the next one.
  void open(std::span<const std::byte> part) { rows_.open(part); }
  /// Reads the next row of the part. @return false if the part is damaged or too short
  bool next(std::span<std::uint16_t> row);
  /// Returns whether the part ends within this number of further rows, with the checksum of its bytes if it has one.
  bool ends_within(int rows) { return rows_.ends_within(rows); }

 private:
  RowStorage storage_;
  std::size_t row_samples_;
  StoredRows rows_;
};

}  // namespace lowlux::isp
