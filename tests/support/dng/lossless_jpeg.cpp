#include "tests/support/dng/lossless_jpeg.h"

#include <bit>
#include <cstdlib>

namespace lowlux::test {
namespace {

constexpr int categories = 17;  // 0 to 16 bits of difference, T.81 table H.2
constexpr int code_bits = 5;    // all codes are equally long: 17 of the 32 there are

class BitWriter {
 public:
  explicit BitWriter(std::vector<std::byte>& out) : out_(out) {}

  void put(std::uint32_t value, int count) {
    for (int i = count - 1; i >= 0; --i) put_bit(value >> i & 1);
  }
  /// Fills the last byte with ones, T.81 F.1.2.3.
  void flush() {
    while (used_ != 0) put_bit(1);
  }

 private:
  void put_bit(std::uint32_t bit) {
    current_ = current_ << 1 | bit;
    if (++used_ < 8) return;
    out_.push_back(static_cast<std::byte>(current_));
    if (current_ == 0xFF) out_.push_back(std::byte{0});  // T.81 B.1.1.5: no markers inside data
    current_ = 0;
    used_ = 0;
  }

  std::vector<std::byte>& out_;
  std::uint32_t current_ = 0;
  int used_ = 0;
};

void put_u8(std::vector<std::byte>& out, int value) { out.push_back(static_cast<std::byte>(value)); }

void put_u16(std::vector<std::byte>& out, int value) {
  put_u8(out, value >> 8);
  put_u8(out, value & 255);
}

void put_headers(const JpegSamples& image, std::vector<std::byte>& out) {
  put_u16(out, 0xFFD8);  // start of image
  put_u16(out, 0xFFC4);  // Huffman table 0: 17 codes of 5 bits, in the order of their categories
  put_u16(out, 2 + 1 + 16 + categories);
  put_u8(out, 0);
  for (int length = 1; length <= 16; ++length) put_u8(out, length == code_bits ? categories : 0);
  for (int category = 0; category < categories; ++category) put_u8(out, category);
  put_u16(out, 0xFFC3);  // lossless frame
  put_u16(out, 8 + 3 * image.components);
  put_u8(out, image.precision);
  put_u16(out, image.rows);
  put_u16(out, image.columns);
  put_u8(out, image.components);
  for (int component = 0; component < image.components; ++component) {
    put_u8(out, component);
    put_u8(out, 0x11);
    put_u8(out, 0);
  }
  put_u16(out, 0xFFDA);  // scan
  put_u16(out, 6 + 2 * image.components);
  put_u8(out, image.components);
  for (int component = 0; component < image.components; ++component) put_u16(out, component << 8);
  put_u8(out, 1);  // predictor: the value to the left
  put_u16(out, 0);
}

/// Writes one difference modulo 2^16: its category, then its bits, T.81 H.1.2.2.
void put_difference(int sample, int prediction, BitWriter& bits) {
  const int difference = static_cast<std::int16_t>(static_cast<std::uint16_t>(sample - prediction));
  const int category = std::bit_width(static_cast<std::uint32_t>(std::abs(difference)));
  bits.put(static_cast<std::uint32_t>(category), code_bits);
  if (category == 0 || category == 16) return;
  const int coded = difference > 0 ? difference : difference + (1 << category) - 1;
  bits.put(static_cast<std::uint32_t>(coded), category);
}

}  // namespace

std::vector<std::byte> encode_lossless_jpeg(const JpegSamples& image) {
  std::vector<std::byte> out;
  put_headers(image, out);
  BitWriter bits(out);
  const int n = image.components, stride = image.columns * n;
  for (int y = 0; y < image.rows; ++y) {
    const std::uint16_t* row = image.samples.data() + static_cast<std::size_t>(y) * stride;
    for (int i = 0; i < stride; ++i) {
      int prediction = 1 << (image.precision - 1);
      if (i >= n) prediction = row[i - n];
      if (i < n && y > 0) prediction = row[i - stride];
      put_difference(row[i], prediction, bits);
    }
  }
  bits.flush();
  put_u16(out, 0xFFD9);
  return out;
}

}  // namespace lowlux::test
