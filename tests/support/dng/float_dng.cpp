#include "tests/support/dng/float_dng.h"

#include <zlib.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>

namespace lowlux::test {
namespace {

int step_of(const FloatStore& how) {
  const int factor = how.predictor == 3 ? 1 : how.predictor == 34894 ? 2 : how.predictor == 34895 ? 4 : 0;
  return factor * how.samples;
}

std::vector<std::byte> part_at(const Plane<std::uint32_t>& patterns, const FloatStore& how, int x0, int y0, int width,
                               int height) {
  std::vector<std::byte> out;
  for (int y = y0; y < y0 + height; ++y) {
    std::vector<std::uint32_t> row(static_cast<std::size_t>(width) * how.samples, 0);
    const int first = x0 * how.samples, end = std::min(patterns.width(), first + width * how.samples);
    if (y < patterns.height()) std::copy(patterns.row(y) + first, patterns.row(y) + end, row.begin());
    const auto bytes = stored_row(row, how);
    out.insert(out.end(), bytes.begin(), bytes.end());
  }
  return how.deflate ? deflated(out) : out;
}

}  // namespace

double value_of_pattern(std::uint32_t pattern, int bits) {
  const int exponent_bits = bits == 16 ? 5 : bits == 24 ? 7 : 8, mantissa_bits = bits - 1 - exponent_bits;
  const int bias = (1 << (exponent_bits - 1)) - 1, largest = (1 << exponent_bits) - 1;
  const int exponent = static_cast<int>(pattern >> mantissa_bits) & largest;
  const double mantissa = pattern & ((1U << mantissa_bits) - 1);
  const double sign = (pattern >> (bits - 1) & 1) != 0 ? -1 : 1;
  if (exponent == largest) return mantissa > 0 ? NAN : sign * INFINITY;
  if (exponent == 0) return sign * std::ldexp(mantissa, 1 - bias - mantissa_bits);
  return sign * std::ldexp(std::ldexp(1.0, mantissa_bits) + mantissa, exponent - bias - mantissa_bits);
}

std::vector<std::byte> stored_row(const std::vector<std::uint32_t>& patterns, const FloatStore& how) {
  const int bytes = how.bits / 8, step = step_of(how);
  ByteWriter writer(how.big_endian);
  if (step == 0) {
    for (const std::uint32_t pattern : patterns) writer.number(pattern, bytes);
    return writer.out;
  }
  for (int weight = bytes - 1; weight >= 0; --weight) {
    for (const std::uint32_t pattern : patterns) writer.number(pattern >> (8 * weight) & 255, 1);
  }
  std::vector<std::byte> out = writer.out;
  for (std::size_t i = out.size(); i-- > static_cast<std::size_t>(step);) {
    out[i] = static_cast<std::byte>(std::to_integer<int>(out[i]) - std::to_integer<int>(out[i - step]));
  }
  return out;
}

std::vector<std::byte> deflated(const std::vector<std::byte>& bytes) {
  uLongf size = compressBound(bytes.size());
  std::vector<std::byte> out(size);
  compress(reinterpret_cast<Bytef*>(out.data()), &size, reinterpret_cast<const Bytef*>(bytes.data()), bytes.size());
  out.resize(size);
  return out;
}

DngBuilder float_dng(const Plane<std::uint32_t>& patterns, const FloatStore& how) {
  DngBuilder dng;
  dng.width = patterns.width() / how.samples;
  dng.height = patterns.height();
  dng.samples = how.samples;
  dng.big_endian = how.big_endian;
  const int width = how.tile_width > 0 ? how.tile_width : dng.width, rows = how.rows > 0 ? how.rows : dng.height;
  for (int y = 0; y < dng.height; y += rows) {
    const int stored = how.tile_width > 0 ? rows : std::min(rows, dng.height - y);
    for (int x = 0; x < dng.width; x += width) dng.stored_parts.push_back(part_at(patterns, how, x, y, width, stored));
  }
  dng.rows_per_strip = rows;
  dng.tile_width = how.tile_width;
  dng.tile_height = rows;
  dng.parts_are_tiles = how.tile_width > 0;
  dng.set(258, Tag::numbers(TagType::u16, std::vector<double>(how.samples, how.bits)));
  dng.set(259, Tag::numbers(TagType::u16, {how.deflate ? 8.0 : 1.0}));
  if (how.predictor != 1) dng.set(317, Tag::numbers(TagType::u16, {static_cast<double>(how.predictor)}));
  dng.set(339, Tag::numbers(TagType::u16, std::vector<double>(how.samples, 3)));
  dng.set(50714, Tag::numbers(TagType::u16, std::vector<double>(how.samples, 0)));
  return dng.remove(50717);
}

DngBuilder float_dng(const Plane<float>& mosaic, std::optional<double> white) {
  Plane<std::uint32_t> patterns(mosaic.width(), mosaic.height());
  std::transform(mosaic.data(), mosaic.data() + mosaic.size(), patterns.data(),
                 [](float value) { return std::bit_cast<std::uint32_t>(value); });
  DngBuilder dng = float_dng(patterns, FloatStore{});
  if (white) dng.set(50717, Tag::numbers(TagType::u32, {*white}));
  return dng;
}

}  // namespace lowlux::test
