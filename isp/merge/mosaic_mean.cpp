#include "isp/merge/mosaic_mean.h"

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>
#include <cstddef>
#include <limits>
#include <utility>
#include <vector>

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
constexpr double min_ratio = 1.0 / 64;

/// Returns the row of a block in which its frames are counted.
int counted_row(int block_row, int height) { return std::min(block_row * block_px + block_px / 2, height - 1); }

/// Returns whether a frame has samples at half of a run of pixels at least, of any colour.
bool covers(const ColourRowSums& row, int first, int last) {
  int covered = 0;
  for (int x = first; x < last; ++x) covered += row.weight[0][x] + row.weight[1][x] + row.weight[2][x] > 0 ? 1 : 0;
  return 2 * covered >= last - first;
}

/// Computes how far the mean of the pixels of a row is that of their samples, 0..1, rather than the prediction: 0
/// without a sample, and 1 from a quarter of the mean weight around on, which is sum k t / sum k with k = (1 2 1)' (1 2
/// 1). In each 2x2 cell around a pixel, k weighs all four pixels equally.
class SampleShares {
 public:
  explicit SampleShares(int width) : column_(static_cast<std::size_t>(width) + 2), share_(column_.size() - 2) {}

  const std::vector<float>& row(const Plane<std::uint16_t>& weight, int y) {
    const std::uint16_t* const here = weight.row(y);
    const std::uint16_t* const above = weight.row(std::max(y - 1, 0));
    const std::uint16_t* const below = weight.row(std::min(y + 1, weight.height() - 1));
    for (int x = 0; x < weight.width(); ++x) {
      column_[x + 1] = static_cast<float>(above[x]) + 2.0F * static_cast<float>(here[x]) + static_cast<float>(below[x]);
    }
    column_.front() = column_[1];
    column_.back() = column_[column_.size() - 2];
    for (std::size_t x = 0; x < share_.size(); ++x) {
      const float around = (column_[x] + 2 * column_[x + 1] + column_[x + 2]) / 16;
      share_[x] = std::min(static_cast<float>(here[x]) / std::max(full_fraction * around, 1.0F), 1.0F);
    }
    return share_;
  }

 private:
  static constexpr float full_fraction = 0.25F;

  std::vector<float> column_, share_;
};

/// Returns the variance of a colour over that of a sample in the mean of a larger area.
/// @param share  mean share of samples (SampleShares)
double colour_variance(double share, double frames, std::size_t colour) {
  const double samples_per_px = colour == 1 ? 0.5 : 0.25;
  return share * share / (frames * samples_per_px);
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

ColourMean::ColourMean(int width, int height) : frames_(ratio_blocks(width, block_px), ratio_blocks(height, block_px)) {
  for (std::size_t c = 0; c < 3; ++c) {
    sum_[c] = Plane<float>(width, height);
    weight_[c] = Plane<std::uint16_t>(width, height);
    std::fill_n(sum_[c].data(), sum_[c].size(), 0.0F);
    std::fill_n(weight_[c].data(), weight_[c].size(), std::uint16_t{0});
  }
  std::fill_n(frames_.data(), frames_.size(), std::uint8_t{0});
}

void ColourMean::add_row(int y, const ColourRowSums& row, PlaneView<const std::uint8_t> block_matches) {
  const bool counts = y == counted_row(y / block_px, height());
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
    for (int x = first; counts && x < last; x += block_px) {
      if (covers(row, x, std::min(x + block_px, last))) ++frames_.at(x / block_px, y / block_px);
    }
  });
}

std::array<double, 3> ColourMean::variance(Executor& executor) const {
  struct Sum {
    std::array<double, 3> share{};
    double frames = 0, pixels = 0;
  };
  std::vector<Sum> of_row(static_cast<std::size_t>(height()));
  for_each_band(executor, height(), [&](RowBand band, int) {
    SampleShares shares(width());
    for (int y = band.first; y < band.last; ++y) {
      Sum& sum = of_row[static_cast<std::size_t>(y)];
      const std::uint8_t* const frames = frames_.row(y / block_px);
      for (int x = 0; x < width(); ++x) {
        sum.frames += frames[x / block_px];
        sum.pixels += frames[x / block_px] > 0 ? 1 : 0;
      }
      for (std::size_t c = 0; c < 3; ++c) {
        const std::vector<float>& share = shares.row(weight_[c], y);
        for (int x = 0; x < width(); ++x) sum.share[c] += frames[x / block_px] > 0 ? static_cast<double>(share[x]) : 0;
      }
    }
  });
  Sum all;
  for (const Sum& sum : of_row) {
    for (std::size_t c = 0; c < 3; ++c) all.share[c] += sum.share[c];
    all.frames += sum.frames;
    all.pixels += sum.pixels;
  }
  std::array<double, 3> out{};
  for (std::size_t c = 0; c < 3; ++c) {
    out[c] = all.share[c] > 0 ? colour_variance(all.share[c] / all.pixels, all.frames / all.pixels, c)
                              : colour_variance(1, 1, c);
  }
  return out;
}

ColourMean::Image ColourMean::image(const RowBand& rows, const std::array<double, 3>& variance,
                                    const RgbView<const float>& prediction, Executor& executor) const {
  assert(rows.first % block_px == 0 && (rows.last % block_px == 0 || rows.last == height()));
  Image out{.samples = Plane<float>(3 * width(), rows.last - rows.first), .noise_ratio = {.block_px = block_px}};
  Plane<float>& ratio = out.noise_ratio.ratio;
  ratio = Plane<float>(frames_.width(), ratio_blocks(rows.last - rows.first, block_px));
  for_each_index(executor, ratio.height(), [&](int block_row) {
    const RowBand band{rows.first + block_row * block_px, std::min(rows.first + (block_row + 1) * block_px, rows.last)};
    const std::uint8_t* const frames = frames_.row(band.first / block_px);
    std::vector<std::array<double, 3>> fraction_sum(static_cast<std::size_t>(ratio.width()));
    SampleShares shares(width());
    for (int y = band.first; y < band.last; ++y) {
      float* const samples = out.samples.row(y - rows.first);
      for (std::size_t c = 0; c < 3; ++c) {
        const std::vector<float>& share = shares.row(weight_[c], y);
        const std::uint16_t* const weight = weight_[c].row(y);
        const float *const sum = sum_[c].row(y), *const predicted = prediction[c].row(y);
        for (int x = 0; x < width(); ++x) {
          float& value = samples[3 * static_cast<std::size_t>(x) + c];
          value = predicted[x];
          if (weight[x] == 0 || frames[x / block_px] == 0) continue;
          value += share[x] * (weight_steps * sum[x] / static_cast<float>(weight[x]) - predicted[x]);
          fraction_sum[static_cast<std::size_t>(x / block_px)][c] += static_cast<double>(share[x]);
        }
      }
    }
    for (int column = 0; column < ratio.width(); ++column) {
      const double pixels = (std::min((column + 1) * block_px, width()) - column * block_px) * (band.last - band.first);
      double sum = 0;
      for (std::size_t c = 0; c < 3 && frames[column] > 0; ++c) {
        sum += colour_variance(fraction_sum[static_cast<std::size_t>(column)][c] / pixels, frames[column], c) /
               variance[c];
      }
      ratio.at(column, block_row) = static_cast<float>(std::max(sum / 3, min_ratio));
    }
  });
  return out;
}

}  // namespace lowlux::merge
