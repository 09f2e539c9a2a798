#pragma once

#include <cstdlib>

#include "isp/base/frame.h"

namespace lowlux::test {

inline bool inside(const Rect& r, int width, int height) {
  return r.x >= 0 && r.y >= 0 && r.width > 0 && r.height > 0 && r.width <= width - r.x && r.height <= height - r.y;
}

/// What every caller may rely on, whatever the file says.
inline void check(const RawFrame& frame) {
  const RawDn& raw = frame.raw;
  const int samples = raw.layout == SensorLayout::linear_rgb ? 3 : 1;
  bool good = raw.dn.width() % samples == 0 && inside(raw.active, raw.dn.width() / samples, raw.dn.height());
  good = good && inside(raw.default_crop, raw.active.width, raw.active.height);
  for (const Rect& r : raw.masked) good = good && inside(r, raw.dn.width() / samples, raw.dn.height());
  for (const DefectRect& d : frame.corrections.defects) {
    good = good && inside({d.x, d.y, d.width, d.height}, raw.active.width, raw.active.height);
  }
  for (const GainMap& map : frame.corrections.gain_maps) {
    good = good && map.top < map.bottom && map.bottom <= raw.active.height && map.left < map.right &&
           map.right <= raw.active.width && map.row_pitch > 0 && map.column_pitch > 0 &&
           map.gain.size() == static_cast<std::size_t>(map.points_v) * map.points_h * map.map_planes;
  }
  if (raw.black_tag) {
    const int last = samples - 1;
    const double black = raw.black_tag->at(raw.active.width - 1, raw.active.height - 1, last);
    good = good && black < raw.white_dn[last];
  }
  if (!good) std::abort();
}

}  // namespace lowlux::test
