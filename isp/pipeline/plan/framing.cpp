#include "isp/pipeline/plan/framing.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <utility>

#include <fmt/format.h>

namespace lowlux::isp {
namespace {

bool is_transposed(Orientation orientation) { return orientation >= Orientation::transpose; }

PictureSize upright_size(const PictureSize& size, Orientation orientation) {
  return is_transposed(orientation) ? PictureSize{size.height, size.width} : size;
}

/// Returns the pixels of a crop along one axis: begin and length.
std::pair<double, double> pixels_along(double begin, double length, bool percent, int size) {
  if (!percent) return {begin, length};
  const double first = std::round(begin / 100 * size);
  return {first, std::round((begin + length) / 100 * size) - first};
}

Result<Rect> upright_crop(const PictureCrop& crop, const PictureSize& upright) {
  const auto [x, width] = pixels_along(crop.x, crop.width, crop.percent, upright.width);
  const auto [y, height] = pixels_along(crop.y, crop.height, crop.percent, upright.height);
  if (!(width >= 1 && height >= 1)) {
    return fail(ErrorCode::invalid_argument,
                fmt::format("the crop contains no pixel of the {} x {} image", upright.width, upright.height), "crop");
  }
  if (!(x >= 0 && y >= 0 && x + width <= upright.width && y + height <= upright.height)) {
    return fail(ErrorCode::invalid_argument,
                fmt::format("the crop extends to column {:g} and row {:g}, but the upright image has {} x {} pixels",
                            x + width, y + height, upright.width, upright.height),
                "crop");
  }
  return Rect{static_cast<int>(x), static_cast<int>(y), static_cast<int>(width), static_cast<int>(height)};
}

PictureSize shrunk_size(const PictureSize& size, int max_size) {
  const int longest = std::max(size.width, size.height);
  if (longest <= max_size) return size;
  const auto scaled = [&](int side) {
    return std::max(1, static_cast<int>(std::lround(static_cast<double>(side) * max_size / longest)));
  };
  return {scaled(size.width), scaled(size.height)};
}

}  // namespace

Rect before_orientation(const Rect& region, const PictureSize& upright, Orientation orientation) {
  const int right = upright.width - region.x - region.width, below = upright.height - region.y - region.height;
  switch (orientation) {
    case Orientation::normal:
      return region;
    case Orientation::mirror_horizontal:
      return {right, region.y, region.width, region.height};
    case Orientation::rotate_180:
      return {right, below, region.width, region.height};
    case Orientation::mirror_vertical:
      return {region.x, below, region.width, region.height};
    case Orientation::transpose:
      return {region.y, region.x, region.height, region.width};
    case Orientation::rotate_90:
      return {region.y, right, region.height, region.width};
    case Orientation::transverse:
      return {below, right, region.height, region.width};
    case Orientation::rotate_270:
      return {below, region.x, region.height, region.width};
  }
  return region;
}

Result<std::optional<Framing>> decide_framing(const PictureSize& size, Orientation orientation,
                                              const DevelopOptions& options) {
  Framing out{{0, 0, size.width, size.height}, size};
  if (options.crop) {
    const PictureSize upright = upright_size(size, orientation);
    const Result<Rect> crop = upright_crop(*options.crop, upright);
    if (!crop) return tl::make_unexpected(crop.error());
    out.pixels = before_orientation(*crop, upright, orientation);
    out.size = {out.pixels.width, out.pixels.height};
  }
  if (options.max_size) out.size = shrunk_size(out.size, *options.max_size);
  if (out.size.width == size.width && out.size.height == size.height) return std::optional<Framing>{};
  return std::optional<Framing>{out};
}

}  // namespace lowlux::isp
