#include "calib/flat/transfer_curve.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <utility>

#include <fmt/format.h>

#include "isp/base/sensor.h"

namespace lowlux::calib {
namespace {

constexpr double linear_fraction = 0.7;    // of saturation: EMVA 1288, section 6.6
constexpr double largest_drift = 0.01;     // of the signal
constexpr double clipped_fraction = 1e-3;  // clipping 0.1 % of a normal distribution reduces its variance by 0.7 %
constexpr double fallen_variance = 0.8;    // of the largest: more than a variance from 1000 pixels scatters
constexpr double same_level = 1.05;        // ratio of signals below which two pairs are one level
constexpr int fewest_levels = 4;
constexpr int fewest_pixels = 1000;  // of a site: variances then scatter by 4.5 %
constexpr double dithered_variance_dn2 = 0.25;

using Points = std::vector<TransferPoint>;
using Pairs = std::span<const PairStatistics>;

Result<void> check_darks(Pairs darks) {
  if (darks.empty()) {
    return fail(ErrorCode::insufficient,
                "there are no darks; the photon transfer method needs two frames with the lens covered");
  }
  for (std::size_t i = 0; i < darks.size(); ++i) {
    const auto what = fmt::format("pair {} of the darks", i + 1);
    if (auto same = check_same_setting(darks.front().setting, darks[i].setting, what); !same) return same;
    for (const SiteStatistics& s : darks[i].site) {
      if (s.pixels < fewest_pixels) {
        return fail(ErrorCode::insufficient,
                    fmt::format("a CFA site has {} pixels, photon transfer needs {}; use a larger "
                                "part of the frame",
                                s.pixels, fewest_pixels));
      }
      if (s.fraction_at_zero <= clipped_fraction) continue;
      return fail(ErrorCode::insufficient,
                  fmt::format("{:.3g} % of the samples of {} are at code 0, so their noise is cut off; raise the "
                              "camera's black level (offset)",
                              100 * s.fraction_at_zero, what));
    }
  }
  return {};
}

Result<void> check_drift(const SiteStatistics& s, double signal_dn, int pair, double row_variance_dn2) {
  const double error2 = 2 * s.variance_dn2 / static_cast<double>(s.pixels) + 2 * row_variance_dn2 / s.rows;
  if (std::fabs(s.drift_dn) > largest_drift * signal_dn && std::fabs(s.drift_dn) > 5 * std::sqrt(error2)) {
    return fail(
        ErrorCode::invalid_argument,
        fmt::format("the light of pair {} of the flats drifts by {:.2g} % between its frames, at most {:g} % is "
                    "allowed; let the lamp warm up or expose for whole periods of its flicker",
                    pair + 1, 100 * s.drift_dn / signal_dn, 100 * largest_drift));
  }
  return {};
}

Result<Points> points_of(Pairs pairs, const JoinedDarks& darks, bool are_flats) {
  Points out;
  for (int i = 0; i < static_cast<int>(pairs.size()); ++i) {
    for (int site = 0; site < 4; ++site) {
      const SiteStatistics& s = pairs[i].site[site];
      const double signal = are_flats ? s.mean_dn - darks.mean_dn[site] : 0;
      if (are_flats) {
        if (!(signal > 0)) {
          return fail(ErrorCode::invalid_argument,
                      fmt::format("pair {} of the flats is not brighter than the darks ({:.4g} DN against {:.4g} DN)",
                                  i + 1, s.mean_dn, darks.mean_dn[site]));
        }
        auto steady = check_drift(s, signal, i, darks.scatter.row_variance_dn2);
        if (!steady) return tl::make_unexpected(steady.error());
      }
      out.push_back({site, are_flats ? i : -1, signal, s.variance_dn2 - quantisation_dn2, static_cast<double>(s.pixels),
                     static_cast<double>(s.rows)});
    }
  }
  return out;
}

TransferPeak peak_of(const Points& flats, Pairs pairs, int site) {
  TransferPeak peak;
  double largest = -std::numeric_limits<double>::infinity();
  for (const TransferPoint& p : flats) {
    if (p.site != site || p.variance_dn2 <= largest) continue;
    largest = p.variance_dn2;
    peak.signal_dn = p.signal_dn;
  }
  double brightest = 0, fallen_dn = std::numeric_limits<double>::infinity();
  for (const TransferPoint& p : flats) {
    if (p.site != site) continue;
    brightest = std::max(brightest, p.signal_dn);
    const bool fallen = p.signal_dn > peak.signal_dn && p.variance_dn2 < fallen_variance * largest;
    if (fallen) fallen_dn = std::min(fallen_dn, p.signal_dn);
    peak.reached |= fallen || pairs[p.pair].site[site].fraction_at_white > clipped_fraction;
  }
  if (!peak.reached) peak.signal_dn = brightest;
  peak.fallen_dn = std::min(fallen_dn, brightest);
  return peak;
}

/// Returns the signal at which the linear range of each site ends. Sites have the same well and converter: one that did
/// not reach its peak, whose brightest flats may be just below saturation, has the limit of the lowest peak.
PerSite<double> linear_limits(const PerSite<TransferPeak>& peaks) {
  double lowest = std::numeric_limits<double>::infinity();
  for (const TransferPeak& peak : peaks) {
    if (peak.reached) lowest = std::min(lowest, peak.signal_dn);
  }
  PerSite<double> limits{};
  for (std::size_t site = 0; site < limits.size(); ++site) {
    limits[site] = linear_fraction * (peaks[site].reached ? peaks[site].signal_dn : lowest);
  }
  return limits;
}

int count_levels(const Points& points, int site) {
  std::vector<double> signals;
  for (const TransferPoint& p : points) {
    if (p.site == site && p.pair >= 0) signals.push_back(p.signal_dn);
  }
  std::sort(signals.begin(), signals.end());
  int levels = 0;
  double last = 0;
  for (const double signal : signals) {
    if (signal <= same_level * last) continue;
    ++levels;
    last = signal;
  }
  return levels;
}

constexpr int iterations = 6;  // the weights hardly depend on the line: the third changes nothing in 12 digits

double variance_of(const TransferPoint& p, const TransferLine& line, const DarkScatter& s) {
  const double gain2 = line.gain_dn_per_e.value * line.gain_dn_per_e.value;
  const double v = std::max(line.offset_dn2.value + line.gain_dn_per_e.value * p.signal_dn, 0.0) + quantisation_dn2;
  const double row2 = s.row_variance_dn2;
  double out = (2 * v * v + gain2 * s.dark_variance_dn2 / 2) / p.pixels + 4 * row2 * row2 / p.rows;
  if (p.pair >= 0) {
    out += gain2 * s.dark_variance_dn2 / (2 * p.pixels * s.pairs);
    out += gain2 * row2 * (1 + 1 / s.pairs) / (2 * p.rows);
  }
  return out;
}

TransferLine solve(std::span<const TransferPoint> points, const TransferLine& before, const DarkScatter& scatter) {
  double w = 0, wx = 0, wy = 0;
  for (const TransferPoint& p : points) {
    const double weight = 1 / variance_of(p, before, scatter);
    w += weight;
    wx += weight * p.signal_dn;
    wy += weight * p.variance_dn2;
  }
  const double mean_x = wx / w, mean_y = wy / w;
  double xx = 0, xy = 0;
  for (const TransferPoint& p : points) {
    const double weight = 1 / variance_of(p, before, scatter);
    xx += weight * (p.signal_dn - mean_x) * (p.signal_dn - mean_x);
    xy += weight * (p.signal_dn - mean_x) * (p.variance_dn2 - mean_y);
  }
  TransferLine out;
  out.gain_dn_per_e = {xy / xx, std::sqrt(1 / xx)};
  out.offset_dn2 = {mean_y - out.gain_dn_per_e.value * mean_x, std::sqrt(1 / w + mean_x * mean_x / xx)};
  out.covariance = -mean_x / xx;
  for (const TransferPoint& p : points) {
    const double residual = p.variance_dn2 - out.offset_dn2.value - out.gain_dn_per_e.value * p.signal_dn;
    out.chi_square += residual * residual / variance_of(p, before, scatter);
  }
  out.degrees_of_freedom = static_cast<int>(points.size()) - 2;
  return out;
}

}  // namespace

Result<JoinedDarks> join_darks(Pairs darks) {
  if (auto good = check_darks(darks); !good) return tl::make_unexpected(good.error());
  JoinedDarks out;
  out.scatter.pairs = static_cast<double>(darks.size());
  const double share = 1 / out.scatter.pairs;
  for (const PairStatistics& pair : darks) {
    for (int site = 0; site < 4; ++site) {
      const SiteStatistics& s = pair.site[site];
      out.mean_dn[site] += share * s.mean_dn;
      out.spatial_dn2[site] += share * s.covariance_dn2;
      out.column_dn2[site] += share * s.column_covariance_dn2;
      out.variance_dn2 += share * s.variance_dn2 / 4;
      out.scatter.row_variance_dn2 += share * s.row_variance_dn2 / 4;
    }
  }
  out.scatter.row_variance_dn2 = std::max(0.0, out.scatter.row_variance_dn2);
  out.scatter.dark_variance_dn2 = std::max(0.0, out.variance_dn2 - quantisation_dn2);
  return out;
}

Result<TransferCurve> curve_of(Pairs dark_pairs, Pairs flats, const JoinedDarks& darks, bool under_dithered) {
  TransferCurve out;
  for (std::size_t i = 0; i < flats.size(); ++i) {
    const auto what = fmt::format("pair {} of the flats", i + 1);
    const auto same = check_same_camera(dark_pairs.front().setting, flats[i].setting, what);
    if (!same) return tl::make_unexpected(same.error());
  }
  auto points = points_of(flats, darks, true);
  if (!points) return tl::make_unexpected(points.error());
  out.flats = std::move(*points);
  for (int site = 0; site < 4; ++site) out.peak[site] = peak_of(out.flats, flats, site);
  const PerSite<double> limits = linear_limits(out.peak);
  for (const TransferPoint& p : out.flats) {
    if (p.signal_dn <= limits[p.site] && !(under_dithered && p.variance_dn2 < dithered_variance_dn2))
      out.linear.push_back(p);
  }
  for (int site = 0; site < 4; ++site) out.levels = std::min(out.levels, count_levels(out.linear, site));
  if (out.levels < fewest_levels) {
    return fail(ErrorCode::insufficient,
                fmt::format("the flats hold {} levels of light in the linear range, up to {:g} % of saturation; photon "
                            "transfer needs {} that differ by 5 % or more; add darker flats",
                            out.levels, 100 * linear_fraction, fewest_levels));
  }
  if (under_dithered) return out;
  const auto dark_points = points_of(dark_pairs, darks, false);
  if (!dark_points) return tl::make_unexpected(dark_points.error());
  out.linear.insert(out.linear.end(), dark_points->begin(), dark_points->end());
  return out;
}

TransferLine fit_line(std::span<const TransferPoint> points, const DarkScatter& scatter) {
  assert(points.size() >= 3);
  const auto by_signal = [](const TransferPoint& a, const TransferPoint& b) { return a.signal_dn < b.signal_dn; };
  const auto [low, high] = std::minmax_element(points.begin(), points.end(), by_signal);
  assert(low->signal_dn < high->signal_dn);
  TransferLine line;
  line.gain_dn_per_e.value = std::max(high->variance_dn2, quantisation_dn2) / (high->signal_dn - low->signal_dn);
  line.offset_dn2.value = scatter.dark_variance_dn2;
  for (int i = 0; i < iterations; ++i) line = solve(points, line, scatter);
  return line;
}

}  // namespace lowlux::calib
