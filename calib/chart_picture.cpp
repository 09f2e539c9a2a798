#include "calib/chart_picture.h"

#include <algorithm>
#include <cassert>
#include <cstddef>

namespace lowlux::calib {

ChartPicture chart_picture(const SignalFraction& mosaic, const RawDn& raw) {
  assert(raw.layout == SensorLayout::bayer);
  assert(mosaic.value.width() == raw.active.width && mosaic.value.height() == raw.active.height);
  const int width = raw.active.width / 2, height = raw.active.height / 2;
  ChartPicture out{CameraRgb(width, height), Plane<std::uint8_t>(width, height)};
  const auto codes = raw.dn.view().crop(raw.active.x, raw.active.y, raw.active.width, raw.active.height);
  for (int y = 0; y < height; ++y) {
    std::fill_n(out.clipped.row(y), width, std::uint8_t{0});
    for (const auto& plane : out.rgb.view()) std::fill_n(plane.row(y), width, 0.0F);
    for (int x = 0; x < width; ++x) {
      for (int site = 0; site < 4; ++site) {
        const int column = 2 * x + (site & 1), row = 2 * y + (site >> 1);
        const auto colour = static_cast<std::size_t>(colour_at(mosaic.phase, column, row));
        out.rgb.plane[colour].at(x, y) += mosaic.value.at(column, row) * (colour == 1 ? 0.5F : 1.0F);
        if (codes.at(column, row) >= raw.white_dn[colour]) out.clipped.at(x, y) = 1;
      }
    }
  }
  return out;
}

}  // namespace lowlux::calib
