#include "isp/render/capture_sharpening.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace lowlux::isp {
namespace {

constexpr int terms = 3;
constexpr float strength = 1.5f;
constexpr int window_px = 3;  // reach of the mean of D^2
constexpr float over_noise = 3;
constexpr float saturated_from = 0.95f;
constexpr int ramp_px = 4;
constexpr int limit_px = 2;
constexpr float limit_of_least = 0.75f;
constexpr int cell_px = 4;

/// Returns one half of a Gaussian's coefficients, centre first; all of them sum to 1.
std::vector<float> gaussian(float blur_px) {
  const int reach = static_cast<int>(std::ceil(3.5f * blur_px));
  std::vector<double> half(static_cast<std::size_t>(reach) + 1);
  double sum = 0;
  for (std::size_t i = 0; i < half.size(); ++i) {
    half[i] =
        std::exp(-0.5 * static_cast<double>(i * i) / (static_cast<double>(blur_px) * static_cast<double>(blur_px)));
    sum += (i == 0 ? 1 : 2) * half[i];
  }
  std::vector<float> out;
  for (const double coefficient : half) out.push_back(static_cast<float>(coefficient / sum));
  return out;
}

/// Returns a position mirrored at the borders without repeating them.
int mirrored(int i, int size) {
  if (size == 1) return 0;
  const int period = 2 * (size - 1);
  i = std::abs(i) % period;
  return i < size ? i : period - i;
}

/// Convolves rows, then columns, with a symmetric filter.
void convolve(const std::vector<float>& half, const Plane<float>& in, Plane<float>& memory, Plane<float>& out,
              Executor& executor) {
  const int reach = static_cast<int>(half.size()) - 1, width = in.width(), height = in.height();
  for_each_band(executor, height, [&](const RowBand& band, int /*index*/) {
    for (int y = band.first; y < band.last; ++y) {
      const float* const from = in.row(y);
      float* const to = memory.row(y);
      for (int x = 0; x < width; ++x) {
        float sum = half[0] * from[x];
        if (x >= reach && x + reach < width) {
          for (int i = 1; i <= reach; ++i) sum += half[static_cast<std::size_t>(i)] * (from[x - i] + from[x + i]);
        } else {
          for (int i = 1; i <= reach; ++i) {
            sum += half[static_cast<std::size_t>(i)] * (from[mirrored(x - i, width)] + from[mirrored(x + i, width)]);
          }
        }
        to[x] = sum;
      }
    }
  });
  for_each_band(executor, height, [&](const RowBand& band, int /*index*/) {
    for (int y = band.first; y < band.last; ++y) {
      float* const to = out.row(y);
      const float* const centre = memory.row(y);
      for (int x = 0; x < width; ++x) to[x] = half[0] * centre[x];
      for (int i = 1; i <= reach; ++i) {
        const float *above = memory.row(mirrored(y - i, height)), *below = memory.row(mirrored(y + i, height));
        const float coefficient = half[static_cast<std::size_t>(i)];
        for (int x = 0; x < width; ++x) to[x] += coefficient * (above[x] + below[x]);
      }
    }
  });
}

/// Calls change(x, y) for each pixel.
template <class Change>
void for_each_pixel(int width, int height, Executor& executor, const Change& change) {
  for_each_band(executor, height, [&](const RowBand& band, int /*index*/) {
    for (int y = band.first; y < band.last; ++y) {
      for (int x = 0; x < width; ++x) change(x, y);
    }
  });
}

/// Returns the detail of a plane: see sharpen_capture().
Plane<float> detail_of(const Plane<float>& plane, const std::vector<float>& half, Executor& executor) {
  const int width = plane.width(), height = plane.height();
  Plane<float> power = plane.clone(), blurred(width, height), memory(width, height), sum(width, height);
  for (int k = 0; k < terms; ++k) {
    convolve(half, power, memory, blurred, executor);
    for_each_pixel(width, height, executor, [&](int x, int y) {
      power.at(x, y) -= blurred.at(x, y);
      sum.at(x, y) = k == 0 ? power.at(x, y) : sum.at(x, y) + power.at(x, y);
    });
  }
  convolve(half, sum, memory, blurred, executor);
  for_each_pixel(width, height, executor, [&](int x, int y) { blurred.at(x, y) *= strength; });
  return blurred;
}

/// Returns the mean of value(x, y) over the pixels at most `reach` away along each axis, cut off at the borders.
template <class Value>
Plane<float> window_mean(int width, int height, int reach, Executor& executor, const Value& value) {
  Plane<float> rows(width, height), out(width, height);
  for_each_pixel(width, height, executor, [&](int x, int y) {
    const int from = std::max(0, x - reach), to = std::min(width - 1, x + reach);
    float sum = 0;
    for (int i = from; i <= to; ++i) sum += value(i, y);
    rows.at(x, y) = sum / static_cast<float>(to - from + 1);
  });
  for_each_pixel(width, height, executor, [&](int x, int y) {
    const int from = std::max(0, y - reach), to = std::min(height - 1, y + reach);
    float sum = 0;
    for (int j = from; j <= to; ++j) sum += rows.at(x, j);
    out.at(x, y) = sum / static_cast<float>(to - from + 1);
  });
  return out;
}

/// Returns the factor of the detail: 0 for pixels within `reach` of a saturated one, rising to 1 over twice ramp_px
/// farther ones; empty where it is 1 everywhere.
Plane<float> far_from_saturation(const CaptureSharpening& how, const RgbView<float>& rgb, int reach,
                                 Executor& executor) {
  const int width = rgb[0].width, height = rgb[0].height, beyond = reach + ramp_px;
  Plane<float> rows(width, height), least(width, height);
  std::vector<std::uint8_t> found(static_cast<std::size_t>(executor.width()), 0);
  for_each_band(executor, height, [&](const RowBand& band, int index) {
    for (int y = band.first; y < band.last; ++y) {
      float* const row = rows.row(y);
      std::fill_n(row, width, 1.0f);
      for (int x = 0; x < width; ++x) {
        bool saturated = false;
        for (std::size_t c = 0; c < 3; ++c) {
          saturated = saturated || rgb[c].row(y)[x] >= saturated_from * how.saturation[c];
        }
        if (!saturated) continue;
        std::fill(row + std::max(0, x - beyond), row + std::min(width, x + beyond + 1), 0.0f);
        found[static_cast<std::size_t>(index)] = 1;
      }
    }
  });
  if (std::ranges::count(found, 1) == 0) return {};
  for_each_band(executor, height, [&](const RowBand& band, int /*index*/) {
    for (int y = band.first; y < band.last; ++y) {
      float* const to = least.row(y);
      std::copy_n(rows.row(y), width, to);
      for (int j = std::max(0, y - beyond); j <= std::min(height - 1, y + beyond); ++j) {
        const float* const from = rows.row(j);
        for (int x = 0; x < width; ++x) to[x] = std::min(to[x], from[x]);
      }
    }
  });
  rows = Plane<float>();
  return window_mean(width, height, ramp_px, executor, [&](int x, int y) { return least.at(x, y); });
}

/// Returns what a value of a channel is not lowered below: a little less than the least value around.
float lower_limit(const PlaneView<float>& channel, int x, int y) {
  float least = channel.row(y)[x];
  for (int j = std::max(0, y - limit_px); j <= std::min(channel.height - 1, y + limit_px); ++j) {
    const float* const row = channel.row(j);
    for (int i = std::max(0, x - limit_px); i <= std::min(channel.width - 1, x + limit_px); ++i) {
      least = std::min(least, row[i]);
    }
  }
  return least > 0 ? limit_of_least * least : least;
}

}  // namespace

