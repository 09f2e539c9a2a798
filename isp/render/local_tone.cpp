#include "isp/render/local_tone.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "isp/render/night/night_look.h"

namespace lowlux::isp {
namespace {

constexpr int cell_px = 4;
constexpr float middle_grey = 0.18f;
constexpr float detail_variance = 0.25f;  // of l [EV^2]: half an EV of contrast is still detail
constexpr int windows_across = 20;        // squares along the longer side
constexpr float most_lift_ev = 6;         // the limit of t / (1 + t / 6)
constexpr float unknown_noise = 0x1p-12f * middle_grey;

/// Holds one value of each kind for each cell.
struct Cells {
  Plane<float> slope, level;  // a and b
  Plane<float> noise;         // n
  Plane<float> most_lift;     // M [EV]
};

float luminance_of(const LocalTone& how, float r, float g, float b) {
  return how.luminance[0] * r + how.luminance[1] * g + how.luminance[2] * b;
}

float log_level(float luminance, float noise) { return std::log2((std::max(luminance, 0.0f) + noise) / middle_grey); }

/// Returns the means of the luminance of cells; those at the right and lower border may be smaller than 4 x 4 pixels.
Plane<float> cell_means(const LocalTone& how, const RgbView<float>& rgb, Executor& executor) {
  const int width = rgb[0].width, height = rgb[0].height;
  Plane<float> out((width + cell_px - 1) / cell_px, (height + cell_px - 1) / cell_px);
  for_each_band(executor, out.height(), [&](const RowBand& band, int /*index*/) {
    for (int cy = band.first; cy < band.last; ++cy) {
      const int last = std::min(height, cell_px * (cy + 1));
      for (int cx = 0; cx < out.width(); ++cx) {
        const int end = std::min(width, cell_px * (cx + 1));
        float sum = 0;
        for (int y = cell_px * cy; y < last; ++y) {
          const float *r = rgb[0].row(y), *g = rgb[1].row(y), *b = rgb[2].row(y);
          for (int x = cell_px * cx; x < end; ++x) sum += luminance_of(how, r[x], g[x], b[x]);
        }
        out.at(cx, cy) = sum / static_cast<float>((last - cell_px * cy) * (end - cell_px * cx));
      }
    }
  });
  return out;
}

/// Replaces values by their means over squares of 2 reach + 1, cut off at the borders. Sums run along whole rows and
/// columns, so that they do not depend on the number of threads.
void average(Plane<float>& plane, int reach, Executor& executor) {
  const int width = plane.width(), height = plane.height();
  Plane<float> rows(width, height);
  for_each_band(executor, height, [&](const RowBand& band, int /*index*/) {
    for (int y = band.first; y < band.last; ++y) {
      double sum = 0;
      for (int x = -reach; x < width; ++x) {
        if (x + reach < width) sum += plane.at(x + reach, y);
        if (x < 0) continue;
        if (x > reach) sum -= plane.at(x - reach - 1, y);
        rows.at(x, y) = static_cast<float>(sum / (std::min(width - 1, x + reach) - std::max(0, x - reach) + 1));
      }
    }
  });
  for_each_band(executor, width, [&](const RowBand& columns, int /*index*/) {
    std::vector<double> sum(static_cast<std::size_t>(columns.last - columns.first));
    const auto add = [&](int y, double sign) {
      for (int x = columns.first; x < columns.last; ++x)
        sum[static_cast<std::size_t>(x - columns.first)] += sign * rows.at(x, y);
    };
    for (int y = -reach; y < height; ++y) {
      if (y + reach < height) add(y + reach, 1);
      if (y < 0) continue;
      if (y > reach) add(y - reach - 1, -1);
      const double count = std::min(height - 1, y + reach) - std::max(0, y - reach) + 1;
      for (int x = columns.first; x < columns.last; ++x) {
        plane.at(x, y) = static_cast<float>(sum[static_cast<std::size_t>(x - columns.first)] / count);
      }
    }
  });
}

/// Calls change(x, y) for each cell.
template <class Change>
void for_each_cell(const Plane<float>& cells, Executor& executor, const Change& change) {
  for_each_band(executor, cells.height(), [&](const RowBand& band, int /*index*/) {
    for (int y = band.first; y < band.last; ++y) {
      for (int x = 0; x < cells.width(); ++x) change(x, y);
    }
  });
}

/// Returns the largest lift in EV, 0 to 6, within the limit of the noise.
float largest_lift_ev(float luminance, float noise) {
  constexpr double most = 64;  // 2^most_lift_ev
  const double gain = most * gain_within_noise_limit(most * luminance, most * noise, local_tone_noise);
  return static_cast<float>(std::log2(std::max(gain, 1.0)));
}

Cells cells_of(const LocalTone& how, const PlaneView<const float>& variance, const RgbView<float>& rgb,
               Executor& executor) {
  Plane<float> level = cell_means(how, rgb, executor);
  const int width = level.width(), height = level.height();
  const bool known = variance.data != nullptr;
  const int reach = std::max(1, std::max(width, height) / (2 * windows_across));
  Cells out{Plane<float>(width, height), Plane<float>(width, height), Plane<float>(width, height),
            Plane<float>(width, height)};
  Plane<float> noise_around(width, height);
  for_each_cell(level, executor, [&](int x, int y) {
    const float own = known ? how.limit * std::sqrt(std::max(variance.row(y)[x], 0.0f)) : 0;
    out.noise.at(x, y) = std::max(own, unknown_noise);
    noise_around.at(x, y) = std::log2(out.noise.at(x, y));
  });
  average(noise_around, reach, executor);
  for_each_cell(level, executor, [&](int x, int y) {
    const float noise = std::min(out.noise.at(x, y), std::exp2(noise_around.at(x, y)));
    out.noise.at(x, y) = noise;
    level.at(x, y) = log_level(level.at(x, y), noise);
    out.slope.at(x, y) = level.at(x, y) * level.at(x, y);
  });
  Plane<float> mean = level.clone();
  average(mean, reach, executor);
  average(out.slope, reach, executor);
  for_each_cell(level, executor, [&](int x, int y) {
    const float m = mean.at(x, y), v = std::max(out.slope.at(x, y) - m * m, 0.0f), a = v / (v + detail_variance);
    out.slope.at(x, y) = a;
    out.level.at(x, y) = (1 - a) * m;
  });
  average(out.slope, reach, executor);
  average(out.level, reach, executor);
  for_each_cell(level, executor, [&](int x, int y) {
    const float base = out.slope.at(x, y) * level.at(x, y) + out.level.at(x, y), noise = out.noise.at(x, y);
    out.most_lift.at(x, y) = known ? largest_lift_ev(middle_grey * std::exp2(base) - noise, noise) : most_lift_ev;
  });
  const Plane<float> own = out.most_lift.clone();
  for_each_cell(level, executor, [&](int x, int y) {
    for (int j = std::max(0, y - 1); j <= std::min(height - 1, y + 1); ++j) {
      for (int i = std::max(0, x - 1); i <= std::min(width - 1, x + 1); ++i) {
        out.most_lift.at(x, y) = std::max(out.most_lift.at(x, y), own.at(i, j));
      }
    }
  });
  return out;
}

/// Returns log2(x) of a normal number above 0, within 1e-6; for loops that the compiler vectorises.
float fast_log2(float x) {
  constexpr std::int32_t half_root = 0x3f3504f3;  // sqrt(1/2): mantissas are 0.707 to 1.414
  const auto bits = std::bit_cast<std::int32_t>(x);
  const std::int32_t exponent = (bits - half_root) >> 23;
  const auto mantissa = std::bit_cast<float>(bits - exponent * (1 << 23));
  const float t = (mantissa - 1) / (mantissa + 1), t2 = t * t;  // log2 m = 2 / ln 2 artanh t
  const float series = t * (2.88539008f + t2 * (0.961796694f + t2 * (0.577078016f + t2 * 0.412198583f)));
  return static_cast<float>(exponent) + series;
}

/// Returns 2^x for |x| below 126, within 1e-6 of itself.
float fast_exp2(float x) {
  const std::int32_t whole = static_cast<std::int32_t>(x + 128.5f) - 128;
  const float f = x - static_cast<float>(whole);  // -0.5..0.5: powers of f ln 2 over factorials
  const float series =
      1 +
      f * (0.693147181f +
           f * (0.240226507f + f * (0.0555041087f + f * (0.00961812911f + f * (0.00133335581f + f * 1.54035304e-4f)))));
  return series * std::bit_cast<float>((whole + 127) << 23);
}

/// Values of a row of pixels, interpolated between the centres of the cells around them.
class PixelRow {
 public:
  explicit PixelRow(int width) : values_(static_cast<std::size_t>(width)) {}

