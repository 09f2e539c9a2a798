#include "denoise/check/noise_check.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <iterator>
#include <limits>

#include <fmt/format.h>

#include "denoise/spatial/layout.h"

namespace lowlux::denoise {
namespace {

constexpr int part = block << (max_levels - 1);  // cells of a tile, each way: one block of the coarsest level
constexpr int window = 9;
constexpr std::size_t min_blocks = 8;
constexpr float none = std::numeric_limits<float>::quiet_NaN();

/// Details of a block of 8 x 8, divided by their variance in the model, averaged over R, G, B.
struct BlockDetail {
  double across;    // mean square of the horizontal and vertical ones
  double diagonal;  // mean square
};

/// The model's noise of one colour, G being the mean of two sites.
struct ColourModel {
  double dark_e;
  double variance_e2;
  double sites;
  float saturation_e;

  /// Returns the variance of a cell whose mean, dark charge included, is mean_e.
  double variance_of(double mean_e) const { return (std::max(mean_e, 0.3 * dark_e + 0.02) + variance_e2) / sites; }
};

struct Check {
  const RawElectronsView& raw;
  std::array<ColourModel, 3> model;
  std::array<std::vector<float>, 3> cells;  // of one tile, part x part, dark charge included
  int tile_x = 0, tile_y = 0;               // first cell of the tile
  std::array<std::vector<BlockDetail>, max_levels> blocks;
  NoiseCheck out;
  std::array<long, 3> negative{};
  long without_signal = 0;
  long long saturated = 0;

  Check(const RawElectronsView& r, const RawNoise& noise) : raw(r) {
    const PerSite<int> site = sites_of(raw.phase);
    const auto& d = noise.dark_mean_e;
    const std::array dark_e{d[site[0]], (d[site[1]] + d[site[2]]) / 2, d[site[3]]};
    for (int k = 0; k < 3; ++k) {
      model[k] = {dark_e[k], noise.variance_e2[k], k == 1 ? 2.0 : 1.0, static_cast<float>(noise.saturation_e[k])};
    }
    for (auto& colour : cells) colour.resize(static_cast<std::size_t>(part) * part);
    const auto of_level0 = static_cast<std::size_t>(raw.value.width / (2 * block)) * (raw.value.height / (2 * block));
    for (int l = 0; l < max_levels; ++l) blocks[l].reserve(of_level0 >> (2 * l));
  }

