#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "isp/codec/stored_rows.h"

namespace lowlux::isp {

/// Reads the samples of lossless JPEGs (ITU-T T.81, process 14), one for each strip or tile, in rows of any length:
/// DNG lets the lines of a JPEG differ from the rows of its tile. Memory is that of one row and two lines.
///
/// Files of DNG 1.0 have 16 bits after the code of category 16, the difference 32768; T.81 and later files have none
/// (fLosslessJPEGBug16 of Adobe's DNG SDK, ljpeg_diff of LibRaw).
///
/// 1 to 4 components that are not subsampled, any predictor, restart intervals of whole lines; no point transform.
class LosslessJpegRows {
 public:
  /// @param row_samples  samples of a row of a strip or tile, at least 1
  LosslessJpegRows(const RowStorage& storage, std::size_t row_samples);

  /// Begins a strip or tile, whose bytes must stay until the next one.
  void open(std::span<const std::byte> part);
  /// Returns the number of samples that the headers of the part state; 0 if they are damaged or of another form.
  std::size_t samples() const { return good_ ? lines_ * line_.size() : 0; }
  /// Reads the next row of the part. @return false if the part is damaged or too short, or has samples of too many bits
  bool next(std::span<std::uint16_t> row);
  /// Returns true: what follows the last row that is needed is not decoded.
  static bool ends_within(int /*rows*/) { return true; }

 private:
  static constexpr int max_components = 4;

  /// A Huffman table (T.81, annex C): `quick` holds category + 256 * length of the code that begins with these bits.
  struct Table {
    std::array<std::uint16_t, 512> quick{};
    std::array<int, 17> max_code{};  // largest code of each length; -1: there is none
    std::array<int, 17> first{};     // position of a length's code 0 in `categories`; may be negative
    std::vector<std::uint8_t> categories;
  };
  struct Segments;

  bool read_headers(std::span<const std::byte> part);
  bool read_tables(std::span<const std::byte> segment);
  bool read_frame(std::span<const std::byte> segment);
  bool read_scan(std::span<const std::byte> segment);
  bool decode_line();
  bool restart();
  void fill();
  std::uint32_t peek(int count) const { return static_cast<std::uint32_t>(bits_ >> (bit_count_ - count)); }
  std::optional<int> difference(const Table& table);

  int bits_per_sample_;
  bool has_bits_of_category_16_;
  std::size_t row_samples_;

  std::array<Table, 4> tables_;
  std::array<int, max_components> table_of_{};
  int precision_ = 0, components_ = 0, predictor_ = 0;
  std::size_t lines_ = 0, columns_ = 0, restart_interval_ = 0;  // the last in columns; 0: none

  bool good_ = false;
  std::vector<std::uint16_t> line_, above_;   // columns x components
  std::size_t decoded_lines_ = 0, used_ = 0;  // samples of line_ that were handed out

  std::span<const std::byte> data_;  // data of the scan
  std::size_t at_ = 0;
  std::uint64_t bits_ = 0;  // the lowest `bit_count_` were read and not used; the last `padding_` follow the data
  int bit_count_ = 0, padding_ = 0;
};

}  // namespace lowlux::isp
