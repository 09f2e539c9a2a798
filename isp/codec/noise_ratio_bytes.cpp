#include "isp/codec/noise_ratio_bytes.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <cstdint>
#include <string>
#include <string_view>

namespace lowlux::isp {
namespace {

constexpr std::string_view maker{"lowlux\0", 7};
constexpr std::size_t header_bytes = 20;
constexpr std::uint32_t layout = 1;
constexpr int steps = 16, one = 96;  // of a factor of 2; the byte of ratio 1

void append(std::vector<std::byte>& to, std::uint32_t number, int bytes) {
  for (int i = 0; i < bytes; ++i) to.push_back(static_cast<std::byte>(number >> (8 * i) & 255));
}

std::uint32_t number_at(std::span<const std::byte> bytes, std::size_t at, int count) {
  std::uint32_t out = 0;
  for (int i = 0; i < count; ++i) {
    out |= std::to_integer<std::uint32_t>(bytes[at + static_cast<std::size_t>(i)]) << (8 * i);
  }
  return out;
}

std::string size_text(std::uint64_t columns, std::uint64_t rows) {
  return std::to_string(columns) + " x " + std::to_string(rows);
}

tl::unexpected<Error> damaged(const std::string& what) {
  return fail(ErrorCode::malformed, "the noise ratio in the tag DNGPrivateData " + what, "DNGPrivateData");
}

}  // namespace

std::vector<std::byte> encode_noise_ratio(const NoiseRatio& ratio) {
  assert(ratio.block_px >= 1 && ratio.block_px <= 65535);
  std::vector<std::byte> out;
  out.reserve(header_bytes + ratio.ratio.size());
  for (const char letter : maker) out.push_back(static_cast<std::byte>(letter));
  append(out, layout, 1);
  append(out, static_cast<std::uint32_t>(ratio.ratio.width()), 4);
  append(out, static_cast<std::uint32_t>(ratio.ratio.height()), 4);
  append(out, static_cast<std::uint32_t>(ratio.block_px), 4);
  for (std::size_t i = 0; i < ratio.ratio.size(); ++i) {
    const double step = std::round(steps * std::log2(static_cast<double>(ratio.ratio.data()[i]))) + one;
    out.push_back(static_cast<std::byte>(static_cast<int>(std::clamp(step, 0.0, 255.0))));
  }
  return out;
}

Result<std::optional<NoiseRatio>> decode_noise_ratio(std::span<const std::byte> bytes, int width_px, int height_px) {
  const std::string_view text(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  if (!text.starts_with(maker)) return std::nullopt;
  if (bytes.size() < header_bytes) return damaged("ends within its header");
  if (number_at(bytes, 7, 1) != layout) return damaged("has a layout that this version does not know");
  const std::uint64_t columns = number_at(bytes, 8, 4), rows = number_at(bytes, 12, 4);
  const auto block_px = static_cast<int>(number_at(bytes, 16, 2));
  if (block_px == 0) return damaged("states blocks of 0 pixels");
  const auto expected_columns = static_cast<std::uint64_t>(ratio_blocks(width_px, block_px));
  const auto expected_rows = static_cast<std::uint64_t>(ratio_blocks(height_px, block_px));
  if (columns != expected_columns || rows != expected_rows) {
    return damaged("has " + size_text(columns, rows) + " blocks, expected " +
                   size_text(expected_columns, expected_rows));
  }
  if (bytes.size() - header_bytes != columns * rows) {
    return damaged("has " + std::to_string(bytes.size() - header_bytes) + " bytes for " + size_text(columns, rows) +
                   " blocks");
  }
  NoiseRatio out{.block_px = block_px, .ratio = Plane<float>(static_cast<int>(columns), static_cast<int>(rows))};
  for (std::size_t i = 0; i < out.ratio.size(); ++i) {
    const int step = std::to_integer<int>(bytes[header_bytes + i]) - one;
    out.ratio.data()[i] = static_cast<float>(std::exp2(static_cast<double>(step) / steps));
  }
  return out;
}

}  // namespace lowlux::isp