  void load(int x0, int y0, int columns, int rows);
  void add_windows(int columns, int rows);
  void add_window(int x0, int y0);
  void add_blocks(int level, int columns, int rows);
  std::optional<BlockDetail> detail(int x0, int y0, int level) const;
  /// Returns the noise ratio of a square of `side` cells of a level of the tile.
  double ratio_of(int x0, int y0, int side, int level) const {
    const int px = 2 << level;  // side of a cell in pixels
    return raw.noise_ratio.mean(2 * tile_x + px * x0, 2 * tile_y + px * y0, px * side, px * side);
  }
  void halve(int columns, int rows);
  /// Measures the rows of tiles first .. last - 1.
  void measure(int first, int last);
  /// Adds the counts and blocks that `other` measured.
  void add(const Check& other);
  void finish();
};

/// Loads the cells of the tile whose first cell is (x0, y0). Saturated and NaN sites make their cells NaN.
void Check::load(int x0, int y0, int columns, int rows) {
  const auto usable = [this](float e, int colour) {
    if (e >= model[colour].saturation_e) {
      ++saturated;
      return none;
    }
    return std::isnan(e) ? none : std::clamp(e, -1e9f, 1e9f);
  };
  const int red_x = red_column(raw.phase), red_y = red_row(raw.phase);
  tile_x = x0;
  tile_y = y0;
  for (int y = 0; y < rows; ++y) {
    const float* const with_red = raw.value.row(2 * (y0 + y) + red_y) + std::ptrdiff_t{2} * x0;
    const float* const with_blue = raw.value.row(2 * (y0 + y) + 1 - red_y) + std::ptrdiff_t{2} * x0;
    const std::size_t at = static_cast<std::size_t>(y) * part;
    for (int x = 0; x < columns; ++x) {
      cells[0][at + x] = usable(with_red[2 * x + red_x], 0);
      cells[1][at + x] = 0.5f * (usable(with_red[2 * x + 1 - red_x], 1) + usable(with_blue[2 * x + red_x], 1));
      cells[2][at + x] = usable(with_blue[2 * x + 1 - red_x], 2);
    }
  }
}

void Check::add_window(int x0, int y0) {
  std::array<double, 3> deviations{};  // deviation of the mean signal from 0, in standard deviations
  const double ratio = ratio_of(x0, y0, window, 0);
  for (int c = 0; c < 3; ++c) {
    double sum = 0, squares = 0;
    const auto about = static_cast<double>(cells[c][static_cast<std::size_t>(y0) * part + x0]);
    for (int y = y0; y < y0 + window; ++y) {
      for (int x = x0; x < x0 + window; ++x) {
        const auto e = static_cast<double>(cells[c][static_cast<std::size_t>(y) * part + x]) - about;
        sum += e;
        squares += e * e;
      }
    }
    constexpr double count = window * window;
    const double mean = sum / count, own = (squares - sum * mean) / (count - 1);
    if (std::isnan(mean)) return;
    const double variance = std::max(own, ratio * model[c].variance_of(mean + about));
    deviations[c] = (mean + about - model[c].dark_e) / std::sqrt(variance / count);
  }
  ++out.windows;
  for (int c = 0; c < 3; ++c) negative[c] += deviations[c] < -4 ? 1 : 0;
  without_signal += *std::max_element(deviations.begin(), deviations.end()) > 4 ? 0 : 1;
}

void Check::add_windows(int columns, int rows) {
  for (int y = 0; y + window <= rows; y += window) {
    for (int x = 0; x + window <= columns; x += window) add_window(x, y);
  }
}

/// Returns the details of one block, or nullopt if one is not finite.
std::optional<BlockDetail> Check::detail(int x0, int y0, int level) const {
  const double finest_cells = std::ldexp(1.0, 2 * level), ratio = ratio_of(x0, y0, block, level);
  BlockDetail sum{0, 0};
  for (int c = 0; c < 3; ++c) {
    double mean = 0, across = 0, diagonal = 0;
    for (int y = y0; y < y0 + block; y += 2) {
      const float* const upper = cells[c].data() + static_cast<std::ptrdiff_t>(y) * part;
      const float* const lower = upper + part;
      for (int x = x0; x < x0 + block; x += 2) {
        const float falling = upper[x] - lower[x + 1], rising = upper[x + 1] - lower[x];
        const float both = upper[x] + lower[x + 1] - upper[x + 1] - lower[x];
        // This is the sum of the squares of ((falling + rising) / 2, (falling - rising) / 2).
        across += 0.5 * static_cast<double>(falling * falling + rising * rising);
        diagonal += 0.25 * static_cast<double>(both * both);
        mean += static_cast<double>(upper[x] + lower[x + 1] + upper[x + 1] + lower[x]);
      }
    }
    constexpr double details = block * block / 4.0;
    const double variance = ratio * model[c].variance_of(mean / (block * block)) / finest_cells;
    sum.across += across / (2 * details * variance) / 3;
    sum.diagonal += diagonal / (details * variance) / 3;
  }
  if (!std::isfinite(sum.across) || !std::isfinite(sum.diagonal)) return std::nullopt;
  return sum;
}

void Check::add_blocks(int level, int columns, int rows) {
  for (int y = 0; y + block <= rows; y += block) {
    for (int x = 0; x + block <= columns; x += block) {
      if (const auto found = detail(x, y, level)) blocks[level].push_back(*found);
    }
  }
}

void Check::halve(int columns, int rows) {
  for (auto& colour : cells) {
    for (int y = 0; y < rows; ++y) {
      const float *const upper = colour.data() + std::ptrdiff_t{2} * y * part, *const lower = upper + part;
      float* const to = colour.data() + std::ptrdiff_t{y} * part;
      for (int x = 0; x < columns; ++x) {
        to[x] = 0.25f * (upper[2 * x] + upper[2 * x + 1] + lower[2 * x] + lower[2 * x + 1]);
      }
    }
  }
}

void Check::measure(int first, int last) {
  const int columns = raw.value.width / 2, rows = raw.value.height / 2;  // complete cells only
  for (int y = first * part; y < std::min(last * part, rows); y += part) {
    for (int x = 0; x < columns; x += part) {
      int width = std::min(part, columns - x), height = std::min(part, rows - y);
      load(x, y, width, height);
      add_windows(width, height);
      for (int level = 0; level < max_levels; ++level, width /= 2, height /= 2) {
        if (level > 0) halve(width, height);
        add_blocks(level, width, height);
      }
    }
  }
}

void Check::add(const Check& other) {
  for (int l = 0; l < max_levels; ++l) std::ranges::copy(other.blocks[l], std::back_inserter(blocks[l]));
  for (int c = 0; c < 3; ++c) negative[c] += other.negative[c];
  out.windows += other.out.windows;
  without_signal += other.without_signal;
  saturated += other.saturated;
}

/// Returns the mean of `wanted` over the tenth of the blocks, at least 8, with the smallest `flatness`.
double mean_of_flattest(std::vector<BlockDetail>& found, double BlockDetail::*flatness, double BlockDetail::*wanted) {
  const std::size_t count = std::max(min_blocks, found.size() / 10);
  const auto last = found.begin() + static_cast<std::ptrdiff_t>(count);
  std::nth_element(found.begin(), last - 1, found.end(),
                   [flatness](const BlockDetail& a, const BlockDetail& b) { return a.*flatness < b.*flatness; });
  double sum = 0;
  for (auto at = found.begin(); at != last; ++at) sum += (*at).*wanted;
  return sum / static_cast<double>(count);
}

void Check::finish() {
  for (int l = 0; l < max_levels; ++l) {
    auto& found = blocks[l];
    if (found.size() < min_blocks) continue;
    out.measured_over_model[l] = mean_of_flattest(found, &BlockDetail::across, &BlockDetail::diagonal);
    out.across_over_model[l] = mean_of_flattest(found, &BlockDetail::diagonal, &BlockDetail::across);
  }
  const auto share = [](long long of, long long all) {
    return all == 0 ? 0 : static_cast<double>(of) / static_cast<double>(all);
  };
  for (int c = 0; c < 3; ++c) out.fraction_negative[c] = share(negative[c], out.windows);
  out.fraction_without_signal = share(without_signal, out.windows);
  const long long columns = raw.value.width / 2, rows = raw.value.height / 2;
  out.fraction_saturated = share(saturated, 4 * columns * rows);
}

}  // namespace

NoiseCheck check_noise(const RawElectronsView& raw, const RawNoise& noise, Executor& executor) {
  assert(raw.value.width >= 2 && raw.value.height >= 2);
  const int rows = raw.value.height / 2;  // complete cells only
  const int parts = (rows + part - 1) / part, bands = std::min(executor.width(), parts);
  std::vector<Check> band;
  band.reserve(static_cast<std::size_t>(bands));
  for (int i = 0; i < bands; ++i) band.emplace_back(raw, noise);
  for_each_index(executor, bands,
                 [&](int i) { band[static_cast<std::size_t>(i)].measure(parts * i / bands, parts * (i + 1) / bands); });
  for (int i = 1; i < bands; ++i) band[0].add(band[static_cast<std::size_t>(i)]);
  band[0].finish();
  return band[0].out;
}

std::array<double, max_levels> variance_scale_of(const NoiseCheck& check) {
  const auto ratio = [&check](int l) {
    return std::max(check.measured_over_model[l].value_or(1), check.across_over_model[l].value_or(1));
  };
  std::array<double, max_levels> scale{};
  for (int l = 0; l < max_levels; ++l) {
    const double own = ratio(l), coarser = l + 1 < max_levels ? std::min(1.0, ratio(l + 1)) : own;
    const double both = (own + std::max(own, coarser)) / 2;
    scale[l] = both < min_ratio ? std::max(both, 0.01) : 1;
  }
  return scale;
}

std::vector<NoiseRemark> remarks_on(const NoiseCheck& check) {
  std::vector<NoiseRemark> out;
  const auto* const negative = std::max_element(check.fraction_negative.begin(), check.fraction_negative.end());
  if (*negative > 0.01) {
    constexpr std::array<const char*, 3> names{"red", "green", "blue"};
    out.push_back(
        {NoiseFinding::black_suspicious,
         fmt::format("the black level is suspicious: {:.0f} % of the {} areas are darker than black by more than "
                     "4 standard deviations; the black level or the dark current is too high: --black sets it",
                     100 * *negative, names[negative - check.fraction_negative.begin()])});
  }
  double least = 1, most_of_least = 0;
  bool measured = false;
  for (const auto& ratio : check.measured_over_model) {
    if (!ratio) continue;
    most_of_least = measured ? std::min(most_of_least, *ratio) : *ratio;
    least = std::min(least, *ratio);
    measured = true;
  }
  if (least < min_ratio) {
    out.push_back(
        {NoiseFinding::noise_below_model,
         fmt::format("the image has {:.2f} times the noise variance that its model states: it was denoised or "
                     "compressed before, or the model is wrong (--noise or --profile replaces it)",
                     least)});
  }
  if (measured && most_of_least > largest_ratio) {
    out.push_back(
        {NoiseFinding::noise_above_model,
         fmt::format("the image has {:.2f} times the noise variance that its model states: the model is wrong, or "
                     "the scene has fine texture everywhere (--noise or --profile replaces the model)",
                     most_of_least)});
  }
  if (check.windows > 0 && check.fraction_without_signal > 0.999) {
    out.push_back({NoiseFinding::all_dark,
                   "no part of the image is brighter than its dark signal: expose longer, or remove the lens cap"});
  }
  if (check.fraction_saturated > 0.99) {
    out.push_back({NoiseFinding::all_saturated,
                   fmt::format("{:.1f} % of the pixels are saturated: expose less", 100 * check.fraction_saturated)});
  }
  return out;
}

}  // namespace lowlux::denoise
