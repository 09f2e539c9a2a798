#include "isp/pipeline/plan/picked_white.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <vector>

#include <fmt/format.h>

#include "isp/base/cfa.h"
#include "isp/pipeline/plan/dark_charge.h"
#include "isp/pipeline/plan/framing.h"
#include "isp/raw/black_point.h"
#include "isp/raw/corrections.h"
#include "isp/raw/measure/thumbnail.h"
#include "isp/raw/repair.h"

namespace lowlux::isp {
namespace {

constexpr double max_saturated = 0.01;
constexpr double min_standard_errors = 5;

struct ColourSums {
  double sum = 0;
  double squares = 0;
  std::int64_t n = 0;

  void add(double value) { sum += value, squares += value * value, ++n; }
  double mean() const { return sum / static_cast<double>(n); }
  double standard_error() const {
    const auto count = static_cast<double>(n);
    return std::sqrt(std::max(0.0, squares / count - mean() * mean()) / count);
  }
};

/// Holds the sums of fractions of white of a region, by colour, and how many of its samples are saturated.
struct RegionSums {
  std::array<ColourSums, 3> colour;
  std::int64_t saturated = 0;

  void add(const RawDn& raw, const BlackPoint& black, double dn, int x, int y, int sample) {
    const bool bayer = raw.layout == SensorLayout::bayer;
    const int site = bayer ? site_of(x, y) : sample;
    const int c = bayer ? static_cast<int>(colour_at(raw.phase, x, y)) : sample;
    const double pedestal = black.pedestal_dn[static_cast<std::size_t>(site)], white = white_at(raw, site);
    const double level = black.pattern ? black.pattern->at(x, y, sample) : pedestal;
    const double mean = black.pattern && bayer ? mean_of_sites(black.pedestal_dn) : pedestal;
    colour[static_cast<std::size_t>(c)].add((dn - level) / (white - mean));
    saturated += dn >= white;
  }
};

/// Returns whether a pixel comes before another in ascending order: by row, then column.
bool is_before(const Pixel& one, const Pixel& other) { return one.y != other.y ? one.y < other.y : one.x < other.x; }

/// @param defects  ascending: they are left out, because they are repaired in the image
RegionSums sums_of(const RawDn& raw, const BlackPoint& black, const std::vector<Pixel>& defects, const Rect& region) {
  const int samples = raw.layout == SensorLayout::bayer ? 1 : 3;
  RegionSums out;
  with_samples(raw, [&](const auto& readout) {
    for (int y = region.y; y < region.y + region.height; ++y) {
      const auto* const row = readout.row(raw.active.y + y) + samples * raw.active.x;
      for (int x = region.x; x < region.x + region.width; ++x) {
        if (std::ranges::binary_search(defects, Pixel{x, y}, is_before)) continue;
        for (int s = 0; s < samples; ++s) out.add(raw, black, row[samples * x + s], x, y, s);
      }
    }
  });
  return out;
}

/// Returns the region of the active area that a square of the upright image covers; for mosaics whole 2x2 cells.
Result<Rect> region_of(const RawDn& raw, const DevelopOptions& options) {
  const PictureSize size = picture_size(raw, options);
  const Orientation orientation = raw.info.orientation;
  const bool turned = orientation >= Orientation::transpose;
  const PictureSize upright = turned ? PictureSize{size.height, size.width} : size;
  const PickedArea& area = options.white_balance.picked;
  if (area.x < 0 || area.y < 0 || area.x >= upright.width || area.y >= upright.height) {
    return fail(ErrorCode::invalid_argument,
                fmt::format("the picked pixel {},{} is outside the upright image of {} x {} pixels", area.x, area.y,
                            upright.width, upright.height),
                "white balance");
  }
  const int left = std::max(0, area.x - area.size / 2), top = std::max(0, area.y - area.size / 2);
  const Rect square{left, top, std::min(left + area.size, upright.width) - left,
                    std::min(top + area.size, upright.height) - top};
  Rect out = before_orientation(square, upright, orientation);
  const int cell = options.half ? 2 : 1;
  out = {raw.default_crop.x + cell * out.x, raw.default_crop.y + cell * out.y, cell * out.width, cell * out.height};
  const int right = out.x + out.width, bottom = out.y + out.height;
  out.x -= out.x % 2, out.y -= out.y % 2;
  out.width = std::min(std::max(2, (right - out.x + 1) / 2 * 2), raw.active.width - out.x);
  out.height = std::min(std::max(2, (bottom - out.y + 1) / 2 * 2), raw.active.height - out.y);
  return out;
}

/// Returns the mean gain of each colour of a region.
Vector3 mean_gains(const RawFrame& frame, const Rect& region, Executor& executor) {
  std::array<ColourSums, 3> sums;
  const RawDn& raw = frame.raw;
  if (raw.layout != SensorLayout::bayer) {  // maps of demosaiced frames are rare, and are of the whole frame
    CameraRgb ones(raw.active.width, raw.active.height);
    for (auto& plane : ones.plane) std::fill_n(plane.data(), plane.size(), 1.0f);
    apply_gains(frame.corrections, ones.view(), executor);
    for (std::size_t c = 0; c < 3; ++c) {
      for (int y = region.y; y < region.y + region.height; ++y) {
        for (int x = region.x; x < region.x + region.width; ++x) sums[c].add(ones.plane[c].at(x, y));
      }
    }
    return {sums[0].mean(), sums[1].mean(), sums[2].mean()};
  }
  Plane<float> ones(region.width, region.height);
  std::fill_n(ones.data(), ones.size(), 1.0f);
  apply_gains(frame.corrections, {region.x, region.y, raw.active.width, raw.active.height}, ones.view(), executor);
  for (int y = 0; y < region.height; ++y) {
    for (int x = 0; x < region.width; ++x) {
      sums[static_cast<std::size_t>(colour_at(raw.phase, x, y))].add(ones.at(x, y));
    }
  }
  return {sums[0].mean(), sums[1].mean(), sums[2].mean()};
}

}  // namespace

Result<Vector3> picked_neutral(const RawFrame& measured, const RawLevels& levels, const DevelopOptions& options,
                               Executor& executor) {
  const RawDn& raw = measured.raw;
  const auto refuse = [](const char* why) { return fail(ErrorCode::invalid_argument, why, "white balance"); };
  if (raw.layout == SensorLayout::monochrome) return refuse("a monochrome frame has no white to pick");
  const Result<Rect> region = region_of(raw, options);
  if (!region) return tl::make_unexpected(region.error());
  const RegionSums sums = sums_of(raw, levels.black, levels.defects, *region);
  const auto all = sums.colour[0].n + sums.colour[1].n + sums.colour[2].n;
  if (static_cast<double>(sums.saturated) > max_saturated * static_cast<double>(all)) {
    return refuse("the picked area is saturated, so its colour is unknown: pick a grey that is not clipped");
  }
  Thumbnail mean{.mean = CameraRgb(1, 1), .clipped = Plane<float>(1, 1)};
  mean.clipped.at(0, 0) = 0;
  for (std::size_t c = 0; c < 3; ++c) mean.mean.plane[c].at(0, 0) = static_cast<float>(sums.colour[c].mean());
  const Thumbnail light = light_of(mean, measured, levels);
  const Vector3 gains = mean_gains(measured, *region, executor);
  Vector3 out{};
  for (std::size_t c = 0; c < 3; ++c) {
    const double value = light.mean.plane[c].at(0, 0);
    if (!(value > min_standard_errors * sums.colour[c].standard_error())) {
      return refuse("the picked area is too dark to separate its colour from noise: pick a brighter or a larger one");
    }
    out[c] = value * gains[c];
  }
  const double largest = *std::ranges::max_element(out);
  return Vector3{out[0] / largest, out[1] / largest, out[2] / largest};
}

}  // namespace lowlux::isp
