#include "isp/raw/corrections.h"

#include <algorithm>
#include <cmath>

#include "isp/base/cfa.h"
#include "isp/base/gain_at.h"

namespace lowlux::isp {
namespace {

// Returns the first index >= start in start + k * pitch that is >= at.
int aligned_up(int start, int pitch, int at) {
  return at <= start ? start : start + (at - start + pitch - 1) / pitch * pitch;
}

void multiply(const GainMap& map, int plane, const FramePlace& place, PlaneView<float> out, Executor& executor) {
  const int bottom = std::min(map.bottom, place.frame_height);
  const int right = std::min({map.right, place.frame_width, place.x + out.width});
  for_each_band(executor, out.height, [&](RowBand band, int) {
    const int end = std::min(place.y + band.last, bottom);
    for (int y = aligned_up(map.top, map.row_pitch, place.y + band.first); y < end; y += map.row_pitch) {
      const GridPosition v = row_position(map, y, place.frame_height);
      float* row = out.row(y - place.y);
      for (int x = aligned_up(map.left, map.column_pitch, place.x); x < right; x += map.column_pitch) {
        row[x - place.x] *= gain_at(map, v, column_position(map, x, place.frame_width), plane);
      }
    }
  });
}

void multiply(const RadialGain& gain, const FramePlace& place, PlaneView<float> out, Executor& executor) {
  const RadialGainAt gain_at(gain, place.frame_width, place.frame_height);
  for_each_band(executor, out.height, [&](RowBand band, int) {
    for (int y = band.first; y < band.last; ++y) {
      float* row = out.row(y);
      for (int x = 0; x < out.width; ++x) row[x] *= static_cast<float>(gain_at(place.x + x, place.y + y));
    }
  });
}

FramePlace whole_of(PlaneView<float> plane) { return {0, 0, plane.width, plane.height}; }

/// Holds the gains of two rows of a frame, and their relative variance.
class GainRows {
 public:
  GainRows(int frame_width, int frame_height)
      : frame_height_(frame_height), gain_(frame_width, 2), of_map_(frame_width, 2), variance_(frame_width, 2) {}

  /// @param y  the first row, even
  void find(const RawCorrections& corrections, int y) {
    rows_ = std::min(2, frame_height_ - y);
    const FramePlace place{0, y, gain_.width(), frame_height_};
    std::fill_n(gain_.data(), gain_.size(), 1.0f);
    std::fill_n(variance_.data(), variance_.size(), 0.0f);
    apply_gains(corrections, place, gain_.view().crop(0, 0, gain_.width(), rows_), executor_);
    for (const GainMap& map : corrections.gain_maps) {
      if (is_measured(map)) add_variance(map, place);
    }
  }
  int rows() const { return rows_; }
  float gain(int x, int row) const { return gain_.at(x, row); }
  float relative_variance(int x, int row) const { return variance_.at(x, row); }

 private:
  static bool is_measured(const GainMap& map) {
    return std::ranges::any_of(map.noise, [](const GainNoise& noise) { return noise.shot > 0 || noise.read > 0; });
  }

  void add_variance(const GainMap& map, const FramePlace& place) {
    std::fill_n(of_map_.data(), of_map_.size(), 1.0f);
    multiply(map, map.first_plane, place, of_map_.view().crop(0, 0, of_map_.width(), rows_), executor_);
    for (int row = 0; row < rows_; ++row) {
      for (int x = 0; x < of_map_.width(); ++x) {
        const double gain = of_map_.at(x, row);
        const GainNoise& noise = map.noise[static_cast<std::size_t>(site_of(x, place.y + row))];
        variance_.at(x, row) += static_cast<float>(noise.shot * gain + noise.read * gain * gain);
      }
    }
  }

  int frame_height_;
  int rows_ = 0;
  Plane<float> gain_, of_map_, variance_;
  InlineExecutor executor_;
};

}  // namespace

bool has_effect(const GainMap& map) {
  return std::any_of(map.gain.begin(), map.gain.end(), [](float gain) { return gain != 1.0f; });
}

void apply_gains(const RawCorrections& corrections, const FramePlace& place, PlaneView<float> mosaic,
                 Executor& executor) {
  for (const GainMap& map : corrections.gain_maps) multiply(map, map.first_plane, place, mosaic, executor);
  for (const RadialGain& gain : corrections.radial_gains) multiply(gain, place, mosaic, executor);
}

void apply_gains(const RawCorrections& corrections, PlaneView<float> mosaic, Executor& executor) {
  apply_gains(corrections, whole_of(mosaic), mosaic, executor);
}

void apply_gains_to_variance(const RawCorrections& corrections, PlaneView<const float> gained, PlaneView<float> cells,
                             Executor& executor) {
  if (corrections.gain_maps.empty() && corrections.radial_gains.empty()) return;
  for_each_band(executor, cells.height, [&](RowBand band, int) {
    GainRows rows(gained.width, gained.height);
    for (int y = band.first; y < band.last; ++y) {
      rows.find(corrections, 2 * y);
      for (int x = 0; x < cells.width; ++x) {
        const int columns = std::min(2, gained.width - 2 * x);
        float squares = 0, added = 0;
        for (int k = 0; k < rows.rows() * columns; ++k) {
          const int u = 2 * x + k % columns, v = k / columns;
          squares += std::pow(rows.gain(u, v), 2.0f);
          added += rows.relative_variance(u, v) * std::pow(gained.at(u, 2 * y + v), 2.0f);
        }
        const auto pixels = static_cast<float>(rows.rows() * columns);
        cells.row(y)[x] = cells.row(y)[x] * squares / pixels + added / pixels;
      }
    }
  });
}

void apply_gains(const RawCorrections& corrections, RgbView<float> rgb, Executor& executor) {
  for (int plane = 0; plane < 3; ++plane) {
    for (const GainMap& map : corrections.gain_maps) {
      if (plane < map.first_plane || plane >= map.first_plane + map.planes) continue;
      multiply(map, plane, whole_of(rgb[plane]), rgb[plane], executor);
    }
    for (const RadialGain& gain : corrections.radial_gains) multiply(gain, whole_of(rgb[plane]), rgb[plane], executor);
  }
}

}  // namespace lowlux::isp
