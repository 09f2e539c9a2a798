#pragma once

#include <cstddef>
#include <memory>
#include <optional>
#include <span>
#include <vector>

namespace lowlux::isp {

/// Describes how the strips or tiles of a TIFF or DNG store samples that are uncompressed or deflated.
struct RowStorage {
  int bits = 16;            // per sample
  bool deflated = false;    // zlib streams; else the samples themselves
  int predictor_step = 0;   // bytes of floats or samples of codes to the one that predicts it; 0: no predictor
  bool big_endian = false;  // byte order of codes of 16 bits, and of floats without a predictor
  bool has_bits_of_category_16 = false;  // lossless JPEG of DNG 1.0
};

/// Returns the greatest number of bytes that a zlib stream of `bytes` can expand to: 1032 for each (zlib's manual).
constexpr std::size_t max_inflated_bytes(std::size_t bytes) { return 1032 * bytes; }

/// Reads the bytes of rows from strips or tiles, one after another. Memory is that of one row.
class StoredRows {
 public:
  /// @param row_bytes  bytes of a strip or tile, at least 1
  StoredRows(bool deflated, std::size_t row_bytes);
  StoredRows(const StoredRows&) = delete;
  StoredRows& operator=(const StoredRows&) = delete;
  ~StoredRows();

  /// Begins a strip or tile, whose bytes must stay until the next one.
  void open(std::span<const std::byte> part);
  /// Returns the next row of the part, until the next call; nullopt if the part is damaged or too short.
  std::optional<std::span<const std::byte>> next();
  /// Returns whether the part ends within this number of further rows, with the checksum of its bytes if it has one.
  bool ends_within(int rows);

 private:
  struct Inflater;

  std::size_t row_bytes_;
  std::vector<std::byte> inflated_;  // one row
  std::span<const std::byte> rest_;  // rest of a part that is not deflated
  std::unique_ptr<Inflater> inflater_;
};

}  // namespace lowlux::isp