double detail_noise_gain(float blur_px) {
  const std::vector<float> half = gaussian(blur_px);
  const int reach = (terms + 1) * (static_cast<int>(half.size()) - 1);
  Plane<float> impulse(2 * reach + 1, 2 * reach + 1);
  std::fill_n(impulse.data(), impulse.size(), 0.0f);
  impulse.at(reach, reach) = 1;
  InlineExecutor here;
  const Plane<float> detail = detail_of(impulse, half, here);
  double sum = 0;
  for (std::size_t i = 0; i < detail.size(); ++i) {
    sum += static_cast<double>(detail.data()[i]) * static_cast<double>(detail.data()[i]);
  }
  return sum;
}

void sharpen_capture(const CaptureSharpening& how, PlaneView<const float> variance, const RgbView<float>& rgb,
                     Executor& executor) {
  const int width = rgb[0].width, height = rgb[0].height;
  if (width == 0 || height == 0) return;
  const std::vector<float> half = gaussian(how.blur_px);
  Plane<float> luminance(width, height);
  for_each_pixel(width, height, executor, [&](int x, int y) {
    float sum = 0;
    for (std::size_t c = 0; c < 3; ++c) sum += how.luminance[c] * rgb[c].row(y)[x];
    luminance.at(x, y) = sum;
  });
  Plane<float> detail = detail_of(luminance, half, executor);
  const Plane<float> signal =
      window_mean(width, height, window_px, executor, [&](int x, int y) { return detail.at(x, y) * detail.at(x, y); });
  const int reach = (terms + 1) * (static_cast<int>(half.size()) - 1);
  const Plane<float> allowed = far_from_saturation(how, rgb, reach, executor);
  const auto noise_gain = static_cast<float>(detail_noise_gain(how.blur_px));
  for_each_pixel(width, height, executor, [&](int x, int y) {
    float& change = detail.at(x, y);
    const float noise = over_noise * noise_gain * variance.row(y / cell_px)[x / cell_px];
    change = signal.at(x, y) > noise ? (1 - noise / signal.at(x, y)) * change : 0;
    if (!allowed.empty()) change *= allowed.at(x, y);
    for (std::size_t c = 0; c < 3 && change < 0; ++c) {
      change = std::max(change, std::min(lower_limit(rgb[c], x, y) - rgb[c].row(y)[x], 0.0f));
    }
  });
  for_each_pixel(width, height, executor, [&](int x, int y) {
    if (detail.at(x, y) == 0) return;
    for (std::size_t c = 0; c < 3; ++c) rgb[c].row(y)[x] += detail.at(x, y);
  });
}

}  // namespace lowlux::isp
