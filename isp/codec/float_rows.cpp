#include "isp/codec/float_rows.h"

#include <zlib.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cassert>
#include <cstdint>
#include <limits>
#include <new>

namespace lowlux::isp {
namespace {

/// Returns the value of an IEEE 754 pattern of fewer than 32 bits.
template <int exponent_bits, int mantissa_bits>
float expanded(std::uint32_t pattern) {
  constexpr int bias = (1 << (exponent_bits - 1)) - 1, most = (1 << exponent_bits) - 1;
  constexpr auto subnormal_unit = std::bit_cast<float>(static_cast<std::uint32_t>(128 - bias - mantissa_bits) << 23U);
  const std::uint32_t mantissa = pattern & ((1U << mantissa_bits) - 1);
  const int exponent = static_cast<int>(pattern >> mantissa_bits) & most;
  const std::uint32_t sign = pattern >> (exponent_bits + mantissa_bits) << 31U;
  if (exponent == 0) {
    const float magnitude = static_cast<float>(mantissa) * subnormal_unit;
    return sign != 0 ? -magnitude : magnitude;
  }
  const auto wide = static_cast<std::uint32_t>(exponent == most ? 255 : exponent - bias + 127);
  return std::bit_cast<float>(sign | wide << 23U | mantissa << (23U - mantissa_bits));
}

float sample_of(std::uint32_t pattern, int bits) {
  if (bits == 16) return expanded<5, 10>(pattern);
  if (bits == 24) return expanded<7, 16>(pattern);
  return std::bit_cast<float>(pattern);
}

/// Returns the samples whose byte i of weight w is at bytes[i * step + offset[w]], weights falling.
void gather(const std::byte* bytes, std::size_t step, std::span<const std::size_t> offset, int bits,
            std::span<float> out) {
  for (std::size_t i = 0; i < out.size(); ++i) {
    std::uint32_t pattern = 0;
    for (const std::size_t at : offset) pattern = pattern << 8U | std::to_integer<std::uint32_t>(bytes[i * step + at]);
    out[i] = sample_of(pattern, bits);
  }
}

void add_differences(std::span<std::byte> row, std::size_t step) {
  for (std::size_t i = step; i < row.size(); ++i) {
    row[i] = static_cast<std::byte>(std::to_integer<unsigned>(row[i]) + std::to_integer<unsigned>(row[i - step]));
  }
}

}  // namespace

struct FloatRows::Inflater {
  Inflater() {
    if (inflateInit(&stream) != Z_OK) throw std::bad_alloc();
  }
  Inflater(const Inflater&) = delete;
  Inflater& operator=(const Inflater&) = delete;
  ~Inflater() { inflateEnd(&stream); }

  void open(std::span<const std::byte> part) {
    inflateReset(&stream);
    stream.next_in = const_cast<Bytef*>(reinterpret_cast<const Bytef*>(part.data()));  // zlib only reads it
    stream.avail_in = static_cast<uInt>(std::min<std::size_t>(part.size(), std::numeric_limits<uInt>::max()));
  }
  bool fill(std::span<std::byte> out) {
    stream.next_out = reinterpret_cast<Bytef*>(out.data());
    stream.avail_out = static_cast<uInt>(out.size());
    const int outcome = inflate(&stream, Z_SYNC_FLUSH);
    return (outcome == Z_OK || outcome == Z_STREAM_END) && stream.avail_out == 0;
  }

  /// Reads on, with space for a byte, so that a stream that ends is read to its checksum.
  bool is_at_end() {
    Bytef more = 0;
    stream.next_out = &more;
    stream.avail_out = 1;
    const int outcome = inflate(&stream, Z_SYNC_FLUSH);
    return outcome == Z_STREAM_END || outcome == Z_BUF_ERROR;  // the latter: it ends without a checksum
  }

  z_stream stream{};
};

FloatRows::FloatRows(const FloatStorage& storage, std::size_t row_samples)
    : storage_(storage), row_samples_(row_samples) {
  assert(storage.bits == 16 || storage.bits == 24 || storage.bits == 32);
  assert(row_samples > 0 && storage.predictor_step >= 0 && (storage.deflated || storage.predictor_step == 0));
  if (!storage.deflated) return;
  inflater_ = std::make_unique<Inflater>();
  inflated_.resize(row_samples * static_cast<std::size_t>(storage.bits / 8));
}

FloatRows::~FloatRows() = default;

void FloatRows::open(std::span<const std::byte> part) {
  rest_ = part;
  if (inflater_) inflater_->open(part);
}

bool FloatRows::next(std::span<float> row) {
  assert(row.size() == row_samples_);
  const auto sample_bytes = static_cast<std::size_t>(storage_.bits / 8);
  const std::size_t row_bytes = row_samples_ * sample_bytes;
  const bool predicted = storage_.predictor_step > 0;
  if (inflater_ ? !inflater_->fill(inflated_) : rest_.size() < row_bytes) return false;
  if (predicted) add_differences(inflated_, static_cast<std::size_t>(storage_.predictor_step));
  std::array<std::size_t, 4> offset{};
  for (std::size_t weight = 0; weight < sample_bytes; ++weight) {
    const std::size_t place = storage_.big_endian ? weight : sample_bytes - 1 - weight;
    offset[weight] = predicted ? weight * row_samples_ : place;
  }
  gather(inflater_ ? inflated_.data() : rest_.data(), predicted ? 1 : sample_bytes,
         std::span(offset).first(sample_bytes), storage_.bits, row);
  if (!inflater_) rest_ = rest_.subspan(row_bytes);
  return true;
}

bool FloatRows::ends_within(int rows) {
  if (!inflater_) return true;
  for (int i = 0; i < rows; ++i) {
    if (!inflater_->fill(inflated_)) break;
  }
  return inflater_->is_at_end();
}

}  // namespace lowlux::isp
