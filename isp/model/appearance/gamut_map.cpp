#include "isp/model/appearance/gamut_map.h"

#include <algorithm>

namespace lowlux::isp {

GamutMapped toward_white(const Vector3& rgb, const Vector3& luminance_weights) {
  const Vector3& w = luminance_weights;
  const double y = w[0] * rgb[0] + w[1] * rgb[1] + w[2] * rgb[2];
  const double grey = std::clamp(y, 0.0, 1.0);
  double t = 1;
  for (const double value : rgb) {
    if (value > 1) t = std::min(t, std::max(0.0, (1 - grey) / (value - y)));
    if (value < 0) t = std::min(t, std::max(0.0, grey / (y - value)));
  }
  if (grey != y) t = 0;
  Vector3 out{};
  for (int i = 0; i < 3; ++i) out[i] = std::clamp(grey + t * (rgb[i] - grey), 0.0, 1.0);
  return {out, t};
}

}  // namespace lowlux::isp
