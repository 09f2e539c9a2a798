#include "isp/merge/placement.h"

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>
#include <limits>
#include <vector>

#include "isp/merge/inverse_motion.h"

namespace lowlux::merge {
namespace {

constexpr float nan = std::numeric_limits<float>::quiet_NaN();

/// Returns the weights of four neighbours for the fraction t in 0..1 between the second and the third.
std::array<float, 4> cubic_weights(float t) {
  const float t2 = t * t, t3 = t2 * t;
  return {-0.5F * t3 + t2 - 0.5F * t, 1.5F * t3 - 2.5F * t2 + 1, -1.5F * t3 + 2 * t2 + 0.5F * t, 0.5F * t3 - 0.5F * t2};
}

/// Returns the value of a plane at (x, y), which lies within it; beyond the border, values of the border.
float interpolated(PlaneView<const float> plane, float x, float y) {
  const int left = static_cast<int>(x), top = static_cast<int>(y);
  const auto wx = cubic_weights(x - static_cast<float>(left)), wy = cubic_weights(y - static_cast<float>(top));
  float sum = 0;
  if (left >= 1 && top >= 1 && left + 2 < plane.width && top + 2 < plane.height) {
    for (int j = 0; j < 4; ++j) {
      const float* const row = plane.row(top - 1 + j) + left - 1;
      sum += wy[j] * (wx[0] * row[0] + wx[1] * row[1] + wx[2] * row[2] + wx[3] * row[3]);
    }
    return sum;
  }
  for (int j = 0; j < 4; ++j) {
    const float* const row = plane.row(std::clamp(top - 1 + j, 0, plane.height - 1));
    for (int i = 0; i < 4; ++i) sum += wy[j] * wx[i] * row[std::clamp(left - 1 + i, 0, plane.width - 1)];
  }
  return sum;
}

/// Interpolates one component of the displacement along a row.
/// @param row  upper row of nodes
/// @param v    position between it and the next, 0..1
void fill_shifts(const Plane<float>& nodes, int spacing, int row, float v, std::vector<float>& out) {
  const int width = static_cast<int>(out.size());
  for (int column = 0, x = 0; x < width; ++column) {
    const int i = std::min(column, nodes.width() - 2);
    const float left = (1 - v) * nodes.at(i, row) + v * nodes.at(i, row + 1);
    const float right = (1 - v) * nodes.at(i + 1, row) + v * nodes.at(i + 1, row + 1);
    const float slope = (right - left) / static_cast<float>(spacing);
    for (const int end = std::min(width, (column + 1) * spacing); x < end; ++x) {
      out[x] = left + slope * static_cast<float>(x - i * spacing);
    }
  }
}

/// Finds the displacements of the pixels of a row.
void find_shifts(const Motion& motion, int y, std::vector<float>& dx_px, std::vector<float>& dy_px) {
  const int row = std::clamp(y / motion.spacing_px, 0, motion.dx_px.height() - 2);
  const float v = static_cast<float>(y - row * motion.spacing_px) / static_cast<float>(motion.spacing_px);
  fill_shifts(motion.dx_px, motion.spacing_px, row, v, dx_px);
  fill_shifts(motion.dy_px, motion.spacing_px, row, v, dy_px);
}

/// Returns the even displacement nearest to `shift`: a multiple of a CFA cell.
int whole_cells(float shift) { return 2 * static_cast<int>(std::lround(shift / 2)); }

const PlaneView<const float>& of_colour(const RgbView<const float>& rgb, BayerPhase phase, int x, int y) {
  return rgb[static_cast<std::size_t>(colour_at(phase, x, y))];
}

/// Returns P(p), 0 without a prediction.
float predicted_at(const RgbView<const float>& prediction, BayerPhase phase, int x, int y) {
  const auto& plane = of_colour(prediction, phase, x, y);
  return plane.data != nullptr ? plane.at(x, y) : 0;
}

/// Returns where the content of a frame's sites lies in the reference: what is at q of the frame is at q + at(q) there.
/// Between nodes it is interpolated like the motion itself; NaN where there is no inverse.
Motion displacements_back(const Motion& motion) {
  const MotionInverse inverse(motion);
  Motion out{.spacing_px = motion.spacing_px};
  out.dx_px = Plane<float>(motion.dx_px.width(), motion.dx_px.height());
  out.dy_px = Plane<float>(motion.dx_px.width(), motion.dx_px.height());
  for (int j = 0; j < out.dx_px.height(); ++j) {
    for (int i = 0; i < out.dx_px.width(); ++i) {
      const Point q{static_cast<double>(motion.spacing_px) * i, static_cast<double>(motion.spacing_px) * j};
      const Point u = inverse.at(q);
      out.dx_px.at(i, j) = static_cast<float>(u.x - q.x);
      out.dy_px.at(i, j) = static_cast<float>(u.y - q.y);
    }
  }
  return out;
}

/// Returns the first column >= `from` of a parity.
int first_of_parity(int from, int parity) { return from + ((from ^ parity) & 1); }

/// Adds up the differences of one colour around a position.
class Gathering {
 public:
  Gathering(PlaneView<const float> differences, BayerPhase phase, float radius)
      : differences_(differences), phase_(phase), radius_(radius), per_radius_(1 / radius) {}

