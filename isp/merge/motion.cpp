#include "isp/merge/motion.h"

#include <algorithm>
#include <cmath>

namespace lowlux::merge {
namespace {

std::vector<double> shifts_px(const Motion& motion) {
  std::vector<double> out(motion.dx_px.size());
  for (std::size_t i = 0; i < out.size(); ++i) {
    out[i] = std::hypot(static_cast<double>(motion.dx_px.data()[i]), static_cast<double>(motion.dy_px.data()[i]));
  }
  return out;
}

}  // namespace

Shift Motion::at(float x, float y) const {
  const auto spacing = static_cast<float>(spacing_px);
  const float column = x / spacing, row = y / spacing;
  const int i = std::clamp(static_cast<int>(column), 0, dx_px.width() - 2);
  const int j = std::clamp(static_cast<int>(row), 0, dx_px.height() - 2);
  const float u = column - static_cast<float>(i), v = row - static_cast<float>(j);
  const auto mixed = [&](const Plane<float>& plane) {
    const float* const upper = plane.row(j) + i;
    const float* const lower = plane.row(j + 1) + i;
    return (1 - v) * ((1 - u) * upper[0] + u * upper[1]) + v * ((1 - u) * lower[0] + u * lower[1]);
  };
  return {mixed(dx_px), mixed(dy_px)};
}

double largest_shift_px(const Motion& motion) {
  const std::vector<double> shifts = shifts_px(motion);
  return *std::ranges::max_element(shifts);
}

double median_shift_px(const Motion& motion) {
  std::vector<double> shifts = shifts_px(motion);
  const auto middle = shifts.begin() + static_cast<std::ptrdiff_t>(shifts.size() / 2);
  std::ranges::nth_element(shifts, middle);
  return *middle;
}

Motion no_motion(int width, int height, int spacing_px) {
  Motion motion{.spacing_px = spacing_px};
  const auto nodes = [&](int size) { return std::max(2, (size - 1 + spacing_px - 1) / spacing_px + 1); };
  for (Plane<float>* plane : {&motion.dx_px, &motion.dy_px}) {
    *plane = Plane<float>(nodes(width), nodes(height));
    std::fill_n(plane->data(), plane->size(), 0.0F);
  }
  return motion;
}

}  // namespace lowlux::merge
