#include "capture/x_trans/x_trans_frame.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <numeric>
#include <optional>
#include <thread>
#include <utility>
#include <vector>

#include "capture/x_trans/x_trans.h"
#include "isp/base/executor.h"

namespace lowlux::capture {
namespace {

constexpr int period = x_trans_period;
constexpr std::array<double, 3> density{8.0 / 36, 20.0 / 36, 8.0 / 36};  // fraction of the sites of R, G, B
constexpr double max_neutral_ratio = 16;

using PerColour = std::array<double, 3>;

std::size_t colour_index(const XTransPhase& phase, int x, int y) {
  return static_cast<std::size_t>(colour_at(phase, x, y));
}

double mean_of(const std::vector<double>& values) {
  if (values.empty()) return 0;
  return std::accumulate(values.begin(), values.end(), 0.0) / static_cast<double>(values.size());
}

/// Returns the mean black level of each colour.
PerColour mean_black(const BlackLevel& black, const XTransPhase& phase) {
  PerColour sum{}, count{};
  for (int y = 0; y < black.rows * period; ++y) {
    for (int x = 0; x < black.columns * period; ++x) {
      const std::size_t c = colour_index(phase, x, y);
      sum[c] += black.pattern_dn[y % black.rows * black.columns + x % black.columns];
      ++count[c];
    }
  }
  const double deltas = mean_of(black.column_dn) + mean_of(black.row_dn);
  for (std::size_t c = 0; c < 3; ++c) sum[c] = sum[c] / count[c] + deltas;
  return sum;
}

/// Returns a black level of each colour, without a pattern.
BlackLevel black_of_planes(const PerColour& black) {
  return {.samples = 3, .pattern_dn = {black[0], black[1], black[2]}};
}

/// Returns the mean of the masked sites of each colour, as a pattern from the corner of the active area; nullopt where
/// the file states no masked areas, or where they lack a colour.
std::optional<BlackLevel> measure_black(const RawDn& raw, const XTransPhase& phase) {
  if (!raw.masked_is_stated || raw.is_float()) return std::nullopt;
  PerColour sum{}, count{};
  for (const Rect& area : raw.masked) {
    for (int y = area.y; y < area.y + area.height; ++y) {
      for (int x = area.x; x < area.x + area.width; ++x) {
        const std::size_t c = colour_index(phase, x - raw.active.x, y - raw.active.y);
        sum[c] += raw.dn.row(y)[x];
        ++count[c];
      }
    }
  }
  if (std::min({count[0], count[1], count[2]}) == 0) return std::nullopt;
  BlackLevel black{.rows = period, .columns = period};
  for (int i = 0; i < period * period; ++i) {
    const std::size_t c = colour_index(phase, i % period, i / period);
    black.pattern_dn.push_back(sum[c] / count[c]);
  }
  return black;
}

/// Returns the active area as fractions of white; a sample at white or above is 1 or more whatever its black level.
template <class Sample>
Plane<float> fractions(PlaneView<const Sample> active, const XTransPhase& phase, const BlackLevel& black,
                       const PerColour& mean, const PerColour& white) {
  Plane<float> out(active.width, active.height);
  for (int y = 0; y < active.height; ++y) {
    for (int x = 0; x < active.width; ++x) {
      const std::size_t c = colour_index(phase, x, y);
      const double dn = active.row(y)[x], fraction = (dn - black.at(x, y)) / (white[c] - mean[c]);
      out.row(y)[x] = static_cast<float>(dn >= white[c] ? std::max(fraction, 1.0) : fraction);
    }
  }
  return out;
}

/// Returns what a neutral is in R, G, B: as shot, else the mean of the frame.
PerColour neutral_of(const CameraColour& colour, PlaneView<const float> mosaic, const XTransPhase& phase) {
  PerColour neutral{};
  if (colour.as_shot_neutral) {
    neutral = {(*colour.as_shot_neutral)[0], (*colour.as_shot_neutral)[1], (*colour.as_shot_neutral)[2]};
  } else {
    for (int y = 0; y < mosaic.height; ++y) {
      for (int x = 0; x < mosaic.width; ++x) {
        const std::size_t c = colour_index(phase, x, y);
        neutral[c] += static_cast<double>(mosaic.row(y)[x]) / density[c];
      }
    }
  }
  if (!(neutral[1] > 0) || !std::isfinite(neutral[1])) return {1, 1, 1};
  for (const std::size_t c : {std::size_t{0}, std::size_t{2}}) {
    const double ratio = neutral[c] / neutral[1];
    neutral[c] = std::isfinite(ratio) ? std::clamp(ratio, 1 / max_neutral_ratio, max_neutral_ratio) : 1;
  }
  neutral[1] = 1;
  return neutral;
}

/// Returns the noise of a site: as the file states it for green, else as estimated.
NoiseLine noise_of(const std::optional<NoiseProfile>& stated, PlaneView<const float> mosaic, const XTransPhase& phase) {
  if (stated) return {std::max(stated->scale[1], 0.0), std::max(stated->offset[1], 0.0)};
  return estimate_mosaic_noise(mosaic, phase);
}

/// Returns noise that was measured on the mosaic: the same for all colours.
NoiseProfile profile_of(const NoiseLine& noise) {
  return {.scale = {noise.scale, noise.scale, noise.scale},
          .offset = {noise.offset, noise.offset, noise.offset},
          .source = NoiseProfile::Source::picture};
}

/// Changes fractions of white to DN above zero.
void to_dn(PlaneView<float> rgb, const PerColour& black, const PerColour& white) {
  for (int y = 0; y < rgb.height; ++y) {
    float* row = rgb.row(y);
    for (int i = 0; i < rgb.width; ++i) {
      const auto c = i % 3;
      row[i] = static_cast<float>(static_cast<double>(row[i]) * (white[c] - black[c]) + black[c]);
    }
  }
}

/// Sets the geometry of a frame that consists of its active area.
void keep_active_area(RawDn& raw) {
  raw.active = {0, 0, raw.active.width, raw.active.height};
  raw.masked.clear();
  raw.masked_is_stated = false;
}

}  // namespace

void interpolate_frame(RawFrame& frame, const XTransPhase& phase) {
  PoolExecutor executor(std::clamp(static_cast<int>(std::thread::hardware_concurrency()), 1, 8));
  RawDn& raw = frame.raw;
  const Rect active = raw.active;
  if (!raw.black_tag) raw.black_tag = measure_black(raw, phase);
  const BlackLevel black = raw.black_tag.value_or(BlackLevel{.pattern_dn = {0}});
  const PerColour mean = mean_black(black, phase);
  Plane<float> mosaic = with_samples(raw, [&]<class Sample>(PlaneView<const Sample> readout) {
    return fractions(readout.crop(active.x, active.y, active.width, active.height), phase, black, mean, raw.white_dn);
  });
  raw.dn = {};
  repair_mosaic(mosaic.view(), phase, frame.corrections.defects);
  const NoiseLine noise = noise_of(frame.noise, mosaic.view(), phase);
  repair_mosaic(mosaic.view(), phase, find_mosaic_defects(mosaic.view(), phase, noise, executor));
  frame.corrections.defects.clear();
  raw.dn_float = Plane<float>(3 * active.width, active.height);
  interpolate_x_trans(mosaic.view(), {phase, neutral_of(frame.colour, mosaic.view(), phase), noise.scale, noise.offset},
                      raw.dn_float.view(), executor);
  to_dn(raw.dn_float.view(), mean, raw.white_dn);
  if (raw.black_tag) raw.black_tag = black_of_planes(mean);
  keep_active_area(raw);
  raw.layout = SensorLayout::linear_rgb;
  raw.from_x_trans = true;
  if (!frame.noise && noise.scale > 0) frame.noise = profile_of(noise);
  for (std::size_t c = 0; frame.noise && c < 3; ++c) {
    frame.noise->scale[c] /= density[c];
    frame.noise->offset[c] /= density[c];
  }
  frame.noise_ratio = nullptr;
}

Result<bool> keep_x_trans(RawFrame& /*mosaic*/) { return false; }

Result<void> use_mosaic(RawFrame& frame, const XTransPhase& phase, const XTransUse& use) {
  if (use) {
    frame.raw.layout = SensorLayout::bayer;
    const Result<bool> interpolates = use(frame);
    if (!interpolates) return tl::make_unexpected(interpolates.error());
    if (!*interpolates) return {};
  }
  interpolate_frame(frame, phase);
  return {};
}

}  // namespace lowlux::capture
