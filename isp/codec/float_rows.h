#pragma once

#include <cstddef>
#include <memory>
#include <span>
#include <vector>

namespace lowlux::isp {

/// Describes how the strips or tiles of a TIFF or DNG store floating-point samples (DNG 1.4, chapter 3, Floating Point
/// Image Data).
struct FloatStorage {
  int bits = 32;  // per sample: 16 and 32 as in IEEE 754; 24 has a sign, 7 bits of exponent (bias 63), 16 of mantissa
  bool deflated = false;    // zlib streams; else the samples themselves
  int predictor_step = 0;   // of deflated samples: bytes from one to the one it is predicted from; 0: no predictor
  bool big_endian = false;  // byte order of samples that have no predictor
};

/// Returns the greatest number of bytes that a zlib stream of `bytes` can expand to: 1032 for each (zlib's manual).
constexpr std::size_t max_inflated_bytes(std::size_t bytes) { return 1032 * bytes; }

/// Reads rows of samples from strips or tiles, one after another. Memory is that of one row.
///
/// With a predictor a row is stored as its samples' bytes of most weight, then those of the next weight, and so on;
/// each byte as the difference from the byte `predictor_step` before (Adobe Photoshop TIFF Technical Note 3).
class FloatRows {
 public:
  /// @param row_samples  of a strip or tile, at least 1
  FloatRows(const FloatStorage& storage, std::size_t row_samples);
  FloatRows(const FloatRows&) = delete;
  FloatRows& operator=(const FloatRows&) = delete;
  ~FloatRows();

  /// Begins a strip or tile, whose bytes must stay until the next one.
  void open(std::span<const std::byte> part);
  /// Reads the next row of the part. Infinity and NaN are kept. @return false if the part is damaged or too short
  bool next(std::span<float> row);
  /// Returns whether the part ends within this number of further rows, with the checksum of its bytes if it has one.
  bool ends_within(int rows);

 private:
  struct Inflater;

  FloatStorage storage_;
  std::size_t row_samples_;
  std::vector<std::byte> inflated_;  // one row
  std::span<const std::byte> rest_;  // of a part that is not deflated
  std::unique_ptr<Inflater> inflater_;
};

}  // namespace lowlux::isp
