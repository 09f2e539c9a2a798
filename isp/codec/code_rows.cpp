#include "isp/codec/code_rows.h"

#include <cassert>

namespace lowlux::isp {
namespace {

std::uint32_t byte_at(std::span<const std::byte> bytes, std::size_t i) {
  return std::to_integer<std::uint32_t>(bytes[i]);
}

void unpack_bits(std::span<const std::byte> bytes, int bits, std::span<std::uint16_t> out) {
  std::uint32_t pending = 0;  // its lowest `pending_bits` bits were read and not used
  int pending_bits = 0;
  std::size_t at = 0;
  for (std::uint16_t& sample : out) {
    for (; pending_bits < bits; pending_bits += 8) pending = pending << 8U | byte_at(bytes, at++);
    pending_bits -= bits;
    sample = static_cast<std::uint16_t>(pending >> pending_bits);
    pending &= (1U << pending_bits) - 1;
  }
}

void unpack(std::span<const std::byte> bytes, const RowStorage& storage, std::span<std::uint16_t> out) {
  if (storage.bits == 8) {
    for (std::size_t i = 0; i < out.size(); ++i) out[i] = static_cast<std::uint16_t>(byte_at(bytes, i));
  } else if (storage.bits == 16) {
    const std::size_t high = storage.big_endian ? 0 : 1;
    for (std::size_t i = 0; i < out.size(); ++i) {
      out[i] = static_cast<std::uint16_t>(byte_at(bytes, 2 * i + high) << 8U | byte_at(bytes, 2 * i + 1 - high));
    }
  } else {
    unpack_bits(bytes, storage.bits, out);
  }
}

}  // namespace

CodeRows::CodeRows(const RowStorage& storage, std::size_t row_samples)
    : storage_(storage), row_samples_(row_samples), rows_(storage.deflated, row_bytes(storage.bits, row_samples)) {
  assert(storage.bits >= 8 && storage.bits <= 16 && storage.predictor_step >= 0);
  assert(storage.predictor_step == 0 || (storage.deflated && storage.bits % 8 == 0));
}

bool CodeRows::next(std::span<std::uint16_t> row) {
  assert(row.size() == row_samples_);
  const auto bytes = rows_.next();
  if (!bytes) return false;
  unpack(*bytes, storage_, row);
  if (storage_.predictor_step == 0) return true;
  const std::uint32_t mask = (1U << storage_.bits) - 1;
  const auto step = static_cast<std::size_t>(storage_.predictor_step);
  for (std::size_t i = step; i < row.size(); ++i) row[i] = static_cast<std::uint16_t>((row[i] + row[i - step]) & mask);
  return true;
}

}  // namespace lowlux::isp
