#include "denoise/lines/line_noise.h"

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>
#include <cstddef>
#include <functional>
#include <limits>
#include <numbers>
#include <numeric>
#include <string>
#include <utility>

#include "denoise/lines/line_rows.h"

namespace lowlux::denoise {
namespace {

constexpr int fewest_lines = 16, fewest_pixels = 4;
constexpr double sigma_per_mad = 1.4826;  // of a normal distribution

/// Returns the variance of the median of n normal values, in units of their variance over n.
double median_factor(double n) { return std::numbers::pi / 2 * n / (n + std::numbers::pi / 2 - 1); }
constexpr double hodges_lehmann_factor = std::numbers::pi / 3;

/// Returns the median of all means of two values (Hodges & Lehmann, Ann. Math. Statist. 34 (1963) 598).
double hodges_lehmann(const std::vector<double>& values) {
  std::vector<double> means;
  means.reserve(values.size() * (values.size() + 1) / 2);
  for (std::size_t i = 0; i < values.size(); ++i) {
    for (std::size_t j = i; j < values.size(); ++j) means.push_back((values[i] + values[j]) / 2);
  }
  return median_of(means);
}

/// Returns the standard deviation of normal values by their median absolute deviation.
double robust_std(std::vector<double> values) {
  const double centre = median_of(values);
  for (double& v : values) v = std::abs(v - centre);
  return sigma_per_mad * median_of(values);
}

/// Scatter between neighbouring lines of the same colours.
struct Scatter {
  double group_variance_e2 = 0;  // variance of one group's mean about the line's common offset
  double line_variance_e2 = 0;   // variance of the line's common offset, as measured by medians: V + e^2
  double groups_used = 0;
  double unevenness = 0;  // see LineOffsets
};

/// Returns LineOffsets::unevenness.
/// @param common  differences of lines two apart
double unevenness_of(const Plane<double>& means, const std::vector<double>& common) {
  std::vector<int> lines;
  for (int line = 0; line + 2 < means.width(); ++line) {
    if (std::isfinite(common[line])) lines.push_back(line);
  }
  const auto end = lines.begin() + static_cast<std::ptrdiff_t>((lines.size() + 3) / 4);
  std::ranges::nth_element(lines, end, std::greater{}, [&](int line) { return std::abs(common[line]); });
  double within_e2 = 0, groups_in = 0, between_e2 = 0;
  for (auto line = lines.begin(); line != end; ++line) {
    for (int g = 0; g < groups; ++g) {
      const double d = means.at(*line + 2, g) - means.at(*line, g) - common[*line];
      if (!std::isfinite(d)) continue;
      within_e2 += d * d;
      groups_in += 1;
    }
    between_e2 += common[*line] * common[*line] / static_cast<double>(end - lines.begin());
  }
  return between_e2 > 0 ? within_e2 / groups_in / between_e2 : INFINITY;
}

/// Returns the variance of the lines' common offsets. A difference of two lines has twice that variance, and the change
/// of that difference from one pair of lines to the next six times. The slopes of a smooth, bright scene differ from
/// line to line by more than offsets do, but change little from one line to the next; the second estimate is used where
/// they are most of the first.
/// @param common  differences of lines two apart
/// @param between  its finite values
double line_variance_of(const std::vector<double>& common, const std::vector<double>& between) {
  constexpr double min_of_slopes = 4;  // times the other estimate, which random offsets of 16 lines do not reach
  std::vector<double> changes;
  changes.reserve(common.size());
  for (std::size_t line = 0; line + 2 < common.size(); ++line) {
    const double change = common[line + 2] - common[line];
    if (std::isfinite(change)) changes.push_back(change);
  }
  const double of_differences = std::pow(robust_std(between), 2) / 2;
  if (changes.size() < fewest_lines / 2) return of_differences;
  const double of_changes = std::pow(robust_std(std::move(changes)), 2) / 6;
  return of_differences > min_of_slopes * of_changes ? of_changes : of_differences;
}

/// Returns the scatter, or nullopt where too few lines can be compared.
std::optional<Scatter> scatter_of(const Plane<double>& means) {
  const std::vector<double> common = differences(means, 2);
  std::vector<double> within, between;
  within.reserve(means.size());
  between.reserve(common.size());
  for (int line = 0; line + 2 < means.width(); ++line) {
    if (!std::isfinite(common[line])) continue;
    between.push_back(common[line]);
    for (int g = 0; g < groups; ++g) {
      const double d = means.at(line + 2, g) - means.at(line, g);
      if (std::isfinite(d)) within.push_back(d - common[line]);
    }
  }
  if (2 * between.size() < static_cast<std::size_t>(means.width())) return std::nullopt;
  const auto used = static_cast<double>(within.size()) / static_cast<double>(between.size());
  if (used < fewest_pixels) return std::nullopt;
  const double inside = robust_std(within);
  // Each difference holds the noise of two lines, and the groups' own centre has been subtracted.
  return Scatter{inside * inside / 2 * used / (used - 1), line_variance_of(common, between), used,
                 unevenness_of(means, common)};
}

tl::unexpected<Error> too_little(const Plane<double>& means, PlaneView<const float> pixels) {
  return fail(ErrorCode::insufficient,
              "line noise cannot be separated from " + std::to_string(pixels.width) + " x " +
                  std::to_string(pixels.height) + " pixels: expected 16 lines of 4 finite values at least, found " +
                  std::to_string(means.width()) + " lines or too few values; use a larger area");
}

/// The group means and their scatter.
struct Measured {
  Plane<double> means;
  Scatter scatter;
};

Result<Measured> measured(PlaneView<const float> pixels, Lines lines) {
  Plane<double> means = group_means(pixels, lines);
  if (means.width() < fewest_lines) return too_little(means, pixels);
  const auto scatter = scatter_of(means);
  if (!scatter) return too_little(means, pixels);
  return Measured{std::move(means), *scatter};
}

/// Returns the median over all lines of a parity in each group.
std::vector<double> common_of(const Plane<double>& means, int parity) {
  std::vector<double> out(groups), values;
  values.reserve(static_cast<std::size_t>(means.width()) / 2 + 1);
  for (int g = 0; g < groups; ++g) {
    values.clear();
    for (int line = parity; line < means.width(); line += 2) values.push_back(means.at(line, g));
    out[static_cast<std::size_t>(g)] = median_of(values);
  }
  return out;
}

double variance_of(const std::vector<double>& values) {
  double sum = 0, squares = 0, count = 0;
  for (const double v : values) {
    if (!std::isfinite(v)) continue;
    sum += v;
    squares += v * v;
    ++count;
  }
  return std::max((squares - sum * sum / count) / (count - 1), 0.0);
}

/// Mean of d_ij over the neighbours accepted as the same scene, and the number of lines in it.
struct Comparison {
  double offset_e = 0;
  int lines = 1;
};

/// Compares a line with its neighbours on both sides.
/// @param steps  differences of the lines from those 2, 4, 6 and so on before them
Comparison compared(const std::vector<std::vector<double>>& steps, int line, int lines, double bound_e) {
  const int reach = static_cast<int>(steps.size());
  const int room = std::min({reach, line / 2, (lines - 1 - line) / 2});  // the same on both sides: slopes cancel
  Comparison out;
  double sum = 0;
  for (int k = -room; k <= room; ++k) {
    if (k == 0) continue;
    const double d = k < 0 ? steps[-k - 1][line + 2 * k] : -steps[k - 1][line];
    if (!(std::abs(d) <= bound_e)) continue;
    sum += d;
    ++out.lines;
  }
  out.offset_e = sum / out.lines;
  return out;
}

double share(double part, double whole) { return whole > 0 ? part / whole : 0; }

}  // namespace

Result<LineOffsets> line_offsets_of_masked(PlaneView<const float> masked_e, Lines lines) {
  const auto of = measured(masked_e, lines);
  if (!of) return tl::make_unexpected(of.error());
  const std::vector<double> common[2] = {common_of(of->means, 0), common_of(of->means, 1)};
  LineOffsets out{.lines = lines};
  out.offset_e.resize(static_cast<std::size_t>(of->means.width()));
  for (int line = 0; line < of->means.width(); ++line) {
    std::vector<double> values;
    values.reserve(groups);
    for (int g = 0; g < groups; ++g) {
      const double d = of->means.at(line, g) - common[line % 2][static_cast<std::size_t>(g)];
      if (std::isfinite(d)) values.push_back(d);
    }
    out.offset_e[static_cast<std::size_t>(line)] = hodges_lehmann(values);
  }
  const double error_e2 = hodges_lehmann_factor * of->scatter.group_variance_e2 / of->scatter.groups_used;
  const double all_e2 = variance_of(out.offset_e), line_e2 = std::max(all_e2 - error_e2, 0.0);
  out.gain = share(line_e2, all_e2);
  out.line_std_e = std::sqrt(line_e2);
  out.measured_std_e = std::sqrt(error_e2);
  out.residual_std_e = std::sqrt(line_e2 * (1 - out.gain));
  for (double& offset : out.offset_e) offset = std::isfinite(offset) ? out.gain * offset : 0;
  return out;
}

Result<LineOffsets> line_offsets_of_frame(PlaneView<const float> charge_e, Lines lines,
                                          const FrameLineOptions& options) {
  assert(options.reach >= 1 && options.reach <= 64 && !(options.known_std_e && *options.known_std_e < 0));
  const auto of = measured(charge_e, lines);
  if (!of) return tl::make_unexpected(of.error());
  LineOffsets out{.lines = lines};
  const double error_e2 =
      median_factor(of->scatter.groups_used) * of->scatter.group_variance_e2 / of->scatter.groups_used;
  const double line_e2 = options.known_std_e ? *options.known_std_e * *options.known_std_e
                                             : std::max(of->scatter.line_variance_e2 - error_e2, 0.0);
  out.line_std_e = std::sqrt(line_e2);
  out.measured_std_e = std::sqrt(error_e2);
  out.unevenness = of->scatter.unevenness;
  out.gain = share(line_e2, line_e2 + error_e2);
  if (options.min_std_e > 0 && (out.line_std_e < options.min_std_e || out.gain < 0.5)) {
    out.residual_std_e = out.line_std_e;
    return out;
  }
  const double bound_e = 3 * std::sqrt(2 * (line_e2 + error_e2));
  const int count = of->means.width();
  std::vector<std::vector<double>> steps;
  for (int k = 1; k <= options.reach; ++k) steps.push_back(differences(of->means, 2 * k));
  double residual_e2 = 0;
  out.offset_e.reserve(static_cast<std::size_t>(count));
  for (int line = 0; line < count; ++line) {
    const Comparison with = compared(steps, line, count, bound_e);
    out.offset_e.push_back(out.gain * with.offset_e);
    residual_e2 += line_e2 * (1 - out.gain * (1 - 1.0 / with.lines));
  }
  out.residual_std_e = std::sqrt(residual_e2 / count);
  return out;
}

void subtract_lines(const LineOffsets& offsets, PlaneView<float> charge_e, int first) {
  const bool rows = offsets.lines == Lines::rows;
  assert(first >= 0 &&
         offsets.offset_e.size() >= static_cast<std::size_t>(first + (rows ? charge_e.height : charge_e.width)));
  const double* const offset = offsets.offset_e.data() + first;
  for (int y = 0; y < charge_e.height; ++y) {
    float* const row = charge_e.row(y);
    if (rows) {
      const double of_row = offset[y];
      for (int x = 0; x < charge_e.width; ++x) row[x] = static_cast<float>(static_cast<double>(row[x]) - of_row);
    } else {
      for (int x = 0; x < charge_e.width; ++x) row[x] = static_cast<float>(static_cast<double>(row[x]) - offset[x]);
    }
  }
}

namespace {

constexpr double nan = std::numeric_limits<double>::quiet_NaN();

/// Sum and number of the finite pixels of one group of one line.
struct GroupSum {
  double sum = 0;
  double number = 0;
};

GroupSum every_second(const float* pixels, int first, int last) {
  constexpr int at_once = 8;  // independent sums, which do not wait for each other
  std::array<double, at_once> sum{}, number{};
  const auto add = [&](int from, int count) {
    for (int k = 0; k < count; ++k) {
      const float pixel = pixels[from + 2 * k];
      const bool finite = std::isfinite(pixel);
      sum[k] += finite ? static_cast<double>(pixel) : 0;
      number[k] += finite ? 1 : 0;
    }
  };
  int i = first;
  for (; i + 2 * at_once <= last + 1; i += 2 * at_once) add(i, at_once);
  add(i, (last - i + 1) / 2);
  return {std::accumulate(sum.begin(), sum.end(), 0.0), std::accumulate(number.begin(), number.end(), 0.0)};
}

/// Returns the first pixel of each segment of a line, and the end of the last.
std::array<int, segments + 1> edges_of(int length) {
  const int pairs = (length + 1) / 2;
  std::array<int, segments + 1> edge{};
  for (int s = 0; s <= segments; ++s) {
    const auto before = (static_cast<long long>(s) * pairs + segments - 1) / segments;
    edge[static_cast<std::size_t>(s)] = std::min(2 * static_cast<int>(before), length);
  }
  return edge;
}

void sum_rows(PlaneView<const float> pixels, Plane<double>& sum, Plane<double>& number) {
  const auto edge = edges_of(pixels.width);
  for (int y = 0; y < pixels.height; ++y) {
    for (int g = 0; g < groups; ++g) {
      const auto s = static_cast<std::size_t>(g / 2);
      const GroupSum of = every_second(pixels.row(y), edge[s] + g % 2, edge[s + 1]);
      sum.at(y, g) = of.sum;
      number.at(y, g) = of.number;
    }
  }
}

void sum_columns(PlaneView<const float> pixels, Plane<double>& sum, Plane<double>& number) {
  const auto edge = edges_of(pixels.height);
  for (int s = 0; s < segments; ++s) {
    for (int y = edge[static_cast<std::size_t>(s)]; y < edge[static_cast<std::size_t>(s) + 1]; ++y) {
      const float* const row = pixels.row(y);
      double *const sums = sum.row(2 * s + y % 2), *const numbers = number.row(2 * s + y % 2);
      for (int x = 0; x < pixels.width; ++x) {
        const bool finite = std::isfinite(row[x]);
        sums[x] += finite ? static_cast<double>(row[x]) : 0;
        numbers[x] += finite ? 1 : 0;
      }
    }
  }
}

double median_difference(const Plane<double>& means, int line, int other) {
  std::array<double, groups> by_group{};
  for (int g = 0; g < groups; ++g) by_group[static_cast<std::size_t>(g)] = means.at(line, g) - means.at(other, g);
  return median_of(by_group);
}

bool all_finite(const Plane<double>& means) {
  return std::all_of(means.data(), means.data() + means.size(), [](double v) { return std::isfinite(v); });
}

}  // namespace

double median_of(std::span<double> values) {
  const auto infinite = std::partition(values.begin(), values.end(), [](double v) { return std::isfinite(v); });
  const auto count = infinite - values.begin();
  if (count == 0) return nan;
  const auto middle = values.begin() + count / 2;
  std::nth_element(values.begin(), middle, infinite);
  if (count % 2 == 1) return *middle;
  return (*middle + *std::max_element(values.begin(), middle)) / 2;
}

Plane<double> group_means(PlaneView<const float> pixels, Lines lines) {
  const int count = lines == Lines::rows ? pixels.height : pixels.width;
  Plane<double> sum(count, groups), number(count, groups);
  std::fill_n(sum.data(), sum.size(), 0.0);
  std::fill_n(number.data(), number.size(), 0.0);
  // Columns are summed row by row too, in memory order; each group's sum has the same order either way.
  (lines == Lines::rows ? sum_rows : sum_columns)(pixels, sum, number);
  for (std::size_t i = 0; i < sum.size(); ++i) {
    sum.data()[i] = number.data()[i] > 0 ? sum.data()[i] / number.data()[i] : nan;
  }
  return sum;
}

std::vector<double> differences(const Plane<double>& means, int distance) {
  assert(distance > 0 && means.height() == groups);
  const int count = std::max(means.width() - distance, 0);
  std::vector<double> out(static_cast<std::size_t>(count));
  int line = 0;
  if (all_finite(means)) line = rows::median_differences(means.data(), means.width(), distance, count, out.data());
  for (; line < count; ++line) out[line] = median_difference(means, line + distance, line);
  return out;
}

}  // namespace lowlux::denoise
