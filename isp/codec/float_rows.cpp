#include "isp/codec/float_rows.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cassert>
#include <cstdint>

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

FloatRows::FloatRows(const RowStorage& storage, std::size_t row_samples)
    : storage_(storage), row_samples_(row_samples), rows_(storage.deflated, row_bytes(storage.bits, row_samples)) {
  assert(storage.bits == 16 || storage.bits == 24 || storage.bits == 32);
  assert(storage.predictor_step >= 0 && (storage.deflated || storage.predictor_step == 0));
}

bool FloatRows::next(std::span<float> row) {
  assert(row.size() == row_samples_);
  auto bytes = rows_.next();
  if (!bytes) return false;
  const auto sample_bytes = static_cast<std::size_t>(storage_.bits / 8);
  const bool predicted = storage_.predictor_step > 0;
  if (predicted) {
    restored_.assign(bytes->begin(), bytes->end());
    add_differences(restored_, static_cast<std::size_t>(storage_.predictor_step));
    bytes = restored_;
  }
  std::array<std::size_t, 4> offset{};
  for (std::size_t weight = 0; weight < sample_bytes; ++weight) {
    const std::size_t place = storage_.big_endian ? weight : sample_bytes - 1 - weight;
    offset[weight] = predicted ? weight * row_samples_ : place;
  }
  gather(bytes->data(), predicted ? 1 : sample_bytes, std::span(offset).first(sample_bytes), storage_.bits, row);
  return true;
}

}  // namespace lowlux::isp
