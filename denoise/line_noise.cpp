#include "denoise/line_noise.h"

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>
#include <cstddef>
#include <limits>
#include <numbers>
#include <span>
#include <string>
#include <utility>

namespace lowlux::denoise {
namespace {

constexpr int segments = 8;  // of a line, each in two groups: even and odd places, whose colours differ
constexpr int groups = 2 * segments;
constexpr int fewest_lines = 16, fewest_pixels = 4;
constexpr double sigma_per_mad = 1.4826;  // of a normal law
constexpr double nan = std::numeric_limits<double>::quiet_NaN();

/// Variances of the location of n normal values, in units of theirs over n.
double median_factor(double n) { return std::numbers::pi / 2 * n / (n + std::numbers::pi / 2 - 1); }
constexpr double hodges_lehmann_factor = std::numbers::pi / 3;

/// The median of what is finite; NaN if nothing is. Reorders.
double median_of(std::span<double> values) {
  const auto infinite = std::partition(values.begin(), values.end(), [](double v) { return std::isfinite(v); });
  const auto count = infinite - values.begin();
  if (count == 0) return nan;
  const auto middle = values.begin() + count / 2;
  std::nth_element(values.begin(), middle, infinite);
  if (count % 2 == 1) return *middle;
  return (*middle + *std::max_element(values.begin(), middle)) / 2;
}

/// The median of all means of two values (Hodges & Lehmann, Ann. Math. Statist. 34 (1963) 598).
double hodges_lehmann(const std::vector<double>& values) {
  std::vector<double> means;
  means.reserve(values.size() * (values.size() + 1) / 2);
  for (std::size_t i = 0; i < values.size(); ++i) {
    for (std::size_t j = i; j < values.size(); ++j) means.push_back((values[i] + values[j]) / 2);
  }
  return median_of(means);
}

/// Normal standard deviation by the median absolute deviation.
double robust_std(std::vector<double> values) {
  const double centre = median_of(values);
  for (double& v : values) v = std::abs(v - centre);
  return sigma_per_mad * median_of(values);
}

/// Means of the groups of pixels of every line: `groups` wide, as high as there are lines. NaN for a group without
/// values.
Plane<double> group_means(PlaneView<const float> pixels, Lines lines) {
  const bool rows = lines == Lines::rows;
  const int count = rows ? pixels.height : pixels.width, length = rows ? pixels.width : pixels.height;
  Plane<double> sum(groups, count), number(groups, count);
  std::fill_n(sum.data(), sum.size(), 0.0);
  std::fill_n(number.data(), number.size(), 0.0);
  const int pairs = (length + 1) / 2;
  const auto group_of = [&](int i) {
    return 2 * static_cast<int>(static_cast<long long>(i / 2) * segments / pairs) + i % 2;
  };
  // Row by row for columns too, as memory lies; each group's sum has the same order either way.
  for (int y = 0; y < pixels.height; ++y) {
    const float* const row = pixels.row(y);
    for (int x = 0; x < pixels.width; ++x) {
      if (!std::isfinite(row[x])) continue;
      const int line = rows ? y : x, group = rows ? group_of(x) : group_of(y);
      sum.at(group, line) += static_cast<double>(row[x]);
      number.at(group, line) += 1;
    }
  }
  for (std::size_t i = 0; i < sum.size(); ++i) {
    sum.data()[i] = number.data()[i] > 0 ? sum.data()[i] / number.data()[i] : nan;
  }
  return sum;
}

/// Line i less line j, group by group.
std::array<double, groups> differences(const Plane<double>& means, int i, int j) {
  std::array<double, groups> out{};
  for (int g = 0; g < groups; ++g) out[static_cast<std::size_t>(g)] = means.at(g, i) - means.at(g, j);
  return out;
}

double line_difference(const Plane<double>& means, int i, int j) {
  std::array<double, groups> by_group = differences(means, i, j);
  return median_of(by_group);
}

/// Scatter of neighbouring lines of the same colours.
struct Scatter {
  double group_variance_e2 = 0;  // of one group's mean, about what its line has in common
  double line_variance_e2 = 0;   // of what a line has in common, as measured by medians: V + e^2
  double groups_used = 0;
};

/// @return nullopt where too few lines can be compared
std::optional<Scatter> scatter_of(const Plane<double>& means) {
  std::vector<double> within, between;
  within.reserve(means.size());
  between.reserve(static_cast<std::size_t>(means.height()));
  for (int line = 0; line + 2 < means.height(); ++line) {
    const std::array<double, groups> by_group = differences(means, line + 2, line);
    const double common = line_difference(means, line + 2, line);
    if (!std::isfinite(common)) continue;
    between.push_back(common);
    for (const double d : by_group) {
      if (std::isfinite(d)) within.push_back(d - common);
    }
  }
  if (2 * between.size() < static_cast<std::size_t>(means.height())) return std::nullopt;
  const auto used = static_cast<double>(within.size()) / static_cast<double>(between.size());
  if (used < fewest_pixels) return std::nullopt;
  const double inside = robust_std(within), across = robust_std(between);
  // Two lines are in each difference, and the groups' own centre has been taken off.
  return Scatter{inside * inside / 2 * used / (used - 1), across * across / 2, used};
}

tl::unexpected<Error> too_little(const Plane<double>& means, PlaneView<const float> pixels) {
  return fail(ErrorCode::insufficient,
              "line noise cannot be told from " + std::to_string(pixels.width) + " x " + std::to_string(pixels.height) +
                  " pixels: expected 16 lines of 4 finite values at least, found " + std::to_string(means.height()) +
                  " lines or too few values; use a larger area");
}

/// The means, and how they scatter; an error if that cannot be told.
struct Measured {
  Plane<double> means;
  Scatter scatter;
};

Result<Measured> measured(PlaneView<const float> pixels, Lines lines) {
  Plane<double> means = group_means(pixels, lines);
  if (means.height() < fewest_lines) return too_little(means, pixels);
  const auto scatter = scatter_of(means);
  if (!scatter) return too_little(means, pixels);
  return Measured{std::move(means), *scatter};
}

/// What all lines of a parity have in common in each group.
std::vector<double> common_of(const Plane<double>& means, int parity) {
  std::vector<double> out(groups), values;
  values.reserve(static_cast<std::size_t>(means.height()) / 2 + 1);
  for (int g = 0; g < groups; ++g) {
    values.clear();
    for (int line = parity; line < means.height(); line += 2) values.push_back(means.at(g, line));
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

/// Mean of d_ij over the neighbours that pass for the same scene, and the number of lines in it.
struct Comparison {
  double offset_e = 0;
  int lines = 1;
};

Comparison compared(const Plane<double>& means, int line, int reach, double bound_e) {
  const int room = std::min({reach, line / 2, (means.height() - 1 - line) / 2});  // even to both sides: slopes cancel
  Comparison out;
  double sum = 0;
  for (int k = -room; k <= room; ++k) {
    if (k == 0) continue;
    const double d = line_difference(means, line, line + 2 * k);
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
  out.offset_e.resize(static_cast<std::size_t>(of->means.height()));
  for (int line = 0; line < of->means.height(); ++line) {
    std::vector<double> values;
    values.reserve(groups);
    for (int g = 0; g < groups; ++g) {
      const double d = of->means.at(g, line) - common[line % 2][static_cast<std::size_t>(g)];
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
  out.gain = share(line_e2, line_e2 + error_e2);
  if (options.least_std_e > 0 && (out.line_std_e < options.least_std_e || out.gain < 0.5)) {
    out.residual_std_e = out.line_std_e;
    return out;
  }
  const double bound_e = 3 * std::sqrt(2 * (line_e2 + error_e2));
  double residual_e2 = 0;
  out.offset_e.reserve(static_cast<std::size_t>(of->means.height()));
  for (int line = 0; line < of->means.height(); ++line) {
    const Comparison with = compared(of->means, line, options.reach, bound_e);
    out.offset_e.push_back(out.gain * with.offset_e);
    residual_e2 += line_e2 * (1 - out.gain * (1 - 1.0 / with.lines));
  }
  out.residual_std_e = std::sqrt(residual_e2 / of->means.height());
  return out;
}

void subtract_lines(const LineOffsets& offsets, PlaneView<float> charge_e, int first) {
  const bool rows = offsets.lines == Lines::rows;
  assert(first >= 0 &&
         offsets.offset_e.size() >= static_cast<std::size_t>(first + (rows ? charge_e.height : charge_e.width)));
  for (int y = 0; y < charge_e.height; ++y) {
    for (int x = 0; x < charge_e.width; ++x) {
      charge_e.at(x, y) = static_cast<float>(
          charge_e.at(x, y) -
          offsets.offset_e[static_cast<std::size_t>(first) + static_cast<std::size_t>(rows ? y : x)]);
    }
  }
}

}  // namespace lowlux::denoise
