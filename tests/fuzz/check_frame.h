#pragma once

#include <cstdlib>

#include "isp/base/float_samples.h"
#include "isp/base/frame.h"

namespace lowlux::test {

inline bool inside(const Rect& r, int width, int height) {
  return r.x >= 0 && r.y >= 0 && r.width > 0 && r.height > 0 && r.width <= width - r.x && r.height <= height - r.y;
}

/// What every caller may rely on, whatever the file says.
inline void check(const RawFrame& frame) {
  const RawDn& raw = frame.raw;
  const int samples = raw.layout == SensorLayout::linear_rgb ? 3 : 1;
  bool good = raw.dn.empty() != raw.dn_float.empty() && raw.row_samples() % samples == 0 && !unusable_sample(raw);
  const int width = raw.row_samples() / samples, height = raw.rows();
  good = good && inside(raw.active, width, height);
  good = good && inside(raw.default_crop, raw.active.width, raw.active.height);
  for (const Rect& r : raw.masked) good = good && inside(r, width, height);
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
  if (frame.noise_ratio) {
    const Plane<float>& ratio = frame.noise_ratio->ratio;
    good = good && ratio.width() == ratio_blocks(raw.active.width, frame.noise_ratio->block_px) &&
           ratio.height() == ratio_blocks(raw.active.height, frame.noise_ratio->block_px);
    for (std::size_t i = 0; i < ratio.size(); ++i) good = good && ratio.data()[i] > 0;
  }
  if (!good) std::abort();
}

}  // namespace lowlux::test
