#include "calib/picture/flat_samples.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <span>
#include <utility>
#include <vector>

namespace lowlux::calib {
namespace {

constexpr int max_groups = 24;           // of one site
constexpr double min_degrees = 24 * 24;  // of freedom in a group: its variance is known to 6 %
constexpr double max_clipped = 0.75;     // of a group's pixels: beyond, its variance shows only the distribution's tail

constexpr double max_step = 3;  // standard deviations of the noise, between a sample and its surroundings

/// Sums over the samples of one group.
struct Sum {
  double n = 0, mean = 0, high = 0, high_n = 0, middle = 0;
};

NoisePoint point_of(const Sum& sum, const DetailCount& details, const ClipRange& clip, double mean_below) {
  return {sum.mean / sum.n, sum.high / sum.high_n / mean_below,
          sum.high_n * details.high * details.independent_fraction, clip};
}

std::span<const NoiseSample> of_site(const NoiseSamples& samples, int site) {
  const auto [first, last] = std::equal_range(
      samples.sample.begin(), samples.sample.end(), NoiseSample{.site = static_cast<std::uint8_t>(site)},
      [](const NoiseSample& a, const NoiseSample& b) { return a.site < b.site; });
  return {first, last};
}

/// Divides a span into groups of equal size and calls fn(group).
template <class Fn>
void for_each_group(std::span<const NoiseSample> all, int groups, const Fn& fn) {
  for (int g = 0; g < groups; ++g) {
    const std::size_t first = all.size() * g / groups, last = all.size() * (g + 1) / groups;
    if (last > first) fn(all.subspan(first, last - first));
  }
}

int groups_for(std::size_t samples, int details) {
  return std::clamp(static_cast<int>(static_cast<double>(samples) * details / min_degrees), 1, max_groups);
}

/// Sums the fraction `share` of a group that has the least coarse detail.
/// @param memory  its content is replaced
Sum quietest_of(std::span<const NoiseSample> group, double share, std::vector<NoiseSample>& memory) {
  memory.assign(group.begin(), group.end());
  const auto kept = static_cast<std::ptrdiff_t>(std::ceil(share * static_cast<double>(memory.size())));
  std::nth_element(memory.begin(), memory.begin() + kept - 1, memory.end(),
                   [](const NoiseSample& a, const NoiseSample& b) { return a.low_dn2 < b.low_dn2; });
  Sum sum;
  for (std::ptrdiff_t i = 0; i < kept; ++i) {
    sum.n += 1;
    sum.mean += memory[i].mean_dn;
    sum.high += memory[i].high_dn2;
    sum.middle += memory[i].middle_dn2;
  }
  sum.high_n = sum.n;
  return sum;
}

struct Limits {
  double low = 0, middle = 0, high = 0;  // factors of an energy relative to the line
  double mean_below = 1;
};

Limits limits_of(const DetailCount& details, const FlatRule& rule) {
  Limits out;
  out.low = chi_square_quantile(details.low, rule.low_fraction) / details.low;
  out.middle =
      details.middle > 0 ? chi_square_quantile(details.middle, rule.middle_fraction) / details.middle : INFINITY;
  const double high = chi_square_quantile(details.high, rule.high_fraction);
  out.high = high / details.high;
  out.mean_below = chi_square_mean_below(details.high, high);
  return out;
}

/// Tabulates read_variance_dn2 of one line in the range where the lower bound matters.
class ReadVariance {
 public:
  ReadVariance(const NoiseLine& line, const ClipRange& clip) : line_(line), clip_(clip) {
    // The table ends where the bound is 6 standard deviations of gain x + offset away: x = g + sqrt(g^2 + 36 v), g = 18
    // gain
    const double gain = std::max(line.gain_dn_per_e.value, 0.0), half = 18 * gain;
    const double at_bound = std::max(gain * clip.low_dn + line.offset_dn2.value, 1e-6);
    step_dn_ = (half + std::sqrt(half * half + 36 * at_bound)) / (static_cast<double>(table_.size()) - 1);
    for (std::size_t i = 0; i < table_.size(); ++i) {
      table_[i] = read_variance_dn2(line, clip.low_dn + step_dn_ * static_cast<double>(i), clip);
    }
  }
  double operator()(double mean_dn) const {
    const double place = std::max(mean_dn - clip_.low_dn, 0.0) / step_dn_;
    const auto i = static_cast<std::size_t>(std::min(place, 1e9));
    if (i + 1 >= table_.size()) return read_variance_dn2(line_, mean_dn, clip_);
    return std::lerp(table_[i], table_[i + 1], place - static_cast<double>(i));
  }

