#include "isp/raw/measure/saturation_level.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <vector>

#include "isp/raw/black_point.h"

namespace lowlux::isp {
namespace {

constexpr double lowest = 0.75, highest = 0.99;  // fractions of white
constexpr double counted_from = 0.72;            // codes below a peak are counted too
constexpr double max_std = 1.0 / 400;            // of the range from black to white, like the three below
constexpr double clearly_below = 0.02;
constexpr double darkest_light = 0.02;
constexpr double first_half_width = 0.01;
constexpr double max_of_light_noise = 0.5;
constexpr double min_peak_ratio = 5, max_above = 0.01;
constexpr std::int64_t min_above = 2;  // pixels, such as hot ones
constexpr std::int64_t min_blocks = 24;
constexpr double min_spread = 8;  // bins
constexpr int bins = 64;
constexpr double neutral = 0.03;
constexpr std::int64_t min_lit_blocks = 32;
constexpr int block = 4;
constexpr int lit_blocks_step = 4;
constexpr std::int64_t max_pixels = 4'000'000;
constexpr int max_refinements = 8;

/// Holds the range of the codes of each colour.
struct Ranges {
  std::array<double, 3> pedestal_dn{};
  std::array<double, 3> white_dn{};
  double mean_dn = 0;  // from black to white

  double fraction(int colour, double code) const {
    return (code - pedestal_dn[colour]) / (white_dn[colour] - pedestal_dn[colour]);
  }
  double code_at(int colour, double fraction) const {
    return pedestal_dn[colour] + fraction * (white_dn[colour] - pedestal_dn[colour]);
  }
};

Ranges ranges_of(const RawDn& raw, const BlackPoint& black) {
  Ranges out{.mean_dn = mean_range_dn(raw, black)};
  for (int site = 0; site < 4; ++site) {
    const auto c = static_cast<std::size_t>(colour_at(raw.phase, site & 1, site >> 1));
    out.pedestal_dn[c] += black.pedestal_dn[site] / (c == 1 ? 2 : 1);
    out.white_dn[c] = white_at(raw, site);
  }
  return out;
}

/// Visits the rows of blocks that are examined: first(row), the first row of its four.
template <class Visit>
void for_each_block_row(const RawDn& raw, const Visit& visit) {
  const std::int64_t pixels = std::int64_t{raw.active.width} * raw.active.height;
  const auto step = static_cast<int>(std::max<std::int64_t>(1, (pixels + max_pixels - 1) / max_pixels));
  for (int y = 0; y + block <= raw.active.height; y += step * block) visit(y);
}

/// Counts the pixels of each colour by code, from a lowest code on.
class Histogram {
 public:
  explicit Histogram(int first) : first_(first) {
    for (auto& counts : counts_) counts.resize(static_cast<std::size_t>(65536 - first));
  }

  void add_row(const std::uint16_t* row, int width, int even, int odd) {
    constexpr int chunk = 64;
    for (int x = 0; x < width; x += chunk) {
      const int end = std::min(x + chunk, width);
      if (end - x == chunk) {
        std::uint16_t largest = 0;
        for (int i = 0; i < chunk; ++i) largest = std::max(largest, row[x + i]);
        if (largest < first_) continue;
      }
      for (int i = x; i < end; ++i) {
        if (row[i] >= first_) ++counts_[static_cast<std::size_t>((i & 1) == 0 ? even : odd)][row[i] - first_];
      }
    }
  }

  int first() const { return first_; }

  /// Returns the pixels of a colour with codes from `low` to `high`.
  std::int64_t count(int colour, double low, double high) const {
    const auto at = [this](double code) { return static_cast<int>(std::clamp(code, 1.0 * first_, 65536.0)) - first_; };
    const auto& counts = counts_[static_cast<std::size_t>(colour)];
    std::int64_t sum = 0;
    for (int i = at(std::ceil(low)); i < at(std::floor(high) + 1); ++i) sum += counts[static_cast<std::size_t>(i)];
    return sum;
  }
  std::int64_t count(double low, double high) const {
    return count(0, low, high) + count(1, low, high) + count(2, low, high);
  }

  std::int64_t at(int code) const {
    const auto i = static_cast<std::size_t>(code - first_);
    return std::int64_t{counts_[0][i]} + counts_[1][i] + counts_[2][i];
  }

 private:
  int first_;
  std::array<std::vector<std::uint32_t>, 3> counts_;
};

Histogram histogram_of(const RawDn& raw, int first) {
  Histogram out(first);
  for_each_block_row(raw, [&](int y) {
    for (int i = 0; i < block; ++i) {
      const int even = static_cast<int>(colour_at(raw.phase, 0, i)), odd = static_cast<int>(colour_at(raw.phase, 1, i));
      out.add_row(raw.dn.row(raw.active.y + y + i) + raw.active.x, raw.active.width, even, odd);
    }
  });
  return out;
}

/// Holds the mean and standard deviation of the codes of a peak, and the codes that belong to it.
struct Peak {
  SaturationLevel level;
  double low_dn = 0;
  double high_dn = 0;

