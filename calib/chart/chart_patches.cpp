#include "calib/chart/chart_patches.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <cstddef>
#include <optional>
#include <vector>

namespace lowlux::calib {
namespace {

constexpr double middle = 0.5;               // of a cell's width and height
constexpr double outlier_deviations = 5;     // of a normal distribution, 6e-7 lies beyond
constexpr double mad_to_deviation = 1.4826;  // of a normal distribution

using PatchCorners = std::array<PicturePoint, 4>;

bool inside(const PatchCorners& corner, double x, double y) {
  int left = 0, right = 0;
  for (std::size_t i = 0; i < 4; ++i) {
    const PicturePoint &a = corner[i], &b = corner[(i + 1) % 4];
    const double side = (b.x - a.x) * (y - a.y) - (b.y - a.y) * (x - a.x);
    ++(side >= 0 ? left : right);
  }
  return left == 4 || right == 4;
}

double median_of(std::vector<double> values) {
  const auto middle_value = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle_value, values.end());
  return *middle_value;
}

/// Range of the pixels that are kept: between low and high, ends included. If more than half of the pixels have one
/// code, outliers cannot be determined from their scatter and all pixels are kept.
struct Kept {
  double low = -HUGE_VAL;
  double high = HUGE_VAL;
};

Kept kept_of(const std::vector<Vector3>& pixels, std::size_t channel) {
  std::vector<double> values(pixels.size());
  std::transform(pixels.begin(), pixels.end(), values.begin(), [&](const Vector3& rgb) { return rgb[channel]; });
  const double median = median_of(values);
  for (double& value : values) value = std::fabs(value - median);
  const double deviation = mad_to_deviation * median_of(std::move(values));
  if (!(deviation > 0)) return {};
  return {median - outlier_deviations * deviation, median + outlier_deviations * deviation};
}

void average(const std::vector<Vector3>& pixels, ChartPatch& patch) {
  if (pixels.empty()) return;
  const std::array<Kept, 3> kept{kept_of(pixels, 0), kept_of(pixels, 1), kept_of(pixels, 2)};
  Vector3 sum{}, squares{};
  for (const Vector3& rgb : pixels) {
    bool good = true;
    for (std::size_t c = 0; c < 3; ++c) good = good && rgb[c] >= kept[c].low && rgb[c] <= kept[c].high;
    if (!good) continue;
    ++patch.pixels;
    for (std::size_t c = 0; c < 3; ++c) {
      // Relative to the first pixel, so that the squares of a bright, uniform patch do not cancel.
      const double difference = rgb[c] - pixels[0][c];
      sum[c] += difference;
      squares[c] += difference * difference;
    }
  }
  const double n = patch.pixels;
  patch.outlying_fraction = 1 - n / static_cast<double>(pixels.size());
  for (std::size_t c = 0; c < 3 && n > 1; ++c) {
    patch.camera_rgb[c] = pixels[0][c] + sum[c] / n;
    patch.standard_error[c] = std::sqrt(std::max(0.0, squares[c] - sum[c] * sum[c] / n) / (n * (n - 1)));
  }
}

ChartPatch measure(const ChartPicture& picture, const PatchCorners& corner) {
  double left = corner[0].x, right = left, top = corner[0].y, bottom = top;
  for (const PicturePoint& p : corner) {
    left = std::min(left, p.x);
    right = std::max(right, p.x);
    top = std::min(top, p.y);
    bottom = std::max(bottom, p.y);
  }
  std::vector<Vector3> pixels;
  int seen = 0, clipped = 0;
  const int last_x = std::min(static_cast<int>(right), picture.rgb.width() - 1);
  const int last_y = std::min(static_cast<int>(bottom), picture.rgb.height() - 1);
  for (int y = std::max(0, static_cast<int>(std::ceil(top))); y <= last_y; ++y) {
    for (int x = std::max(0, static_cast<int>(std::ceil(left))); x <= last_x; ++x) {
      if (!inside(corner, x, y)) continue;
      ++seen;
      clipped += picture.clipped.at(x, y);
      if (picture.clipped.at(x, y) != 0) continue;
      const auto& plane = picture.rgb.plane;
      pixels.push_back({plane[0].at(x, y), plane[1].at(x, y), plane[2].at(x, y)});
    }
  }
  ChartPatch out;
  out.clipped_fraction = seen > 0 ? static_cast<double>(clipped) / seen : 0;
  average(pixels, out);
  return out;
}

}  // namespace

std::array<PicturePoint, 4> measured_corners(const ChartGrid& grid, int patch) {
  const int column = patch % chart_columns, row = patch / chart_columns;
  const double u = column + 0.5, v = row + 0.5, h = middle / 2;
  return {grid.at(u - h, v - h), grid.at(u + h, v - h), grid.at(u + h, v + h), grid.at(u - h, v + h)};
}

std::array<ChartPatch, chart_patch_count> measure_patches(const ChartPicture& picture, const ChartGrid& grid) {
  std::array<ChartPatch, chart_patch_count> out;
  for (int i = 0; i < chart_patch_count; ++i) {
    out[static_cast<std::size_t>(i)] = measure(picture, measured_corners(grid, i));
  }
  return out;
}

double relative_error(const std::array<ChartPatch, chart_patch_count>& patches) {
  std::vector<double> errors;
  errors.reserve(patches.size());
  for (const ChartPatch& patch : patches) {
    if (!usable(patch)) continue;
    double largest = 0;
    for (std::size_t c = 0; c < 3; ++c) {
      const double mean = patch.camera_rgb[c];
      largest = std::max(largest, mean > 0 ? patch.standard_error[c] / mean : HUGE_VAL);
    }
    errors.push_back(largest);
  }
  return errors.empty() ? HUGE_VAL : median_of(std::move(errors));
}

ChartPicture chart_picture(const SignalFraction& mosaic, const RawDn& raw) {
  assert(raw.layout == SensorLayout::bayer);
  assert(mosaic.value.width() == raw.active.width && mosaic.value.height() == raw.active.height);
  const int width = raw.active.width / 2, height = raw.active.height / 2;
  ChartPicture out{CameraRgb(width, height), Plane<std::uint8_t>(width, height)};
  const auto is_clipped = [&](int x, int y, double white_dn) {
    return with_samples(raw, [&](const auto& dn) { return dn.at(raw.active.x + x, raw.active.y + y) >= white_dn; });
  };
  for (int y = 0; y < height; ++y) {
    std::fill_n(out.clipped.row(y), width, std::uint8_t{0});
    for (const auto& plane : out.rgb.view()) std::fill_n(plane.row(y), width, 0.0F);
    for (int x = 0; x < width; ++x) {
      for (int site = 0; site < 4; ++site) {
        const int column = 2 * x + (site & 1), row = 2 * y + (site >> 1);
        const auto colour = static_cast<std::size_t>(colour_at(mosaic.phase, column, row));
        out.rgb.plane[colour].at(x, y) += mosaic.value.at(column, row) * (colour == 1 ? 0.5F : 1.0F);
        if (is_clipped(column, row, raw.white_dn[colour])) out.clipped.at(x, y) = 1;
      }
    }
  }
  return out;
}

}  // namespace lowlux::calib