  void set(const Plane<float>& cells, int y) {
    const float place =
        std::clamp((static_cast<float>(y) + 0.5f) / cell_px - 0.5f, 0.0f, static_cast<float>(cells.height() - 1));
    const int above = static_cast<int>(place), below = std::min(above + 1, cells.height() - 1);
    const float part = place - static_cast<float>(above);
    const float *const from = cells.row(above), *const to = cells.row(below);
    const auto cell = [&](int x) { return from[x] + part * (to[x] - from[x]); };
    const int width = static_cast<int>(values_.size());
    float* const out = values_.data();
    float left = cell(0);
    std::fill_n(out, std::min(cell_px / 2, width), left);
    for (int x = cell_px / 2, i = 1; x < width; x += cell_px, ++i) {
      const float right = i < cells.width() ? cell(i) : left, step = (right - left) / cell_px;
      for (int k = 0; k < std::min(cell_px, width - x); ++k) out[x + k] = left + (static_cast<float>(k) + 0.5f) * step;
      left = right;
    }
  }
  const float* data() const { return values_.data(); }

 private:
  std::vector<float> values_;
};

/// Computes 2^e of a row of pixels from the luminance in `gain`.
void luminance_to_gain(const LocalTone& how, const PixelRow& slope, const PixelRow& level, const PixelRow& noise,
                       const PixelRow& most_lift, std::vector<float>& gain) {
  const float share = how.share, white_ev = std::log2(how.limit / middle_grey);
  const float *const a = slope.data(), *const b = level.data(), *const n = noise.data(), *const most = most_lift.data();
  float* const g = gain.data();
  for (std::size_t x = 0; x < gain.size(); ++x) {
    const float base = a[x] * fast_log2((std::max(g[x], 0.0f) + n[x]) / middle_grey) + b[x];
    const float dark = std::max(-base, 0.0f), light = std::clamp(base, 0.0f, white_ev);
    const float lift = std::min(share * dark / (1 + dark / most_lift_ev), most[x]);
    g[x] = fast_exp2(lift - share * light * (1 - light / white_ev));
  }
}

}  // namespace

void apply_local_tone(const LocalTone& how, PlaneView<const float> variance, const RgbView<float>& rgb,
                      Executor& executor) {
  const int width = rgb[0].width, height = rgb[0].height;
  if (!(how.share > 0) || width == 0 || height == 0) return;
  LocalTone in_light = how;  // with luminance as scene-linear values
  for (float& weight : in_light.luminance) weight *= how.limit;
  const Cells cells = cells_of(in_light, variance, rgb, executor);
  for_each_band(executor, height, [&](const RowBand& band, int /*index*/) {
    PixelRow slope(width), level(width), noise(width), most_lift(width);
    std::vector<float> gain(static_cast<std::size_t>(width));
    for (int y = band.first; y < band.last; ++y) {
      slope.set(cells.slope, y);
      level.set(cells.level, y);
      noise.set(cells.noise, y);
      most_lift.set(cells.most_lift, y);
      float *const r = rgb[0].row(y), *const g = rgb[1].row(y), *const b = rgb[2].row(y);
      for (int x = 0; x < width; ++x) gain[static_cast<std::size_t>(x)] = luminance_of(in_light, r[x], g[x], b[x]);
      luminance_to_gain(how, slope, level, noise, most_lift, gain);
      for (float* const channel : {r, g, b}) {
        for (int x = 0; x < width; ++x) channel[x] *= gain[static_cast<std::size_t>(x)];
      }
    }
  });
}

}  // namespace lowlux::isp