  double half_width_dn() const { return high_dn - level.mean_dn; }
};

Peak peak_around(const Histogram& histogram, double centre_dn, double half_width_dn) {
  double count = 0, sum = 0, squares = 0;
  const int last = static_cast<int>(std::min(65535.0, std::floor(centre_dn + half_width_dn)));
  for (int i = std::max(histogram.first(), static_cast<int>(std::ceil(centre_dn - half_width_dn))); i <= last; ++i) {
    const auto n = static_cast<double>(histogram.at(i));
    count += n;
    sum += n * (i - centre_dn);
    squares += n * (i - centre_dn) * (i - centre_dn);
  }
  if (!(count > 0)) return {};
  const double mean = sum / count, std = std::sqrt(std::max(0.0, squares / count - mean * mean));
  const double half = 3 * std + 1;
  return {{centre_dn + mean, std}, centre_dn + mean - half, centre_dn + mean + half};
}

/// Returns the narrowest peak around the most frequent codes within these; nullopt where there are none.
std::optional<Peak> find_peak(const Histogram& histogram, int last, double range_dn) {
  const int width = std::max(1, static_cast<int>(max_std * range_dn));
  std::int64_t sum = 0, most = 0;
  int centre = 0;
  for (int code = histogram.first(); code <= last; ++code) {
    sum += histogram.at(code);
    if (code - width >= histogram.first()) sum -= histogram.at(code - width);
    if (sum > most) {
      most = sum;
      centre = code - width / 2;
    }
  }
  if (most == 0) return std::nullopt;
  double half_width_dn = std::max(2.0, first_half_width * range_dn);
  Peak out = peak_around(histogram, centre, half_width_dn);
  for (int i = 0; i < max_refinements && out.half_width_dn() < half_width_dn; ++i) {
    half_width_dn = out.half_width_dn();
    out = peak_around(histogram, out.level.mean_dn, half_width_dn);
  }
  return out;
}

/// Returns the least standard deviation of the colours of light at a code.
double light_std_dn(const NoiseProfile& noise, const Ranges& ranges, double code) {
  double variance = std::numeric_limits<double>::infinity();
  for (int c = 0; c < 3; ++c) {
    const auto i = static_cast<std::size_t>(c);
    variance = std::min(variance, noise.scale[i] * ranges.fraction(c, code) + noise.offset[i]);
  }
  return std::sqrt(std::max(0.0, variance)) * ranges.mean_dn;
}

/// Returns whether the codes of a peak are the upper end of all colours, and far more frequent than those below.
bool ends_the_histogram(const Histogram& histogram, const Peak& peak) {
  const double half = peak.half_width_dn();
  for (int c = 0; c < 3; ++c) {
    const std::int64_t above = histogram.count(c, peak.level.mean_dn + 2 * half, 65535);
    const auto within = static_cast<double>(histogram.count(c, peak.low_dn, peak.high_dn));
    if (static_cast<double>(above) > static_cast<double>(min_above) + max_above * within) return false;
  }
  const std::int64_t within = histogram.count(peak.low_dn, peak.high_dn);
  const std::int64_t below = histogram.count(peak.low_dn - 4 * half, peak.low_dn - 2 * half);
  return static_cast<double>(within) >= min_peak_ratio * static_cast<double>(below);
}

/// Holds the smallest, the largest and the mean code of each colour in a block.
struct BlockCodes {
  std::array<int, 3> smallest{65535, 65535, 65535};
  std::array<int, 3> largest{};
  std::array<double, 3> mean{};
};

BlockCodes codes_of(const RawDn& raw, int x, int y) {
  BlockCodes out;
  for (int j = 0; j < block; ++j) {
    const std::uint16_t* const row = raw.dn.row(raw.active.y + y + j) + raw.active.x + x;
    for (int i = 0; i < block; ++i) {
      const auto c = static_cast<std::size_t>(colour_at(raw.phase, i, j));
      out.smallest[c] = std::min<int>(out.smallest[c], row[i]);
      out.largest[c] = std::max<int>(out.largest[c], row[i]);
      out.mean[c] += row[i];
    }
  }
  for (std::size_t c = 0; c < 3; ++c) out.mean[c] /= c == 1 ? 8 : 4;
  return out;
}

/// Counts the blocks of which one colour is in the peak, by that colour, another one and the mean of that one.
class Evidence {
 public:
  Evidence(const Ranges& ranges, const Peak& peak) : ranges_(ranges), peak_(peak) {
    below_dn_ = peak.low_dn - std::max(peak.half_width_dn(), clearly_below * ranges.mean_dn);
  }

