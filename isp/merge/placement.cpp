#include "isp/merge/placement.h"

#include <algorithm>
#include <cassert>
#include <cstddef>
#include <span>
#include <vector>

#include "isp/merge/inverse_motion.h"
#include "isp/merge/placement_rows.h"

namespace lowlux::merge {
namespace {

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

/// Finds the displacements of the pixels of a row, which are held in dx_px and dy_px.
rows::DisplacedRow displaced(const Motion& motion, int y, std::vector<float>& dx_px, std::vector<float>& dy_px) {
  const int row = std::clamp(y / motion.spacing_px, 0, motion.dx_px.height() - 2);
  const float v = static_cast<float>(y - row * motion.spacing_px) / static_cast<float>(motion.spacing_px);
  fill_shifts(motion.dx_px, motion.spacing_px, row, v, dx_px);
  fill_shifts(motion.dy_px, motion.spacing_px, row, v, dy_px);
  return {y, static_cast<int>(dx_px.size()), dx_px.data(), dy_px.data()};
}

rows::Samples samples_of(PlaneView<const float> plane) { return {plane.data, plane.stride, plane.width, plane.height}; }

/// Returns the plane of the colour that a mosaic has at a site.
rows::Samples of_colour(const RgbView<const float>& rgb, BayerPhase phase, int x, int y) {
  return samples_of(rgb[static_cast<std::size_t>(colour_at(phase, x, y))]);
}

/// Adds P(p) to a row of differences; nothing without a prediction.
void add_prediction(const RgbView<const float>& prediction, BayerPhase phase, int y, std::span<float> row) {
  if (prediction[0].data == nullptr) return;
  const float* const even = prediction[static_cast<std::size_t>(colour_at(phase, 0, y))].row(y);
  const float* const odd = prediction[static_cast<std::size_t>(colour_at(phase, 1, y))].row(y);
  for (std::size_t x = 0; x < row.size(); ++x) row[x] += x % 2 == 0 ? even[x] : odd[x];
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

}  // namespace

void subtract_prediction(const FrameView& frame, double light, const Motion& motion,
                         const RgbView<const float>& prediction, PlaneView<float> differences, Executor& executor) {
  assert(differences.width == frame.signal_e.width && differences.height == frame.signal_e.height);
  const int width = differences.width;
  const auto per_light = static_cast<float>(1 / light);
  const bool predicts = prediction[0].data != nullptr;
  const Motion inverse = predicts ? displacements_back(motion) : Motion{};
  for_each_band(executor, differences.height, [&](RowBand band, int) {
    std::vector<float> dx_px(static_cast<std::size_t>(width)), dy_px(dx_px.size()), expected(dx_px.size());
    for (int y = band.first; y < band.last; ++y) {
      const float* const signal_e = frame.signal_e.row(y);
      if (predicts) {
        rows::interpolate_row(of_colour(prediction, frame.phase, 0, y), of_colour(prediction, frame.phase, 1, y),
                              displaced(inverse, y, dx_px, dy_px), expected.data());
      }
      float* const out = differences.row(y);
      for (int x = 0; x < width; ++x) out[x] = signal_e[x] * per_light - expected[x];
    }
  });
}

void place_nearest(PlaneView<const float> differences, BayerPhase phase, const Motion& motion,
                   const RgbView<const float>& prediction, PlaneView<float> placed, Executor& executor) {
  for_each_band(executor, placed.height, [&](RowBand band, int) {
    std::vector<float> dx_px(static_cast<std::size_t>(placed.width)), dy_px(dx_px.size());
    for (int y = band.first; y < band.last; ++y) {
      float* const out = placed.row(y);
      rows::nearest_row(samples_of(differences), displaced(motion, y, dx_px, dy_px), out);
      add_prediction(prediction, phase, y, {out, static_cast<std::size_t>(placed.width)});
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
  const auto radius = [&](int x) {
    return colour_at(phase_, x, y) == CfaColour::green ? radius_ : std::max(radius_, min_red_blue_px);
  };
  rows::drop_row({samples_of(differences_), red_column(phase_), red_row(phase_)}, displaced(motion_, y, dx_px_, dy_px_),
                 {radius(0), radius(1)}, row_.value.data(), row_.weight.data());
  add_prediction(prediction_, phase_, y, row_.value);
  const auto per_mean = [&](int x) {
    return (colour_at(phase_, x, y) == CfaColour::green ? 2.0F : 4.0F) / (radius(x) * radius(x));
  };
  const float even = per_mean(0), odd = per_mean(1);
  for (std::size_t x = 0; x < row_.weight.size(); ++x) row_.weight[x] *= x % 2 == 0 ? even : odd;
  return row_;
}

ColourDropRows::ColourDropRows(PlaneView<const float> differences, BayerPhase phase, const Motion& motion,
                               const RgbView<const float>& prediction)
    : differences_(differences),
      phase_(phase),
      motion_(motion),
      prediction_(prediction),
      dx_px_(static_cast<std::size_t>(differences.width)),
      dy_px_(dx_px_.size()) {
  row_.value.fill(dx_px_);
  row_.weight.fill(dx_px_);
}

const ColourDropRows::Row& ColourDropRows::row(int y) {
  rows::ColourRow out{};
  for (std::size_t c = 0; c < 3; ++c) {
    out.value[c] = row_.value[c].data();
    out.weight[c] = row_.weight[c].data();
  }
  rows::colour_row({samples_of(differences_), red_column(phase_), red_row(phase_)},
                   displaced(motion_, y, dx_px_, dy_px_), {green_px, red_blue_px}, out);
  for (std::size_t c = 0; c < 3; ++c) {
    const float* const predicted = prediction_[c].row(y);
    for (std::size_t x = 0; x < dx_px_.size(); ++x) out.value[c][x] += out.weight[c][x] * predicted[x];
  }
  return row_;
}

}  // namespace lowlux::merge
