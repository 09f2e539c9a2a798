#include "capture/x_trans/x_trans_tile.h"

#include <algorithm>
#include <cmath>

namespace lowlux::capture::x_trans {
namespace {

constexpr int half_triangle = 4, gradient_reach = 1;
constexpr int ratio_border = margin - half_triangle;  // of the first sample with a ratio
constexpr int luma_border = ratio_border - reach;     // of the first one with luma
constexpr int tensor_border = luma_border + gradient_reach;
constexpr int half_gaussian = margin - tensor_border;
static_assert(ratio_border == 8 && luma_border == 5 && half_gaussian >= 4);
// Gaussian of 1.5 pixels, normalised.
constexpr std::array<float, 9> gaussian{0.0076143F, 0.0360740F, 0.1095866F, 0.2134430F, 0.2665642F,
                                        0.2134430F, 0.1095866F, 0.0360740F, 0.0076143F};
constexpr float min_ratio_mean = 0.004F, min_root = 0.002F;
constexpr float min_knee = 0.002F;
constexpr float noise_below_zero = 5;  // standard deviations
constexpr int saturated_reach = 5;     // of a saturated site: the filters' reach, and two pixels of a lamp's edge
static_assert(saturated_reach >= reach && saturated_reach < margin);

using Lanes = std::array<float, lanes>;

Plane<float> tile_plane() { return {padded + lanes, padded}; }

float sum_of(const Lanes& v) { return ((v[0] + v[4]) + (v[1] + v[5])) + ((v[2] + v[6]) + (v[3] + v[7])); }

float filtered(const PlacedFilter& filter, const Patch& patch) {
  Lanes sum{};
  for (int r = 0; r < side; ++r) {
    for (int i = 0; i < lanes; ++i) sum[i] += filter[r * lanes + i] * patch[r * lanes + i];
  }
  return sum_of(sum);
}

/// Returns the weighted sum of the filters of all terms.
float filtered(const PlacedFilters& filters, const Base& base, const Patch& patch) {
  std::array<Lanes, terms> sum{};
  for (int r = 0; r < side; ++r) {
    for (int t = 0; t < terms; ++t) {
      for (int i = 0; i < lanes; ++i) sum[t][i] += filters[t][r * lanes + i] * patch[r * lanes + i];
    }
  }
  Lanes all{};
  for (int t = 0; t < terms; ++t) {
    for (int i = 0; i < lanes; ++i) all[i] += base[t] * sum[t][i];
  }
  return sum_of(all);
}

/// Weights columns first .. last - 1 of a row with those around them.
template <std::size_t n>
void sum_along_row(const std::array<float, n>& weights, const float* from, int first, int last, float* to) {
  constexpr int half = static_cast<int>(n) / 2;
  for (int x = first; x < last; ++x) {
    float sum = 0;
    for (int k = -half; k <= half; ++k) sum += weights[k + half] * from[x + k];
    to[x] = sum;
  }
}

/// Weights row y with those above and below it.
template <std::size_t n>
void sum_along_column(const std::array<float, n>& weights, const Plane<float>& from, int y, int first, int last,
                      float* to) {
  constexpr int half = static_cast<int>(n) / 2;
  std::fill(to + first, to + last, 0.0F);
  for (int k = -half; k <= half; ++k) {
    const float* row = from.row(y + k);
    for (int x = first; x < last; ++x) to[x] += weights[k + half] * row[x];
  }
}

/// Returns the weights of the terms: 1, cos 2a, sin 2a, cos 4a, sin 4a for the direction a of the gradient, by how much
/// one direction prevails, and the fraction of the gradients that noise explains.
Base base_of(float xx, float xy, float yy, float noise) {
  const float trace = xx + yy;
  const float noisy = std::min(noise / (trace + 1e-12F), 1.0F);
  const float scale = (1 - noisy) / (std::max(trace, 1e-7F) + 1e-7F);
  const float c = (xx - yy) * scale, s = 2 * xy * scale;
  return {1, c, s, c * c - s * s, 2 * c * s, noisy};
}

}  // namespace

Tile::Tile(const XTransSetting& setting)
    : setting_(setting),
      samples_(tile_plane()),
      luma_(tile_plane()),
      compressed_(tile_plane()),
      near_saturated_(padded, padded) {
  for (auto& plane : ratio_) plane = tile_plane();
  for (auto& plane : row_sums_) plane = tile_plane();
  for (auto& plane : tensor_) plane = tile_plane();
  for (Plane<float>* plane : {&samples_, &luma_, &compressed_}) std::fill_n(plane->data(), plane->size(), 0.0F);
  double scale = 0, offset = 0;
  for (std::size_t c = 0; c < 3; ++c) {
    const double neutral = setting.neutral[c] / setting.neutral[1];
    neutral_[c] = static_cast<float>(neutral);
    white_[c] = 1 / neutral_[c];
    min_white_ = std::min(min_white_, white_[c]);
    scale += luma_weights[c] * setting.noise_scale / neutral;
    offset += luma_weights[c] * setting.noise_offset / (neutral * neutral);
  }
  luma_scale_ = static_cast<float>(scale);
  luma_offset_ = static_cast<float>(offset);
  knee_ = min_knee + luma_scale_ + std::sqrt(luma_offset_);
  min_value_ = -noise_below_zero * std::sqrt(luma_offset_);
  ratio_floor_ = min_ratio_mean + 2 * luma_scale_;
  root_offset_ = min_root + 0.375F * luma_scale_;
  if (scale > 0) root_offset_ += static_cast<float>(std::min(offset / scale, 1.0));
}

void Tile::compute_ratios() {
  const auto& bank = filter_bank();
  std::array<float, padded + lanes> masked;
  for (std::size_t c = 0; c < 3; ++c) {
    for (int y = 0; y < padded; ++y) {
      const float* from = samples_.row(y);
      for (int x = 0; x < padded; ++x)
        masked[x] = static_cast<std::size_t>(bank[site_at(x, y)].own) == c ? std::min(from[x], min_white_) : 0;
      sum_along_row(triangle, masked.data(), half_triangle, padded - half_triangle, row_sums_[c].row(y));
    }
  }
  for (int y = half_triangle; y < padded - half_triangle; ++y) {
    for (std::size_t c = 0; c < 3; ++c) {
      float* mean = ratio_[c].row(y);
      sum_along_column(triangle, row_sums_[c], y, half_triangle, padded - half_triangle, mean);
      for (int x = half_triangle; x < padded - half_triangle; ++x)
        mean[x] = std::max(mean[x] * bank[site_at(x, y)].mean_scale[c], 0.0F) + ratio_floor_;
    }
    float *red = ratio_[0].row(y), *green = ratio_[1].row(y), *blue = ratio_[2].row(y);
    for (int x = half_triangle; x < padded - half_triangle; ++x) {
      red[x] = std::sqrt(red[x] / green[x]);
      blue[x] = std::sqrt(blue[x] / green[x]);
      green[x] = 1;
    }
  }
}

Patch Tile::patch_of(const SiteFilters& site, int x, int y) const {
  const float red = 1 / ratio_[0].row(y)[x], blue = 1 / ratio_[2].row(y)[x];
  Patch patch;
  for (int r = 0; r < side; ++r) {
    const float* from = samples_.row(y + r - reach) + x - reach;
    for (int k = 0; k < lanes; ++k) {
      const int i = r * lanes + k;
      patch[i] = from[k] * (red * site.is_colour[0][i] + site.is_colour[1][i] + blue * site.is_colour[2][i]);
    }
  }
  return patch;
}

void Tile::compute_luma() {
  constexpr int first = half_triangle + reach;
  for (int y = first; y < padded - first; ++y) {
    for (int x = first; x < padded - first; ++x) {
      const SiteFilters& site = filter_bank()[site_at(x, y)];
      luma_.row(y)[x] = filtered(site.luma, patch_of(site, x, y));
    }
  }
}

void Tile::compute_tensor() {
  constexpr int first = half_triangle + reach + gradient_reach;
  const auto root = [&](float luma) { return std::sqrt(std::max(luma + root_offset_, 1e-6F)); };
  std::array<std::array<float, padded + lanes>, 4> products;
  std::array<std::array<float, padded + lanes>, 3> roots;
  for (int y = first; y < padded - first; ++y) {
    for (int r = 0; r < 3; ++r) {
      const float* from = luma_.row(y - 1 + r);
      for (int x = first - 1; x < padded - first + 1; ++x) roots[r][x] = root(from[x]);
    }
    for (int x = first; x < padded - first; ++x) {
      const float dx = (roots[1][x + 1] - roots[1][x - 1]) / 2, dy = (roots[2][x] - roots[0][x]) / 2;
      products[0][x] = dx * dx;
      products[1][x] = dx * dy;
      products[2][x] = dy * dy;
      products[3][x] = std::max(luma_.row(y)[x], 0.0F);
    }
    for (std::size_t p = 0; p < 4; ++p)
      sum_along_row(gaussian, products[p].data(), margin, padded - margin, row_sums_[p].row(y));
  }
  for (int y = margin; y < padded - margin; ++y) {
    for (std::size_t p = 0; p < 4; ++p)
      sum_along_column(gaussian, row_sums_[p], y, margin, padded - margin, tensor_[p].row(y));
  }
}

void Tile::mark_saturated() {
  const auto& bank = filter_bank();
  constexpr int first = margin - saturated_reach, width = 2 * saturated_reach + 1;
  std::fill_n(near_saturated_.data(), near_saturated_.size(), std::uint8_t{0});
  for (int y = first; y < padded - first; ++y) {
    for (int x = first; x < padded - first; ++x) {
      if (samples_.row(y)[x] < white_[static_cast<std::size_t>(bank[site_at(x, y)].own)]) continue;
      for (int dy = -saturated_reach; dy <= saturated_reach; ++dy)
        std::fill_n(near_saturated_.row(y + dy) + x - saturated_reach, width, std::uint8_t{1});
    }
  }
}

void Tile::compress_samples() {
  for (int y = margin - reach; y < padded - margin + reach; ++y) {
    const float* from = samples_.row(y);
    float* to = compressed_.row(y);
    for (int x = margin - reach; x < padded - margin + reach; ++x)
      to[x] = std::asinh(std::min(from[x], min_white_) / (2 * knee_));
  }
  is_compressed_ = true;
}

Tile::Range Tile::range_of(std::size_t colour, int x, int y, int distance) const {
  Range range;
  for (int j = y - distance; j <= y + distance; ++j) {
    for (int i = x - distance; i <= x + distance; ++i) {
      if (static_cast<std::size_t>(filter_bank()[site_at(i, j)].own) != colour) continue;
      range.low = std::min(range.low, samples_.row(j)[i]);
      range.high = std::max(range.high, samples_.row(j)[i]);
    }
  }
  return range;
}

float Tile::compressed_value(const PlacedFilters& filters, const Base& base, int x, int y) {
  if (!is_compressed_) compress_samples();
  Patch patch;
  for (int r = 0; r < side; ++r) std::copy_n(compressed_.row(y + r - reach) + x - reach, lanes, &patch[r * lanes]);
  return 2 * knee_ * std::sinh(filtered(filters, base, patch));
}

float Tile::value_near_saturation(const PlacedFilters& filters, const Base& base, float value, std::size_t colour,
                                  int x, int y) {
  const Range range = range_of(colour, x, y, 1);
  if (range.low < min_white_) {
    const float compressed = compressed_value(filters, base, x, y);
    if (compressed < min_white_) return compressed;
  }
  return range.high >= white_[colour] ? std::clamp(value, range.low, range.high) : value;
}

float Tile::value_at(const PlacedFilters& filters, const Base& base, const Patch& patch, std::size_t colour, int x,
                     int y) {
  const float value = ratio_[colour].row(y)[x] * filtered(filters, base, patch);
  if (near_saturated_.row(y)[x] != 0) return value_near_saturation(filters, base, value, colour, x, y);
  const bool implausible = value < min_value_ && range_of(colour, x, y, reach).low >= min_value_;
  return implausible ? compressed_value(filters, base, x, y) : value;
}

void Tile::write_pixel(int x, int y, float* rgb) {
  const SiteFilters& site = filter_bank()[site_at(x, y)];
  const float mean = tensor_[3].row(y)[x];
  const float noise = noise_of_trace * (luma_scale_ * mean + luma_offset_) / (4 * (mean + root_offset_));
  const Base base = base_of(tensor_[0].row(y)[x], tensor_[1].row(y)[x], tensor_[2].row(y)[x], noise);
  const Patch patch = patch_of(site, x, y);
  const auto own = static_cast<std::size_t>(site.own);
  rgb[own] = samples_.row(y)[x] * neutral_[own];
  for (std::size_t slot = 0; slot < 2; ++slot) {
    const auto target = static_cast<std::size_t>(site.target[slot]);
    rgb[target] = value_at(site.colour[slot], base, patch, target, x, y) * neutral_[target];
  }
}

void Tile::run(int x, int y, PlaneView<float> out) {
  for (int i = 0; i < padded; ++i) {
    const XTransPhase phase = phase_of_crop(setting_.phase, x - margin + i, y - margin + i);
    column_sites_[static_cast<std::size_t>(i)] = static_cast<std::size_t>(phase.x);
    row_sites_[static_cast<std::size_t>(i)] = static_cast<std::size_t>(phase.y) * period;
  }
  compute_ratios();
  compute_luma();
  compute_tensor();
  mark_saturated();
  is_compressed_ = false;
  for (int j = 0; j < out.height; ++j) {
    for (int i = 0; i < out.width / 3; ++i) write_pixel(margin + i, margin + j, out.row(j) + 3 * i);
  }
}

}  // namespace lowlux::capture::x_trans
