#include "tests/support/dng/code_dng.h"

#include <algorithm>

#include "tests/support/dng/float_dng.h"

namespace lowlux::test {
namespace {

int step_of(const CodeStore& how, int samples) {
  const int factor = how.predictor == 2 ? 1 : how.predictor == 34892 ? 2 : how.predictor == 34893 ? 4 : 0;
  return factor * samples;
}

std::vector<std::byte> stored(std::vector<std::uint32_t> row, const CodeStore& how, int step) {
  const std::uint32_t mask = (1U << how.bits) - 1;
  for (std::size_t i = row.size(); step > 0 && i-- > static_cast<std::size_t>(step);) {
    row[i] = (row[i] - row[i - static_cast<std::size_t>(step)]) & mask;
  }
  ByteWriter writer(how.big_endian);
  if (how.bits == 16) {
    for (const std::uint32_t code : row) writer.number(code, 2);
    return writer.out;
  }
  std::uint64_t bits = 0;  // of which the last `count` are not written yet
  int count = 0;
  for (const std::uint32_t code : row) {
    bits = bits << how.bits | (code & mask);
    for (count += how.bits; count >= 8; count -= 8) writer.number(bits >> (count - 8) & 255, 1);
  }
  if (count > 0) writer.number(bits << (8 - count) & 255, 1);
  return writer.out;
}

struct Place {
  int x, y, width, height, plane;  // plane: -1 for all samples of a pixel
};

std::vector<std::byte> part_at(const Plane<std::uint16_t>& codes, const CodeStore& how, const Place& at) {
  const int samples = at.plane < 0 ? how.samples : 1, width = codes.width() / how.samples;
  std::vector<std::byte> out;
  for (int y = at.y; y < at.y + at.height; ++y) {
    std::vector<std::uint32_t> row;
    for (int x = at.x; x < at.x + at.width; ++x) {
      for (int s = 0; s < samples; ++s) {
        const bool is_inside = x < width && y < codes.height();
        row.push_back(is_inside ? codes.at(x * how.samples + (at.plane < 0 ? s : at.plane), y) : 1);
      }
    }
    const auto bytes = stored(std::move(row), how, step_of(how, samples));
    out.insert(out.end(), bytes.begin(), bytes.end());
  }
  return how.deflate ? deflated(out) : out;
}

}  // namespace

DngBuilder code_dng(const Plane<std::uint16_t>& codes, const CodeStore& how) {
  DngBuilder dng;
  dng.width = codes.width() / how.samples;
  dng.height = codes.height();
  dng.samples = how.samples;
  dng.bits = how.bits;
  dng.big_endian = how.big_endian;
  const bool tiled = how.tile_width > 0;
  const int width = tiled ? how.tile_width : dng.width, rows = how.rows > 0 ? how.rows : dng.height;
  for (int plane = how.planar ? 0 : -1; plane < (how.planar ? how.samples : 0); ++plane) {
    for (int y = 0; y < dng.height; y += rows) {
      const int height = tiled ? rows : std::min(rows, dng.height - y);
      for (int x = 0; x < dng.width; x += width) {
        dng.stored_parts.push_back(part_at(codes, how, {x, y, width, height, plane}));
      }
    }
  }
  dng.rows_per_strip = rows;
  dng.tile_width = how.tile_width;
  dng.tile_height = rows;
  dng.parts_are_tiles = tiled;
  if (how.deflate) dng.set(259, Tag::numbers(TagType::u16, {8}));
  if (how.predictor != 1) dng.set(317, Tag::numbers(TagType::u16, {static_cast<double>(how.predictor)}));
  if (how.planar) dng.set(284, Tag::numbers(TagType::u16, {2}));
  return dng;
}

}  // namespace lowlux::test
