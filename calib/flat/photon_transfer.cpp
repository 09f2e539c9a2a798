#include "calib/flat/photon_transfer.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "calib/flat/transfer_curve.h"
#include "isp/base/sensor.h"

namespace lowlux::calib {
namespace {

constexpr double linearity_low = 0.05, linearity_high = 0.95;  // of saturation: EMVA 1288, section 6.7
constexpr double dithered_std_dn = 0.5;     // see denoise.md of the specification, and quantisation_bounds()
constexpr double gone_photon_noise = 0.02;  // remaining fraction where flats are saturated
constexpr double largest_gain_error = 0.05;
constexpr double half_saturation_width = 0.1;

using Points = std::vector<TransferPoint>;
using Pairs = std::span<const PairStatistics>;
using Darks = JoinedDarks;
using Curve = TransferCurve;

double relative_error(const Estimate& e) { return e.standard_error / e.value; }

Estimate scaled(double value_dn, double error_dn, const Estimate& gain) {
  const double value = value_dn / gain.value;
  return {value, std::hypot(error_dn / gain.value, value * relative_error(gain))};
}

/// Returns the root of a squared value that may be below 0 by noise: then 0, with an error that bounds its size.
Estimate root(double square, double error_of_square) {
  const double value = std::sqrt(std::max(0.0, square));
  return {value, error_of_square > 0 ? error_of_square / (2 * std::max(value, std::sqrt(error_of_square))) : 0};
}

void put_gains(const Curve& curve, const Darks& darks, const TransferLine& line, PhotonTransfer& out) {
  const double inflation = std::sqrt(std::max(1.0, out.reduced_chi_square));
  out.system_gain_dn_per_e = {line.gain_dn_per_e.value, inflation * line.gain_dn_per_e.standard_error};
  for (int site = 0; site < 4; ++site) {
    Points own;
    std::copy_if(curve.linear.begin(), curve.linear.end(), std::back_inserter(own),
                 [&](const TransferPoint& p) { return p.site == site; });
    const Estimate gain = fit_line(own, darks.scatter).gain_dn_per_e;
    out.gain_of_site_dn_per_e[site] = gain;
    const double off = (gain.value - line.gain_dn_per_e.value) / gain.standard_error;
    out.reduced_chi_square_of_sites += off * off / 3;
  }
}

void put_dark_noise(const Darks& darks, Pairs pairs, const TransferLine& line, PhotonTransfer& out) {
  const double gain = line.gain_dn_per_e.value, offset = line.offset_dn2.value;
  out.row_noise_e = std::sqrt(darks.scatter.row_variance_dn2) / gain;
  if (out.under_dithered || !(offset > 0)) return;
  const double noise = std::sqrt(offset) / gain;
  const double by_offset = line.offset_dn2.standard_error / (2 * offset), by_gain = relative_error(line.gain_dn_per_e);
  const double error2 = by_offset * by_offset + by_gain * by_gain - line.covariance / (offset * gain);
  const double inflation = std::sqrt(std::max(1.0, out.reduced_chi_square));
  out.read_noise_e = Estimate{noise, inflation * noise * std::sqrt(std::max(0.0, error2))};
  double spatial = 0, pixels = 0;
  for (int site = 0; site < 4; ++site) {
    spatial += darks.spatial_dn2[site] / 4;
    pixels += static_cast<double>(pairs.front().site[site].pixels);
  }
  // Noise is independent between pairs, the pixels are the same.
  const double kept = std::max(0.0, spatial), total = darks.variance_dn2 + kept;
  const double error = std::sqrt(((total * total - kept * kept) / darks.scatter.pairs + 2 * kept * kept) / pixels);
  const Estimate dsnu_dn = root(spatial, error);
  out.dsnu_e = scaled(dsnu_dn.value, dsnu_dn.standard_error, out.system_gain_dn_per_e);
}

void put_black(const Darks& darks, Pairs pairs, PhotonTransfer& out) {
  out.black_dn = darks.mean_dn;
  const double frames = 2 * darks.scatter.pairs;
  for (int site = 0; site < 4; ++site) {
    const SiteStatistics& s = pairs.front().site[site];
    const auto pixels = static_cast<double>(s.pixels);
    const double spatial = std::max(0.0, darks.spatial_dn2[site]);
    const double of_columns = std::clamp(darks.column_dn2[site], 0.0, spatial);
    const double of_pixels = darks.variance_dn2 / frames + spatial - of_columns;
    out.black_standard_error_dn[site] = std::sqrt(of_pixels / pixels + of_columns * s.rows / pixels +
                                                  darks.scatter.row_variance_dn2 / (frames * s.rows));
  }
}

void put_prnu(const Curve& curve, Pairs pairs, const Darks& darks, PhotonTransfer& out) {
  double weights = 0, sum = 0, variance = 0;
  for (int site = 0; site < 4; ++site) {
    const double half = curve.peak[site].signal_dn / 2;
    double nearest = std::numeric_limits<double>::infinity();
    for (const TransferPoint& p : curve.flats) {
      if (p.site == site) nearest = std::min(nearest, std::fabs(p.signal_dn - half));
    }
    double of_pattern = 0;
    for (const TransferPoint& p : curve.flats) {
      if (p.site != site || std::fabs(p.signal_dn - half) > nearest + half_saturation_width * half) continue;
      const double signal2 = p.signal_dn * p.signal_dn;
      const double spatial = pairs[p.pair].site[site].covariance_dn2, kept = std::max(0.0, spatial);
      const double total = p.variance_dn2 + quantisation_dn2 + kept;
      const double weight = signal2 * signal2 * p.pixels / (total * total + kept * kept);
      weights += weight;
      of_pattern += weight * kept / signal2 * std::sqrt(2 / p.pixels);
      sum += weight * (spatial - darks.spatial_dn2[site]) / signal2;
      // Noise is independent between pairs, the pixels are the same.
      variance += weight * (total * total - kept * kept) / (total * total + kept * kept);
    }
    variance += of_pattern * of_pattern;
  }
  out.prnu = root(sum / weights, std::sqrt(variance) / weights);
}

void put_saturation(const Curve& curve, Pairs pairs, const Darks& darks, PhotonTransfer& out) {
  const double gain = out.system_gain_dn_per_e.value;
  double peaks = 0, peak_dn = 0, step_dn = 0, full = 0, full_dn = 0, at_white = 0, error2 = 0;
  for (int site = 0; site < 4; ++site) {
    if (!curve.peak[site].reached) continue;
    ++peaks;
    peak_dn += curve.peak[site].signal_dn;
    step_dn += curve.peak[site].fallen_dn - curve.peak[site].signal_dn;
    for (const TransferPoint& p : curve.flats) {
      const double photon_noise = p.variance_dn2 - darks.scatter.dark_variance_dn2;
      if (p.site != site || !(p.signal_dn >= curve.peak[site].signal_dn)) continue;
      if (photon_noise > gone_photon_noise * gain * p.signal_dn) continue;
      ++full;
      full_dn += p.signal_dn;
      at_white += pairs[p.pair].site[site].fraction_at_white;
      error2 += (p.variance_dn2 + quantisation_dn2) / p.pixels;
    }
  }
  if (peaks == 0) return;
  // The variance is largest somewhere between the two levels; they are those of all sites.
  const double step_error_dn = step_dn / peaks / std::sqrt(3.0);
  out.saturation_capacity_e = scaled(peak_dn / peaks, step_error_dn, out.system_gain_dn_per_e);
  if (full == 0) return;
  // Codes that do not scatter may all have the same offset: at most half a code for each of the two means.
  const double undithered_dn = out.under_dithered ? 1 / std::sqrt(6.0) : 0;
  out.saturation =
      Saturation{scaled(full_dn / full, std::hypot(std::sqrt(error2) / full, undithered_dn), out.system_gain_dn_per_e),
                 at_white / full > 0.5 ? Saturation::LimitedBy::converter : Saturation::LimitedBy::full_well};
}

/// Fits a line of signal against exposure time that minimises the squared relative deviations.
std::optional<double> deviation_of_site(const Curve& curve, Pairs pairs, int site) {
  std::vector<std::pair<double, double>> points;
  for (const TransferPoint& p : curve.flats) {
    const auto& time = pairs[p.pair].setting.exposure_s;
    const double share = p.signal_dn / curve.peak[site].signal_dn;
    if (p.site == site && time && share >= linearity_low && share <= linearity_high) {
      points.emplace_back(*time, p.signal_dn);
    }
  }
  if (points.size() < 3) return std::nullopt;
  double w = 0, wx = 0, wy = 0, wxx = 0, wxy = 0;
  for (const auto& [x, y] : points) {
    const double weight = 1 / (y * y);
    w += weight;
    wx += weight * x;
    wy += weight * y;
    wxx += weight * x * x;
    wxy += weight * x * y;
  }
  const double spread = w * wxx - wx * wx;
  if (!(spread > 1e-9 * w * wxx)) return std::nullopt;  // all of one time: the line is undetermined
  const double slope = (w * wxy - wx * wy) / spread, offset = (wy - slope * wx) / w;
  double sum = 0;
  for (const auto& [x, y] : points) sum += std::fabs(y / (offset + slope * x) - 1);
  return sum / static_cast<double>(points.size());
}

void put_linearity(const Curve& curve, Pairs pairs, PhotonTransfer& out) {
  double sum = 0;
  for (int site = 0; site < 4; ++site) {
    const auto deviation = deviation_of_site(curve, pairs, site);
    if (!deviation) return;
    sum += *deviation / 4;
  }
  out.linearity_error = sum;
}

}  // namespace

Result<PhotonTransfer> fit_photon_transfer(Pairs dark_pairs, Pairs flat_pairs, const PhotonTransferOptions& options) {
  const auto joined = join_darks(dark_pairs);
  if (!joined) return tl::make_unexpected(joined.error());
  const Darks& darks = *joined;
  PhotonTransfer out;
  out.under_dithered = darks.scatter.dark_variance_dn2 < dithered_std_dn * dithered_std_dn;
  const auto curve = curve_of(dark_pairs, flat_pairs, darks, out.under_dithered);
  if (!curve) return tl::make_unexpected(curve.error());
  const TransferLine line = fit_line(curve->linear, darks.scatter);
  put_black(darks, dark_pairs, out);
  out.levels = curve->levels;
  out.degrees_of_freedom = line.degrees_of_freedom;
  out.reduced_chi_square = line.chi_square / line.degrees_of_freedom;
  put_gains(*curve, darks, line, out);
  const Estimate& gain = out.system_gain_dn_per_e;
  if (!(gain.value > 0) || gain.standard_error > largest_gain_error * gain.value) {
    return fail(ErrorCode::insufficient,
                fmt::format("the variance of the flats does not rise with their mean as photon noise does: {:.3g} +- "
                            "{:.2g} DN/e- (reduced chi square {:.3g}); are these raw, unprocessed frames?",
                            gain.value, gain.standard_error, out.reduced_chi_square));
  }
  put_dark_noise(darks, dark_pairs, line, out);
  put_prnu(*curve, flat_pairs, darks, out);
  put_saturation(*curve, flat_pairs, darks, out);
  if (options.steady_light) put_linearity(*curve, flat_pairs, out);
  return out;
}

}  // namespace lowlux::calib
