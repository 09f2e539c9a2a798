#include "isp/codec/lossless_jpeg.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cassert>
#include <cstdlib>
#include <numeric>

namespace lowlux::isp {
namespace {

constexpr int categories = 17;          // differences of 0 to 16 bits, T.81 table H.2
constexpr int longest_code = 16;        // bits
constexpr int reserved = categories;    // takes the code of ones alone, which T.81 C.2 leaves unused
constexpr int max_bytes_of_sample = 8;  // 31 bits, of which each byte may be followed by a 0

using Counts = std::array<std::uint64_t, categories + 1>;
using Lengths = std::array<int, categories + 1>;  // bits of the code of each category; 0: not in use

/// Returns the difference of two samples modulo 2^16, T.81 H.1.2.1.
int difference(int sample, int prediction) { return static_cast<std::int16_t>(sample - prediction); }

int category_of(int difference) { return std::bit_width(static_cast<unsigned>(std::abs(difference))); }

/// Calls use(difference) for each sample in order.
template <class Use>
void for_each_difference(const PlaneView<const std::uint16_t>& samples, int components, int precision_bits, Use use) {
  for (int y = 0; y < samples.height; ++y) {
    const std::uint16_t* row = samples.row(y);
    for (int i = 0; i < components; ++i) {
      use(difference(row[i], y == 0 ? 1 << (precision_bits - 1) : samples.row(y - 1)[i]));
    }
    for (int x = components; x < samples.width; ++x) use(difference(row[x], row[x - components]));
  }
}

/// Returns the lengths of Huffman's codes without a limit. The reserved symbol takes its part of the codes, so that
/// those of the categories never reach the code of ones alone.
Lengths huffman_lengths(const Counts& counts) {
  struct Node {
    std::uint64_t count;
    std::uint32_t symbols;  // one bit for each
  };
  std::vector<Node> nodes;
  for (int i = reserved; i >= 0; --i) {
    if (counts[i] > 0) nodes.push_back({counts[i], 1U << i});
  }
  Lengths lengths{};
  const auto take_least = [&nodes] {
    const auto least =
        std::min_element(nodes.begin(), nodes.end(), [](const Node& a, const Node& b) { return a.count < b.count; });
    const Node node = *least;
    nodes.erase(least);
    return node;
  };
  while (nodes.size() > 1) {
    const Node a = take_least(), b = take_least();
    const Node both{a.count + b.count, a.symbols | b.symbols};
    for (int i = 0; i <= reserved; ++i) lengths[i] += static_cast<int>(both.symbols >> i & 1U);
    nodes.insert(nodes.begin(), both);
  }
  return lengths;
}

/// Returns lengths of at most 16 bits: counts are made more equal until no code is longer.
Lengths code_lengths(Counts counts) {
  counts[reserved] = 1;
  for (;;) {
    const Lengths lengths = huffman_lengths(counts);
    if (*std::max_element(lengths.begin(), lengths.end()) <= longest_code) return lengths;
    for (std::uint64_t& count : counts) count = (count + 1) / 2;
  }
}

/// Returns the categories in use in the order of their codes, T.81 annex C: by length, then by number.
std::vector<int> in_order(const Lengths& lengths) {
  std::vector<int> order(categories);
  std::iota(order.begin(), order.end(), 0);
  std::erase_if(order, [&](int category) { return lengths[category] == 0; });
  std::stable_sort(order.begin(), order.end(), [&](int a, int b) { return lengths[a] < lengths[b]; });
  return order;
}

/// Writes bytes to memory that the caller has reserved.
class BytesOutput {
 public:
  explicit BytesOutput(std::byte* to) : to_(to) {}

  void put_u8(unsigned value) { *to_++ = static_cast<std::byte>(value); }
  void put_u16(unsigned value) {
    put_u8(value >> 8U);
    put_u8(value & 0xFFU);
  }
  /// Appends up to 32 bits to the data of the scan.
  void put_bits(std::uint32_t value, int count) {
    bits_ = bits_ << count | value;
    used_ += count;
    if (used_ < 32) return;
    used_ -= 32;
    const auto word = static_cast<std::uint32_t>(bits_ >> used_);
    for (int shift = 24; shift >= 0; shift -= 8) put_data(word >> shift & 0xFFU);
  }
  /// Fills the last byte of the scan with ones, T.81 F.1.2.3.
  void finish_bits() {
    for (; used_ > 0; used_ -= 8) put_data(static_cast<unsigned>((bits_ << 8U | 0xFFU) >> used_) & 0xFFU);
  }
  std::byte* end() const { return to_; }

