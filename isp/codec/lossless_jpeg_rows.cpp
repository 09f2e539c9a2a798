#include "isp/codec/lossless_jpeg_rows.h"

#include <algorithm>
#include <cassert>
#include <utility>

namespace lowlux::isp {
namespace {

constexpr int quick_bits = 9;
constexpr int max_category = 16;  // T.81 table H.2

int byte_at(std::span<const std::byte> bytes, std::size_t i) { return std::to_integer<int>(bytes[i]); }
int u16_at(std::span<const std::byte> bytes, std::size_t i) { return byte_at(bytes, i) << 8 | byte_at(bytes, i + 1); }

/// Returns the prediction from the samples to the left, above, and above the left one (T.81 table H.1).
int predict(int predictor, int a, int b, int c) {
  switch (predictor) {
    case 1:
      return a;
    case 2:
      return b;
    case 3:
      return c;
    case 4:
      return a + b - c;
    case 5:
      return a + ((b - c) >> 1);
    case 6:
      return b + ((a - c) >> 1);
    default:
      return (a + b) >> 1;
  }
}

}  // namespace

LosslessJpegRows::LosslessJpegRows(const RowStorage& storage, std::size_t row_samples)
    : bits_per_sample_(storage.bits),
      has_bits_of_category_16_(storage.has_bits_of_category_16),
      row_samples_(row_samples) {}

void LosslessJpegRows::open(std::span<const std::byte> part) {
  tables_ = {};
  lines_ = columns_ = restart_interval_ = decoded_lines_ = 0;
  bits_ = 0;
  bit_count_ = padding_ = 0;
  at_ = 0;
  good_ = read_headers(part);
  line_.assign(good_ ? columns_ * static_cast<std::size_t>(components_) : 0, 0);
  above_ = line_;
  used_ = line_.size();
}

bool LosslessJpegRows::read_headers(std::span<const std::byte> part) {
  if (part.size() < 4 || u16_at(part, 0) != 0xFFD8) return false;
  for (std::size_t at = 2; at + 4 <= part.size() && byte_at(part, at) == 0xFF;) {
    const int marker = byte_at(part, at + 1);
    if (marker == 0xFF) {  // a fill byte, T.81 B.1.1.2
      ++at;
      continue;
    }
    const auto length = static_cast<std::size_t>(u16_at(part, at + 2));
    if (length < 2 || length > part.size() - at - 2) return false;
    const auto segment = part.subspan(at + 4, length - 2);
    at += 2 + length;
    bool sound = true;
    if (marker == 0xC4) {
      sound = read_tables(segment);
    } else if (marker == 0xC3) {
      sound = lines_ == 0 && read_frame(segment);
    } else if (marker == 0xDD) {
      sound = segment.size() == 2;
      if (sound) restart_interval_ = static_cast<std::size_t>(u16_at(segment, 0));
    } else if (marker == 0xDA) {
      data_ = part.subspan(at);
      return lines_ > 0 && read_scan(segment) && restart_interval_ % columns_ == 0;
    } else {
      sound = marker >= 0xE0 || marker == 0xDB;  // APPn, comments, quantisation tables; no other frames
    }
    if (!sound) return false;
  }
  return false;
}

bool LosslessJpegRows::read_tables(std::span<const std::byte> segment) {
  while (segment.size() >= 17) {
    const int id = byte_at(segment, 0);
    if (id > 3) return false;
    Table& table = tables_[static_cast<std::size_t>(id)];
    table = {};
    int code = 0, count = 0;
    for (int length = 1; length <= 16; ++length, code <<= 1) {
      const int codes = byte_at(segment, static_cast<std::size_t>(length));
      if (code + codes > 1 << length) return false;
      table.first[static_cast<std::size_t>(length)] = count - code;
      table.max_code[static_cast<std::size_t>(length)] = codes > 0 ? code + codes - 1 : -1;
      code += codes;
      count += codes;
    }
    if (segment.size() < 17 + static_cast<std::size_t>(count)) return false;
    for (int i = 0; i < count; ++i) {
      const int category = byte_at(segment, 17 + static_cast<std::size_t>(i));
      if (category > max_category) return false;
      table.categories.push_back(static_cast<std::uint8_t>(category));
    }
    for (int length = 1; length <= quick_bits; ++length) {
      const auto of_length = static_cast<std::size_t>(length);
      const int shift = quick_bits - length, codes = byte_at(segment, of_length);
      for (int i = 0; i < codes; ++i) {
        const int value = table.max_code[of_length] - codes + 1 + i;
        const auto category = table.categories[static_cast<std::size_t>(table.first[of_length] + value)];
        std::fill_n(table.quick.begin() + (std::ptrdiff_t{value} << shift), std::ptrdiff_t{1} << shift,
                    static_cast<std::uint16_t>(category + 256 * length));
      }
    }
    segment = segment.subspan(17 + static_cast<std::size_t>(count));
  }
  return segment.empty();
}

bool LosslessJpegRows::read_frame(std::span<const std::byte> segment) {
  if (segment.size() < 6) return false;
  precision_ = byte_at(segment, 0);
  lines_ = static_cast<std::size_t>(u16_at(segment, 1));
  columns_ = static_cast<std::size_t>(u16_at(segment, 3));
  components_ = byte_at(segment, 5);
  if (precision_ < 2 || precision_ > 16 || lines_ == 0 || columns_ == 0) return false;
  if (components_ < 1 || components_ > max_components) return false;
  if (segment.size() != 6 + 3 * static_cast<std::size_t>(components_)) return false;
  for (std::size_t i = 0; i < static_cast<std::size_t>(components_) && components_ > 1; ++i) {
    if (byte_at(segment, 7 + 3 * i) != 0x11) return false;  // subsampled
  }
  return true;
}

bool LosslessJpegRows::read_scan(std::span<const std::byte> segment) {
  const auto count = static_cast<std::size_t>(components_);
  if (segment.size() != 4 + 2 * count || byte_at(segment, 0) != components_) return false;
  for (std::size_t i = 0; i < count; ++i) {
    table_of_[i] = byte_at(segment, 2 + 2 * i) >> 4;
    if (table_of_[i] > 3 || tables_[static_cast<std::size_t>(table_of_[i])].categories.empty()) return false;
  }
  predictor_ = byte_at(segment, 1 + 2 * count);
  const int point_transform = byte_at(segment, 3 + 2 * count) & 15;
  return predictor_ >= 1 && predictor_ <= 7 && point_transform == 0;
}

bool LosslessJpegRows::next(std::span<std::uint16_t> row) {
  assert(row.size() == row_samples_);
  while (!row.empty()) {
    if (used_ == line_.size()) {
      good_ = good_ && decode_line();
      if (!good_) return false;
    }
    const std::size_t count = std::min(row.size(), line_.size() - used_);
    std::copy_n(line_.begin() + static_cast<std::ptrdiff_t>(used_), count, row.begin());
    row = row.subspan(count);
    used_ += count;
  }
  return true;
}

bool LosslessJpegRows::decode_line() {
  if (decoded_lines_ == lines_) return false;
  std::swap(line_, above_);
  const std::size_t lines_between = restart_interval_ / columns_;
  const bool is_restarted = lines_between > 0 && decoded_lines_ > 0 && decoded_lines_ % lines_between == 0;
  if (is_restarted && !restart()) return false;
  const bool is_first = decoded_lines_ == 0 || is_restarted;
  const auto components = static_cast<std::size_t>(components_);
  const int limit = 1 << std::min(precision_, bits_per_sample_);
  for (std::size_t i = 0; i < line_.size(); ++i) {
    const auto step = difference(tables_[static_cast<std::size_t>(table_of_[i % components])]);
    if (!step) return false;
    int prediction = 1 << (precision_ - 1);
    if (i >= components) {
      const int left = line_[i - components];
      prediction = is_first ? left : predict(predictor_, left, above_[i], above_[i - components]);
    } else if (!is_first) {
      prediction = above_[i];
    }
    const int sample = (prediction + *step) & 0xFFFF;  // T.81 H.1.2.1
    if (sample >= limit) return false;
    line_[i] = static_cast<std::uint16_t>(sample);
  }
  ++decoded_lines_;
  used_ = 0;
  return padding_ <= bit_count_;
}

/// Passes the restart marker that follows the data of an interval.
bool LosslessJpegRows::restart() {
  fill();
  while (at_ + 1 < data_.size() && u16_at(data_, at_) == 0xFFFF) ++at_;
  if (at_ + 1 >= data_.size() || byte_at(data_, at_) != 0xFF || (byte_at(data_, at_ + 1) & 0xF8) != 0xD0) return false;
  at_ += 2;
  bits_ = 0;
  bit_count_ = padding_ = 0;
  return true;
}

/// Reads bytes until there are bits for any difference; zeros after the end of the data, which is before a marker.
void LosslessJpegRows::fill() {
  while (bit_count_ <= 56) {
    int byte = 0;
    if (at_ >= data_.size()) {
      padding_ += 8;
    } else {
      byte = byte_at(data_, at_);
      const bool stuffed = byte == 0xFF && at_ + 1 < data_.size() && byte_at(data_, at_ + 1) == 0;
      if (byte != 0xFF || stuffed) {
        at_ += stuffed ? 2 : 1;
      } else {
        byte = 0;
        padding_ += 8;
      }
    }
    bits_ = bits_ << 8U | static_cast<unsigned>(byte);
    bit_count_ += 8;
  }
}

/// Decodes a difference (T.81 F.2.2.1 and H.2); nullopt for a code that the table does not have.
std::optional<int> LosslessJpegRows::difference(const Table& table) {
  if (bit_count_ < 32) fill();
  const auto mask = [](int count) { return (1U << count) - 1; };
  const int quick = table.quick[peek(quick_bits) & mask(quick_bits)];
  int category = quick & 255, length = quick >> 8;
  for (int longer = quick_bits + 1; length == 0 && longer <= 16; ++longer) {
    const auto of_length = static_cast<std::size_t>(longer);
    const int code = static_cast<int>(peek(longer) & mask(longer));
    if (code > table.max_code[of_length] || table.first[of_length] + code < 0) continue;
    category = table.categories[static_cast<std::size_t>(table.first[of_length] + code)];
    length = longer;
  }
  if (length == 0) return std::nullopt;
  bit_count_ -= length;
  if (category == 0) return 0;
  if (category == max_category && !has_bits_of_category_16_) return 32768;
  const int value = static_cast<int>(peek(category) & mask(category));
  bit_count_ -= category;
  return value < 1 << (category - 1) ? value - (1 << category) + 1 : value;
}

}  // namespace lowlux::isp