  struct Sums {
    float value = 0, weight = 0;
  };
  /// @param colour  that of the sites that count
  Sums around(float x, float y, CfaColour colour) const {
    Sums sums;
    const int first_x = std::max(0, ceiling(x - radius_)),
              last_x = std::min(differences_.width - 1, floor(x + radius_));
    const int first_y = std::max(0, ceiling(y - radius_)),
              last_y = std::min(differences_.height - 1, floor(y + radius_));
    for (int v = first_y; v <= last_y; ++v) {
      const bool in_red_row = (v & 1) == red_row(phase_);
      if (colour != CfaColour::green && in_red_row != (colour == CfaColour::red)) continue;
      const int parity = red_column(phase_) ^ ((colour == CfaColour::green) == in_red_row ? 1 : 0);
      const float ty = 1 - std::fabs(static_cast<float>(v) - y) * per_radius_;
      const float* const row = differences_.row(v);
      for (int u = first_of_parity(first_x, parity); u <= last_x; u += 2) {
        if (row[u] != row[u]) continue;
        const float t = ty * (1 - std::fabs(static_cast<float>(u) - x) * per_radius_);
        sums.value += t * row[u];
        sums.weight += t;
      }
    }
    return sums;
  }

 private:
  static int floor(float v) {
    const int whole = static_cast<int>(v);
    return static_cast<float>(whole) > v ? whole - 1 : whole;
  }
  static int ceiling(float v) { return -floor(-v); }

  PlaneView<const float> differences_;
  BayerPhase phase_;
  float radius_;
  float per_radius_;
};

}  // namespace

void subtract_prediction(const FrameView& frame, double light, const Motion& motion,
                         const RgbView<const float>& prediction, PlaneView<float> differences, Executor& executor) {
  assert(differences.width == frame.signal_e.width && differences.height == frame.signal_e.height);
  const int width = differences.width;
  const auto per_light = static_cast<float>(1 / light);
  const auto right = static_cast<float>(width - 1), bottom = static_cast<float>(differences.height - 1);
  const bool predicts = prediction[0].data != nullptr;
  const Motion inverse = predicts ? displacements_back(motion) : Motion{};
  for_each_band(executor, differences.height, [&](RowBand band, int) {
    std::vector<float> dx_px(static_cast<std::size_t>(width)), dy_px(dx_px.size());
    for (int y = band.first; y < band.last; ++y) {
      const float* const signal_e = frame.signal_e.row(y);
      float* const out = differences.row(y);
      if (predicts) find_shifts(inverse, y, dx_px, dy_px);
      for (int x = 0; x < width; ++x) {
        out[x] = signal_e[x] * per_light;
        if (!predicts) continue;
        const float u = static_cast<float>(x) + dx_px[x], v = static_cast<float>(y) + dy_px[x];
        const bool inside = u >= 0 && v >= 0 && u <= right && v <= bottom;
        out[x] -= inside ? interpolated(of_colour(prediction, frame.phase, x, y), u, v) : nan;
      }
    }
  });
}

void place_nearest(PlaneView<const float> differences, BayerPhase phase, const Motion& motion,
                   const RgbView<const float>& prediction, PlaneView<float> placed, Executor& executor) {
  for_each_band(executor, placed.height, [&](RowBand band, int) {
    std::vector<float> dx_px(static_cast<std::size_t>(placed.width)), dy_px(dx_px.size());
    for (int y = band.first; y < band.last; ++y) {
      find_shifts(motion, y, dx_px, dy_px);
      for (int x = 0; x < placed.width; ++x) {
        const int u = x + whole_cells(dx_px[x]), v = y + whole_cells(dy_px[x]);
        const bool inside = u >= 0 && v >= 0 && u < placed.width && v < placed.height;
        placed.at(x, y) = inside ? differences.at(u, v) + predicted_at(prediction, phase, x, y) : nan;
      }
    }
  });
}

DropRows::DropRows(PlaneView<const float> differences, BayerPhase phase, const Motion& motion,
                   const RgbView<const float>& prediction, double radius_px)
    : differences_(differences),
      phase_(phase),
      motion_(motion),
      prediction_(prediction),
      radius_(static_cast<float>(radius_px)),
      row_{std::vector<float>(static_cast<std::size_t>(differences.width)),
           std::vector<float>(static_cast<std::size_t>(differences.width))},
      dx_px_(row_.value.size()),
      dy_px_(row_.value.size()) {}

const DropRows::Row& DropRows::row(int y) {
  const Gathering gathering(differences_, phase_, radius_);
  find_shifts(motion_, y, dx_px_, dy_px_);
  for (int x = 0; x < differences_.width; ++x) {
    const CfaColour colour = colour_at(phase_, x, y);
    const Gathering::Sums sums =
        gathering.around(static_cast<float>(x) + dx_px_[x], static_cast<float>(y) + dy_px_[x], colour);
    row_.value[x] = sums.weight > 0 ? sums.value / sums.weight + predicted_at(prediction_, phase_, x, y) : nan;
    row_.weight[x] = sums.weight * (colour == CfaColour::green ? 2 : 4) / (radius_ * radius_);
  }
  return row_;
}

}  // namespace lowlux::merge
