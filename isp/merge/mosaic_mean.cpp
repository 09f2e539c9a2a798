#include "isp/merge/mosaic_mean.h"

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>
#include <cstddef>
#include <limits>
#include <utility>

#include "isp/base/cfa.h"

namespace lowlux::merge {
namespace {

constexpr std::size_t max_mosaics = 16;
constexpr float far_z2 = 16;
constexpr int max_fill_px = 32;

/// Returns the mean of the values that are near their median; `value` is reordered.
float mean_near_median(std::span<float> value, float fraction, float offset) {
  const auto middle = value.begin() + static_cast<std::ptrdiff_t>((value.size() - 1) / 2);
  std::nth_element(value.begin(), middle, value.end());
  const float median = *middle;
  const float variance = fraction * std::max(median, 0.0F) + offset;
  float sum = 0, count = 0;
  for (const float v : value) {
    if ((v - median) * (v - median) > far_z2 * variance) continue;
    sum += v;
    count += 1;
  }
  return count > 0 ? sum / count : median;
}

/// Returns the mean of the nearest sites of the same colour that have a weight: of those in the smallest square ring
/// around (x, y) that contains one; 0 if there is none within 32 pixels.
float nearest_mean(const Plane<float>& mean, const Plane<float>& weight, int x, int y) {
  for (int ring = 2; ring <= max_fill_px; ring += 2) {
    float sum = 0, count = 0;
    const auto add = [&](int u, int v) {
      if (u < 0 || v < 0 || u >= mean.width() || v >= mean.height() || !(weight.at(u, v) > 0)) return;
      sum += mean.at(u, v);
      count += 1;
    };
    for (int d = -ring; d <= ring; d += 2) {
      add(x + d, y - ring);
      add(x + d, y + ring);
      if (d == -ring || d == ring) continue;
      add(x - ring, y + d);
      add(x + ring, y + d);
    }
    if (count > 0) return sum / count;
  }
  return 0;
}

/// Calls add(first, last) for each run of sites of a row whose blocks count.
template <class Add>
void for_matching(int y, int width, PlaneView<const std::uint8_t> block_matches, const Add& add) {
  if (block_matches.data == nullptr) return add(0, width);
  const std::uint8_t* const matches = block_matches.row(y / block_px);
  for (int block = 0; block < block_matches.width;) {
    const int first = block;
    while (block < block_matches.width && (matches[block] != 0) == (matches[first] != 0)) ++block;
    if (matches[first] != 0) add(first * block_px, std::min(block * block_px, width));
  }
}

/// Adds a run of sites without a branch. `weight_of(x)` is that of a site.
template <class WeightOf>
void add_run(const float* value, const WeightOf& weight_of, int first, int last, float* sum, float* weight) {
  for (int x = first; x < last; ++x) {
    const float w = weight_of(x);
    const bool counts = (value[x] == value[x]) & (w > 0);
    sum[x] += counts ? w * value[x] : 0;
    weight[x] += counts ? w : 0;
  }
}

constexpr float weight_steps = 256;  // of the weights of ColourMean
constexpr double least_ratio = 1.0 / 64;

/// Returns the variance of pixels of a colour with a mean weight as it is seen in means of larger areas, over that of a
/// sample: at most that of one frame. Each sample weighs as much as others there, whatever the weights of the pixels.
/// @param weight  in steps, > 0
double colour_variance(double weight, const ColourDensity& of) {
  return std::min(1.0, weight_steps * of.mean_weight / weight) / of.samples_per_px;
}

double mean_of_block(const Plane<std::uint16_t>& plane, int column, int row) {
  const int right = std::min((column + 1) * block_px, plane.width());
  const int bottom = std::min((row + 1) * block_px, plane.height());
  double sum = 0;
  for (int y = row * block_px; y < bottom; ++y) {
    for (int x = column * block_px; x < right; ++x) sum += plane.at(x, y);
  }
  return sum / (static_cast<double>(right - column * block_px) * (bottom - row * block_px));
}

}  // namespace

void robust_mean(std::span<Plane<float>> mosaics, const MosaicNoise& noise, Executor& executor) {
  assert(!mosaics.empty() && mosaics.size() <= max_mosaics);
  const auto fraction = static_cast<float>(noise.fraction);
  std::array<float, 4> offset{};
  for (int i = 0; i < 4; ++i) offset[i] = static_cast<float>(noise.fraction * noise.variance_e2[i]);
  for_each_index(executor, mosaics[0].height(), [&](int y) {
    std::array<float, max_mosaics> value{};
    for (int x = 0; x < mosaics[0].width(); ++x) {
      std::size_t count = 0;
      for (const Plane<float>& mosaic : mosaics) {
        const float v = mosaic.at(x, y);
        if (v == v) value[count++] = v;
      }
      mosaics[0].at(x, y) = count > 0 ? mean_near_median({value.data(), count}, fraction, offset[site_of(x, y)])
                                      : std::numeric_limits<float>::quiet_NaN();
    }
  });
}

MosaicMean::MosaicMean(int width, int height) : sum_(width, height), weight_(width, height) {
  for (Plane<float>* plane : {&sum_, &weight_}) std::fill_n(plane->data(), plane->size(), 0.0F);
}

void MosaicMean::add_row(int y, const WeightedRow& row, PlaneView<const std::uint8_t> block_matches) {
  float* const sum = sum_.row(y);
  float* const weight = weight_.row(y);
  for_matching(y, sum_.width(), block_matches, [&](int first, int last) {
    const float *const drop = row.weight, *const site = row.site_weight;
    const auto add = [&](const auto& weight_of) { add_run(row.value, weight_of, first, last, sum, weight); };
    if (drop != nullptr && site != nullptr) return add([=](int x) { return site[x] * drop[x]; });
    if (drop != nullptr) return add([=](int x) { return drop[x]; });
    if (site != nullptr) return add([=](int x) { return site[x]; });
    add([](int) { return 1.0F; });
  });
}

void MosaicMean::add(PlaneView<const float> mosaic, PlaneView<const std::uint8_t> block_matches, Executor& executor) {
  for_each_index(executor, sum_.height(), [&](int y) { add_row(y, {.value = mosaic.row(y)}, block_matches); });
}

Plane<float> MosaicMean::take_mean(Executor& executor) {
  Plane<float> mean = std::move(sum_);
  for_each_index(executor, mean.height(), [&](int y) {
    for (int x = 0; x < mean.width(); ++x) {
      if (weight_.at(x, y) > 0) mean.at(x, y) /= weight_.at(x, y);
    }
  });
  for_each_index(executor, mean.height(), [&](int y) {
    for (int x = 0; x < mean.width(); ++x) {
      if (!(weight_.at(x, y) > 0)) mean.at(x, y) = nearest_mean(mean, weight_, x, y);
    }
  });
  return mean;
}

ColourMean::ColourMean(int width, int height, const std::array<ColourDensity, 3>& density) : density_(density) {
  for (std::size_t c = 0; c < 3; ++c) {
    sum_[c] = Plane<float>(width, height);
    weight_[c] = Plane<std::uint16_t>(width, height);
    std::fill_n(sum_[c].data(), sum_[c].size(), 0.0F);
    std::fill_n(weight_[c].data(), weight_[c].size(), std::uint16_t{0});
  }
}

void ColourMean::add_row(int y, const ColourRowSums& row, PlaneView<const std::uint8_t> block_matches) {
  for_matching(y, width(), block_matches, [&](int first, int last) {
    for (std::size_t c = 0; c < 3; ++c) {
      const float *const value = row.value[c], *const more = row.weight[c];
      float* const sum = sum_[c].row(y);
      std::uint16_t* const weight = weight_[c].row(y);
      for (int x = first; x < last; ++x) {
        sum[x] += value[x];
        weight[x] = static_cast<std::uint16_t>(weight[x] + static_cast<int>(weight_steps * more[x]));
      }
    }
  });
}

std::array<double, 3> ColourMean::variance(Executor& executor) const {
  std::array<double, 3> out{};
  for (std::size_t c = 0; c < 3; ++c) {
    const Plane<std::uint16_t>& plane = weight_[c];
    /// The sum of the weights of pixels that have any, and their number.
    struct Sum {
      double weight = 0, pixels = 0;
    };
    std::vector<Sum> of_row(static_cast<std::size_t>(height()));
    for_each_index(executor, height(), [&](int y) {
      Sum& sum = of_row[static_cast<std::size_t>(y)];
      for (int x = 0; x < width(); ++x) {
        sum.weight += plane.at(x, y);
        sum.pixels += plane.at(x, y) > 0 ? 1 : 0;
      }
    });
    Sum all;
    for (const Sum& sum : of_row) {
      all.weight += sum.weight;
      all.pixels += sum.pixels;
    }
    out[c] = colour_variance(all.pixels > 0 ? all.weight / all.pixels : 1, density_[c]);
  }
  return out;
}

ColourMean::Image ColourMean::image(const RowBand& rows, const std::array<double, 3>& variance,
                                    const RgbView<const float>& prediction, Executor& executor) const {
  assert(rows.first % block_px == 0 && (rows.last % block_px == 0 || rows.last == height()));
  Image out{.samples = Plane<float>(3 * width(), rows.last - rows.first), .noise_ratio = {.block_px = block_px}};
  for_each_index(executor, rows.last - rows.first, [&](int row) {
    const int y = rows.first + row;
    float* const samples = out.samples.row(row);
    for (std::size_t c = 0; c < 3; ++c) {
      for (int x = 0; x < width(); ++x) {
        const float weight = weight_[c].at(x, y);
        samples[3 * static_cast<std::size_t>(x) + c] =
            weight > 0 ? weight_steps * sum_[c].at(x, y) / weight : prediction[c].at(x, y);
      }
    }
  });
  Plane<float>& ratio = out.noise_ratio.ratio;
  ratio = Plane<float>(ratio_blocks(width(), block_px), ratio_blocks(rows.last - rows.first, block_px));
  for_each_index(executor, ratio.height(), [&](int row) {
    for (int column = 0; column < ratio.width(); ++column) {
      double sum = 0;
      for (std::size_t c = 0; c < 3; ++c) {
        const double weight = mean_of_block(weight_[c], column, rows.first / block_px + row);
        if (weight > 0) sum += colour_variance(weight, density_[c]) / variance[c];
      }
      ratio.at(column, row) = static_cast<float>(std::max(sum / 3, least_ratio));
    }
  });
  return out;
}

}  // namespace lowlux::merge
