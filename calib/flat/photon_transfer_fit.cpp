#include "calib/flat/photon_transfer_fit.h"

#include <algorithm>
#include <cassert>
#include <cmath>

#include "isp/base/sensor.h"

namespace lowlux::calib {
namespace {

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