 private:
  void put_data(unsigned byte) {
    put_u8(byte);
    *to_ = std::byte{0};  // T.81 B.1.1.5: no markers inside data
    to_ += byte == 0xFF;
  }

  std::byte* to_;
  std::uint64_t bits_ = 0;  // the last `used_` are still to be written
  int used_ = 0;
};

void put_headers(const PlaneView<const std::uint16_t>& samples, int components, int precision_bits,
                 const Lengths& lengths, BytesOutput& out) {
  const std::vector<int> order = in_order(lengths);
  out.put_u16(0xFFD8);  // start of image
  out.put_u16(0xFFC4);  // Huffman table 0
  out.put_u16(static_cast<unsigned>(2 + 1 + longest_code + order.size()));
  out.put_u8(0);
  for (int length = 1; length <= longest_code; ++length) {
    out.put_u8(static_cast<unsigned>(
        std::count_if(order.begin(), order.end(), [&](int category) { return lengths[category] == length; })));
  }
  for (const int category : order) out.put_u8(static_cast<unsigned>(category));
  out.put_u16(0xFFC3);  // lossless frame
  out.put_u16(static_cast<unsigned>(8 + 3 * components));
  out.put_u8(static_cast<unsigned>(precision_bits));
  out.put_u16(static_cast<unsigned>(samples.height));
  out.put_u16(static_cast<unsigned>(samples.width / components));
  out.put_u8(static_cast<unsigned>(components));
  for (int i = 0; i < components; ++i) {
    out.put_u8(static_cast<unsigned>(i));
    out.put_u16(0x1100);  // not subsampled; no quantisation
  }
  out.put_u16(0xFFDA);  // scan
  out.put_u16(static_cast<unsigned>(6 + 2 * components));
  out.put_u8(static_cast<unsigned>(components));
  for (int i = 0; i < components; ++i) out.put_u16(static_cast<unsigned>(i) << 8U);  // Huffman table 0
  out.put_u8(1);   // predictor: the sample to the left
  out.put_u16(0);  // no point transform
}

struct Code {
  std::uint32_t bits = 0;
  int length = 0;
};

/// Returns the codes of the categories, T.81 annex C.
std::array<Code, categories> codes_of(const Lengths& lengths) {
  std::array<Code, categories> codes{};
  std::uint32_t next = 0;
  int length = 0;
  for (const int category : in_order(lengths)) {
    next <<= lengths[category] - length;
    length = lengths[category];
    codes[category] = {next++, length};
  }
  return codes;
}

}  // namespace

std::vector<std::byte> encode_lossless_jpeg(PlaneView<const std::uint16_t> samples, int components,
                                            int precision_bits) {
  assert(components >= 1 && components <= 4 && samples.width % components == 0);
  Counts counts{};
  for_each_difference(samples, components, precision_bits, [&](int d) { ++counts[category_of(d)]; });
  const Lengths lengths = code_lengths(counts);
  const std::array<Code, categories> codes = codes_of(lengths);
  constexpr std::size_t headers = 200;
  std::vector<std::byte> bytes(headers +
                               max_bytes_of_sample * static_cast<std::size_t>(samples.width) * samples.height);
  BytesOutput out(bytes.data());
  put_headers(samples, components, precision_bits, lengths, out);
  for_each_difference(samples, components, precision_bits, [&](int d) {
    const int category = category_of(d), extra = category == 16 ? 0 : category;  // T.81 H.1.2.2
    const auto low = static_cast<std::uint32_t>(d > 0 ? d : d - 1) & ((1U << extra) - 1);
    out.put_bits(codes[category].bits << extra | low, codes[category].length + extra);
  });
  out.finish_bits();
  out.put_u16(0xFFD9);  // end of image
  bytes.resize(static_cast<std::size_t>(out.end() - bytes.data()));
  return bytes;
}

}  // namespace lowlux::isp
