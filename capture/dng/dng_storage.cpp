#include "capture/dng/dng_storage.h"

#include <algorithm>
#include <numeric>
#include <utility>

#include "capture/dng/dng_tags.h"
#include "capture/file/pass_on.h"
#include "isp/base/text.h"

namespace lowlux::capture {
namespace {

constexpr std::size_t max_parts = std::size_t{1} << 22;  // strips or tiles
constexpr std::uint32_t max_tile_side = 4096;  // unless the image is larger: what is outside of it costs time only

struct PartSize {
  std::uint32_t width = 0, height = 0;
};

Result<PartSize> part_size(const TiffDirectory& directory, const DngImage& image, bool tiled) {
  const auto image_width = static_cast<std::uint32_t>(image.width);
  const auto image_height = static_cast<std::uint32_t>(image.height);
  if (!tiled) {
    auto rows = directory.whole_or(tag::rows_per_strip, image_height);
    if (!rows) return pass_on(rows);
    return PartSize{image_width, std::min(*rows, image_height)};
  }
  auto width = required_whole(directory, tag::tile_width);
  if (!width) return pass_on(width);
  auto height = required_whole(directory, tag::tile_length);
  if (!height) return pass_on(height);
  const auto limit = [](std::uint32_t side) { return std::max(max_tile_side, (side + 15) / 16 * 16); };
  if (*width <= limit(image_width) && *height <= limit(image_height)) return PartSize{*width, *height};
  return fail(ErrorCode::malformed, "tiles of " + std::to_string(*width) + " x " + std::to_string(*height) +
                                        " pixels are too large for an image of " + std::to_string(image.width) + " x " +
                                        std::to_string(image.height));
}

/// Returns whether two of the first `count` parts share bytes of the file.
bool do_overlap(const DngParts& parts, std::size_t count) {
  std::vector<std::size_t> order(count);
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::sort(order.begin(), order.end(),
            [&](std::size_t a, std::size_t b) { return parts.offset[a] < parts.offset[b]; });
  double end = 0;
  for (const std::size_t i : order) {
    if (parts.bytes[i] == 0) continue;
    if (parts.offset[i] < end) return true;
    end = parts.offset[i] + parts.bytes[i];
  }
  return false;
}

}  // namespace

Result<std::uint32_t> required_whole(const TiffDirectory& directory, TagName name) {
  auto found = directory.whole(name);
  if (!found) return pass_on(found);
  if (*found) return **found;
  return fail(ErrorCode::malformed, std::string("the tag ") + name.name + " is missing", name.name);
}

Result<DngParts> dng_parts(const TiffDirectory& directory, std::size_t file_bytes) {
  DngParts parts;
  parts.tiled = directory.find(tag::tile_offsets) != nullptr;
  const TagName offset_tag = parts.tiled ? tag::tile_offsets : tag::strip_offsets;
  const TagName bytes_tag = parts.tiled ? tag::tile_byte_counts : tag::strip_byte_counts;
  auto offset = directory.numbers(offset_tag, 1, max_parts);
  if (!offset) return pass_on(offset);
  auto bytes = directory.numbers(bytes_tag, 1, max_parts);
  if (!bytes) return pass_on(bytes);
  if (!*offset || !*bytes || (*offset)->size() != (*bytes)->size()) {
    return fail(ErrorCode::malformed,
                std::string("the tags ") + offset_tag.name + " and " + bytes_tag.name + " are missing or disagree",
                offset_tag.name);
  }
  parts.offset = **std::move(offset);
  parts.bytes = **std::move(bytes);
  for (std::size_t i = 0; i < parts.offset.size(); ++i) {
    const double end = parts.offset[i] + parts.bytes[i];
    if (parts.offset[i] >= 8 && parts.bytes[i] >= 0 && end <= static_cast<double>(file_bytes)) continue;
    return fail(ErrorCode::malformed, "the image data reaches to byte " + number_text(end) + ", the file has " +
                                          std::to_string(file_bytes) + ": it is truncated or damaged");
  }
  return parts;
}

Result<void> check_part_count(const DngImage& image, double needed, const DngParts& parts) {
  if (static_cast<double>(parts.offset.size()) >= needed) return {};
  return fail(ErrorCode::malformed, "the image of " + std::to_string(image.width) + " x " +
                                        std::to_string(image.height) + " pixels needs " + number_text(needed) +
                                        " strips or tiles, the file has " + std::to_string(parts.offset.size()));
}

Result<DngGrid> dng_grid(const TiffDirectory& directory, const DngImage& image, std::size_t file_bytes) {
  auto at = dng_parts(directory, file_bytes);
  if (!at) return pass_on(at);
  auto size = part_size(directory, image, at->tiled);
  if (!size) return pass_on(size);
  if (size->width < 1 || size->height < 1) return fail(ErrorCode::malformed, "the strips or tiles have no pixels");
  DngGrid grid{.at = *std::move(at), .width = static_cast<int>(size->width), .height = static_cast<int>(size->height)};
  grid.across = (image.width + grid.width - 1) / grid.width;
  const int down = (image.height + grid.height - 1) / grid.height;
  grid.covering = static_cast<std::size_t>(down) * static_cast<std::size_t>(grid.across);
  grid.count = grid.covering * static_cast<std::size_t>(image.is_planar ? image.samples : 1);
  if (auto enough = check_part_count(image, static_cast<double>(grid.count), grid.at); !enough) return pass_on(enough);
  if (!do_overlap(grid.at, grid.count)) return grid;
  return fail(ErrorCode::malformed, "the strips or tiles of the image overlap: the file is damaged");
}

bool is_deflate(std::uint32_t compression) {
  return compression == tag::compression_deflate || compression == tag::compression_old_deflate;
}

std::string compression_name(std::uint32_t compression) {
  constexpr std::pair<std::uint32_t, const char*> names[] = {
      {1, "none"},        {5, "LZW"},           {6, "old JPEG"},      {7, "lossless JPEG"},
      {8, "Deflate"},     {9, "VC-5 (GPR)"},    {32773, "PackBits"},  {34892, "lossy JPEG"},
      {52546, "JPEG XL"}, {34713, "Nikon NEF"}, {65535, "Pentax PEF"}};
  for (const auto& [number, name] : names) {
    if (number == compression) return std::string(name) + ", compression " + std::to_string(compression);
  }
  return "an unknown method, compression " + std::to_string(compression);
}

}  // namespace lowlux::capture
