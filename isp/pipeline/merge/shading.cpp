#include "isp/pipeline/merge/shading.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <utility>

#include "isp/merge/inverse_motion.h"

namespace lowlux::isp {
namespace {

constexpr int block_px = 16;  // in which content moves alike

/// Returns the even number nearest to a displacement: content stays on the sites of its colour.
int whole_cells(double displacement_px) { return 2 * static_cast<int>(std::lround(displacement_px / 2)); }

float gain_at(PlaneView<const float> gain, int x, int y) {
  if (gain.data == nullptr) return 1;
  // Beyond the border, a site of the same colour at it.
  const auto inside = [](int at, int size) { return at < 0 ? at & 1 : at < size ? at : size - 2 + ((at ^ size) & 1); };
  return gain.at(std::clamp(inside(x, gain.width), 0, gain.width - 1),
                 std::clamp(inside(y, gain.height), 0, gain.height - 1));
}

}  // namespace

Plane<float> unshaded(const FrameElectrons& frame, Executor& executor) {
  if (frame.gain.empty()) return {};
  Plane<float> out(frame.gain.width(), frame.gain.height());
  for_each_index(executor, out.height(), [&](int y) {
    for (int x = 0; x < out.width(); ++x) out.at(x, y) = frame.signal_e.at(x, y) * frame.gain.at(x, y);
  });
  return out;
}

void change_shading(FrameElectrons& frame, const merge::Motion& motion, PlaneView<const float> reference_gain,
                    Executor& executor) {
  const PlaneView<const float> gain = std::as_const(frame.gain).view();
  if (gain.data == nullptr && reference_gain.data == nullptr) return;
  const merge::MotionInverse inverse(motion);
  const int width = frame.signal_e.width(), height = frame.signal_e.height();
  for_each_index(executor, (height + block_px - 1) / block_px, [&](int row) {
    const int top = block_px * row, bottom = std::min(top + block_px, height);
    for (int left = 0; left < width; left += block_px) {
      const merge::Point middle{left + 0.5 * block_px, top + 0.5 * block_px}, there = inverse.at(middle);
      if (!std::isfinite(there.x) || !std::isfinite(there.y)) continue;
      const int dx = whole_cells(std::clamp(there.x - middle.x, -1.0 * width, 1.0 * width)),
                dy = whole_cells(std::clamp(there.y - middle.y, -1.0 * height, 1.0 * height));
      for (int y = top; y < bottom; ++y) {
        for (int x = left; x < std::min(left + block_px, width); ++x) {
          float& signal_e = frame.signal_e.at(x, y);
          const auto colour = static_cast<std::size_t>(colour_at(frame.phase, x, y));
          if (static_cast<double>(signal_e) >= frame.saturation_e[colour]) continue;  // its light is not known
          const float ratio = gain_at(gain, x, y) / gain_at(reference_gain, x + dx, y + dy);
          if (std::isfinite(ratio) && ratio > 0) signal_e *= ratio;
        }
      }
    }
  });
}

}  // namespace lowlux::isp