  void add(const BlockCodes& codes) {
    for (std::size_t c = 0; c < 3; ++c) {
      if (codes.smallest[c] < peak_.low_dn || codes.largest[c] > peak_.high_dn) continue;
      for (std::size_t other = 0; other < 3; ++other) {
        if (!(codes.largest[other] < below_dn_)) continue;
        const double fraction = ranges_.fraction(static_cast<int>(other), codes.mean[other]);
        const int bin = std::clamp(static_cast<int>(bins * fraction), 0, bins - 1);
        ++counts_[c][other][static_cast<std::size_t>(bin)];
      }
    }
  }

  /// Counts whether the colours of a block agree, if nothing in it is near the peak or dark.
  void add_colour(const BlockCodes& codes) {
    std::array<double, 3> light{};
    double sum = 0;
    for (std::size_t c = 0; c < 3; ++c) {
      if (!(codes.largest[c] < below_dn_)) return;
      light[c] = ranges_.fraction(static_cast<int>(c), codes.mean[c]);
      sum += light[c] / 3;
    }
    if (sum < darkest_light) return;
    ++lit_;
    for (std::size_t i = 0; i < 2; ++i) {
      const double colour = light[2 * i];
      less_[i] += colour < (1 - neutral) * light[1] ? 1 : 0;
      more_[i] += colour > (1 + neutral) * light[1] ? 1 : 0;
    }
  }

  bool shows_saturation() const {
    int colours = 0;
    for (const auto& others : counts_) colours += std::ranges::any_of(others, varies) ? 1 : 0;
    return colours >= 2 && lit_ >= min_lit_blocks && !is_neutral();
  }

 private:
  using Counts = std::array<std::int64_t, bins>;

  /// Returns whether there are enough blocks, and their values differ.
  static bool varies(const Counts& counts) {
    double sum = 0, squares = 0;
    for (const std::int64_t count : counts) {
      sum += static_cast<double>(count);
      squares += static_cast<double>(count) * static_cast<double>(count);
    }
    return sum >= static_cast<double>(min_blocks) && sum * sum >= min_spread * squares;
  }

  bool is_neutral() const {
    return std::ranges::all_of(std::array{less_[0], more_[0], less_[1], more_[1]},
                               [this](std::int64_t count) { return 2 * count <= lit_; });
  }

  Ranges ranges_;
  Peak peak_;
  double below_dn_ = 0;
  std::array<std::array<Counts, 3>, 3> counts_{};
  std::int64_t lit_ = 0;
  std::array<std::int64_t, 2> less_{}, more_{};  // red and blue
};

Evidence evidence_of(const RawDn& raw, const Ranges& ranges, const Peak& peak) {
  Evidence out(ranges, peak);
  for_each_block_row(raw, [&](int y) {
    for (int x = 0; x + block <= raw.active.width; x += block) {
      const BlockCodes codes = codes_of(raw, x, y);
      out.add(codes);
      if (x / block % lit_blocks_step == 0) out.add_colour(codes);
    }
  });
  return out;
}

}  // namespace

std::optional<SaturationLevel> measure_saturation_below_white(const RawDn& raw, const BlackPoint& black,
                                                              const std::optional<NoiseProfile>& noise) {
  if (raw.layout != SensorLayout::bayer || raw.is_float() || raw.dn.empty()) return std::nullopt;
  const Ranges ranges = ranges_of(raw, black);
  double counted = 0, first = 0, last = 65535;
  for (int c = 0; c < 3; ++c) {
    counted = std::max(counted, ranges.code_at(c, counted_from));
    first = std::max(first, ranges.code_at(c, lowest));
    last = std::min(last, ranges.code_at(c, highest));
  }
  if (!(first < last)) return std::nullopt;
  const Histogram histogram = histogram_of(raw, static_cast<int>(std::ceil(counted)));
  const std::optional<Peak> peak = find_peak(histogram, static_cast<int>(last), ranges.mean_dn);
  if (!peak || peak->level.mean_dn < first || peak->level.mean_dn > last) return std::nullopt;
  if (!(peak->level.std_dn <= max_std * ranges.mean_dn)) return std::nullopt;
  if (noise && !(peak->level.std_dn <= max_of_light_noise * light_std_dn(*noise, ranges, peak->level.mean_dn))) {
    return std::nullopt;
  }
  if (!ends_the_histogram(histogram, *peak)) return std::nullopt;
  if (!evidence_of(raw, ranges, *peak).shows_saturation()) return std::nullopt;
  return peak->level;
}

}  // namespace lowlux::isp