 private:
  NoiseLine line_;
  ClipRange clip_;
  double step_dn_ = 1;
  std::array<double, 129> table_{};
};

}  // namespace

double chi_square_probability(int degrees, double x) {
  if (!(x > 0)) return 0;
  // P(a + 1, t) = P(a, t) - t^a exp(-t) / Gamma(a + 1), from P(1/2, t) = erf(sqrt t) or P(1, t) = 1 - exp(-t)
  const double t = x / 2;
  double a = degrees % 2 == 0 ? 1 : 0.5;
  double p = degrees % 2 == 0 ? -std::expm1(-t) : std::erf(std::sqrt(t));
  for (; 2 * a < degrees; a += 1) p -= std::exp(a * std::log(t) - t) / std::tgamma(a + 1);
  return std::clamp(p, 0.0, 1.0);
}

double chi_square_quantile(int degrees, double probability) {
  double low = 0, high = 20.0 * degrees + 100;
  for (int i = 0; i < 60; ++i) {
    const double middle = (low + high) / 2;
    (chi_square_probability(degrees, middle) < probability ? low : high) = middle;
  }
  return (low + high) / 2;
}

double chi_square_mean_below(int degrees, double x) {
  return chi_square_probability(degrees + 2, x) / chi_square_probability(degrees, x);
}

void sort_by_surroundings(NoiseSamples& samples) {
  std::sort(samples.sample.begin(), samples.sample.end(), [](const NoiseSample& a, const NoiseSample& b) {
    return a.site != b.site ? a.site < b.site : a.around_dn < b.around_dn;
  });
}

FlatPoints flat_points(const NoiseSamples& samples, const NoiseLine& line, const PerSite<ClipRange>& clip,
                       const FlatRule& rule) {
  const Limits limit = limits_of(samples.details, rule);
  FlatPoints out;
  Sum all;
  std::vector<NoiseSample> flat;
  for (int site = 0; site < 4; ++site) {
    flat.clear();
    const ReadVariance variance(line, clip[site]);
    for (const NoiseSample& s : of_site(samples, site)) {
      const double model = variance(s.around_dn);
      const double step = s.mean_dn - s.around_dn;
      if (step * step > max_step * max_step * model * samples.details.step_fraction) continue;
      if (s.low_dn2 > limit.low * model || s.middle_dn2 > limit.middle * model) continue;
      all.n += 1;
      all.high += s.high_dn2 / model;
      all.middle += s.middle_dn2 / model;
      flat.push_back(s);
    }
    for_each_group(flat, groups_for(flat.size(), samples.details.high), [&](std::span<const NoiseSample> group) {
      Sum sum;
      for (const NoiseSample& s : group) {
        sum.n += 1;
        sum.mean += s.mean_dn;
        if (s.high_dn2 > limit.high * variance(s.around_dn)) continue;
        sum.high += s.high_dn2;
        sum.high_n += 1;
      }
      if (sum.high_n * samples.details.high < min_degrees / 2) return;
      const NoisePoint point = point_of(sum, samples.details, clip[site], limit.mean_below);
      if (clipped_fraction(line, point.mean_dn, clip[site]) > max_clipped) return;
      out.points.push_back(point);
    });
  }
  out.samples = all.n;
  out.mean_high = all.n > 0 ? all.high / all.n : 0;
  out.mean_middle = all.n > 0 ? all.middle / all.n : 0;
  return out;
}

FlatPoints quietest_points(const NoiseSamples& samples, const PerSite<ClipRange>& clip, double share) {
  FlatPoints out;
  Sum all;
  for (int site = 0; site < 4; ++site) {
    const std::span<const NoiseSample> of = of_site(samples, site);
    std::vector<NoiseSample> quiet;
    for_each_group(of, groups_for(of.size(), samples.details.high), [&](std::span<const NoiseSample> group) {
      const Sum sum = quietest_of(group, share, quiet);
      if (!(sum.high > 0)) return;
      all.n += sum.n;
      all.high += sum.n;
      all.middle += sum.n * sum.middle / sum.high;
      out.points.push_back(point_of(sum, samples.details, clip[site], 1));
    });
  }
  out.samples = all.n;
  out.mean_high = all.n > 0 ? all.high / all.n : 0;
  out.mean_middle = all.n > 0 ? all.middle / all.n : 0;
  return out;
}

double quiet_ratio(const NoiseSamples& samples, const NoiseLine& line, const PerSite<ClipRange>& clip, double share) {
  std::vector<double> ratio;
  std::vector<NoiseSample> memory;
  for (int site = 0; site < 4; ++site) {
    const std::span<const NoiseSample> of = of_site(samples, site);
    for_each_group(of, groups_for(of.size(), samples.details.high), [&](std::span<const NoiseSample> group) {
      const Sum sum = quietest_of(group, share, memory);
      const double mean_dn = sum.mean / sum.n;
      if (clipped_fraction(line, mean_dn, clip[site]) > max_clipped) return;
      const double model = read_variance_dn2(line, mean_dn, clip[site]);
      if (model > 0) ratio.push_back(sum.high / sum.high_n / model);
    });
  }
  if (ratio.empty()) return 1;
  const auto quarter = ratio.begin() + static_cast<std::ptrdiff_t>(ratio.size() / 4);
  std::nth_element(ratio.begin(), quarter, ratio.end());
  return *quarter;
}

namespace {

constexpr int windows = 16;
constexpr double dense_per_code = 30;
constexpr int min_width = 8;                // codes of a window: in fewer, steps cannot be measured
constexpr std::int64_t filled_count = 16;   // pixels: a code between two of this many is unused by chance in exp(-16)
constexpr std::size_t min_gaps = 4;         // of a window
constexpr double quietest_fraction = 0.05;  // of each group of samples
constexpr int grid = 8;
constexpr double min_excess = 0.1;

struct Steps {
  int smallest = 0;  // 0: codes are nowhere dense enough
  int largest = 0;
};

std::vector<std::int64_t> histogram(const RawDn& raw, int site) {
  std::vector<std::int64_t> out(65536, 0);
  for (int y = site >> 1; y < raw.active.height; y += 2) {
    const std::uint16_t* row = raw.dn.row(raw.active.y + y) + raw.active.x;
    for (int x = site & 1; x < raw.active.width; x += 2) ++out[row[x]];
  }
  return out;
}

/// Returns the range that holds all but a thousandth of the pixels at either end.
std::array<int, 2> range_in_use(const std::vector<std::int64_t>& count) {
  std::int64_t all = 0;
  for (const std::int64_t n : count) all += n;
  int low = 0, high = 65535;
  for (std::int64_t sum = 0; low < high && (sum += count[low]) <= all / 1000;) ++low;
  for (std::int64_t sum = 0; high > low && (sum += count[high]) <= all / 1000;) --high;
  return {low, high};
}

/// Returns the distances from codes of first..last - 1 to the next one in use, where both have so many pixels that a
/// code between them would be in use too. Codes of few pixels, between the levels of flat areas, show no distance.
std::vector<int> gaps_of(const std::vector<std::int64_t>& count, int first, int last) {
  std::vector<int> out;
  for (int code = first; code < last; ++code) {
    if (count[code] < filled_count) continue;
    const auto next = std::find_if(count.begin() + code + 1, count.end(), [](std::int64_t n) { return n > 0; });
    if (next != count.end() && *next >= filled_count) out.push_back(static_cast<int>(next - count.begin()) - code);
  }
  return out;
}

/// Returns the mean distance without those that separate levels, which are longer than twice the median.
double mean_gap(std::vector<int> gaps) {
  const auto middle = gaps.begin() + static_cast<std::ptrdiff_t>(gaps.size() / 2);
  std::nth_element(gaps.begin(), middle, gaps.end());
  const int longest = 2 * *middle;
  double sum = 0, n = 0;
  for (const int gap : gaps) {
    if (gap > longest) continue;
    sum += gap;
    n += 1;
  }
  return sum / n;
}

Steps steps_of(const std::vector<std::int64_t>& count) {
  const auto [low, high] = range_in_use(count);
  Steps out;
  for (int w = 0; w < windows; ++w) {
    const int first = low + (high - low) * w / windows, last = low + (high - low) * (w + 1) / windows;
    std::int64_t pixels = 0;
    for (int code = first; code < last; ++code) pixels += count[code];
    if (last - first < min_width || static_cast<double>(pixels) < dense_per_code * (last - first)) continue;
    std::vector<int> gaps = gaps_of(count, first, last);
    if (gaps.size() < min_gaps) continue;
    const int step = static_cast<int>(std::lround(mean_gap(std::move(gaps))));
    out.smallest = out.smallest == 0 ? step : std::min(out.smallest, step);
    out.largest = std::max(out.largest, step);
  }
  return out;
}

/// Returns the mean size of second differences at each phase of an 8 x 8 grid of one colour's pixels, across columns or
/// rows.
std::array<double, grid> restlessness(const RawDn& raw, bool across_columns) {
  constexpr int period = 2 * grid;  // pixels
  const int dx = across_columns ? 2 : 0, dy = across_columns ? 0 : 2;
  const std::ptrdiff_t step = across_columns ? 2 : 2 * raw.dn.view().stride;
  std::array<std::int64_t, grid> sum{}, n{};
  for (int y = 2 * dy; y < raw.active.height - dy; ++y) {
    const std::uint16_t* const row = raw.dn.row(raw.active.y + y) + raw.active.x;
    const auto size_at = [&](int x) {
      const std::uint16_t* const at = row + x;
      return std::abs(3 * (at[0] - at[-step]) - at[step] + at[-2 * step]);
    };
    std::array<int, period> of_row{}, n_of_row{};  // by column from the first, modulo the period
    const int first = 2 * dx, last = raw.active.width - dx;
    int x = first;
    for (; x + period <= last; x += period) {
      for (int k = 0; k < period; ++k) of_row[k] += size_at(x + k);
      for (int& count : n_of_row) ++count;
    }
    for (; x < last; ++x) {
      of_row[(x - first) % period] += size_at(x);
      ++n_of_row[(x - first) % period];
    }
    for (int k = 0; k < period; ++k) {
      const int phase = (across_columns ? (first + k) / 2 : y / 2) % grid;
      sum[phase] += of_row[k];
      n[phase] += n_of_row[k];
    }
  }
  std::array<double, grid> out{};
  for (int p = 0; p < grid; ++p) out[p] = n[p] > 0 ? static_cast<double>(sum[p]) / static_cast<double>(n[p]) : 0;
  return out;
}

/// Returns the relative excess of the largest phase above the quiet ones, or 0 if it is within their scatter. A step
/// raises the phase it lies at and both adjacent ones: five remain.
double excess_of(std::array<double, grid> phase) {
  std::sort(phase.begin(), phase.end());
  const double quiet = phase[2], scatter = phase[4] - phase[0];
  return quiet > 0 && phase[7] - quiet > 3 * scatter ? phase[7] / quiet - 1 : 0;
}

}  // namespace

RawTraces code_traces(const RawDn& raw, Executor& executor) {
  std::array<Steps, 4> steps_of_site;
  std::array<double, 2> excess{};
  for_each_index(executor, 6, [&](int task) {
    if (task < 2) {
      excess[task] = excess_of(restlessness(raw, task == 0));
    } else {
      steps_of_site[task - 2] = steps_of(histogram(raw, task - 2));
    }
  });
  RawTraces out;
  for (const Steps& steps : steps_of_site) {
    if (steps.smallest == 0) continue;
    out.code_step_dn = std::max(out.code_step_dn, steps.smallest);
    out.largest_step_dn = std::max(out.largest_step_dn, steps.largest);
    out.companded = out.companded || steps.largest > steps.smallest;
  }
  out.grid_excess = std::max(excess[0], excess[1]);
  out.block_grid = out.grid_excess > min_excess;
  return out;
}

void add_filter_trace(const NoiseSamples& blocks_by_surroundings, RawTraces& traces) {
  const FlatPoints quiet = quietest_points(blocks_by_surroundings, {}, quietest_fraction);
  traces.fine_to_coarse = quiet.mean_middle > 0 ? quiet.mean_high / quiet.mean_middle : 0;
  traces.denoised = quiet.mean_middle > 0 && traces.fine_to_coarse < min_fine_to_coarse;
}

}  // namespace lowlux::calib
