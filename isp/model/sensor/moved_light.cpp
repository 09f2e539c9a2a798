#include "isp/model/sensor/moved_light.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace lowlux::isp {
namespace {

constexpr double once_in_a_million = 1e-6;
constexpr double many_counts = 16;  // from here on, counts of a channel are bounded by their standard deviation

/// Returns how many standard deviations a normal variable exceeds with a probability, 0 for a half and more: its tail
/// is less than exp(-z^2 / 2) / (z sqrt(2 pi)).
double normal_quantile(double probability) {
  if (probability >= 0.5) return 0;
  double z = 1;
  for (int i = 0; i < 4; ++i) {
    const double density = probability * std::max(1.0, z) * std::sqrt(2 * std::numbers::pi);
    z = std::sqrt(2 * std::log(std::max(1.0, 1 / density)));
  }
  return z;
}

/// Holds what one block in a million has: the counts or codes of a channel that change, and the sum of the noise of the
/// pixels in which they do, in standard deviations of one of these.
struct Counts {
  double expected = 0, most = 0, noise_sum = 0;
};

Counts counts_of(double fraction) {
  Counts out{channel_pixels * fraction};
  if (out.expected >= many_counts) {
    out.noise_sum = bound_sigmas * std::sqrt(out.expected);
    out.most = out.expected + out.noise_sum;
    return out;
  }
  out.most = count_in_block(fraction);
  double term = std::exp(-out.expected), at_least = 1;  // probabilities of n - 1 counts, and of n or more
  for (int n = 1; n <= out.most; ++n) {
    at_least = std::max(at_least - term, term * out.expected / n);
    term *= out.expected / n;
    out.noise_sum = std::max(out.noise_sum, std::sqrt(n) * normal_quantile(once_in_a_million / at_least));
  }
  return out;
}

}  // namespace

double count_change_variance_e2(double less_e, double more_e, double step_e) {
  const double d = more_e - less_e, counts = less_e > 0 ? std::min(d, 0.25 + d * d / (4 * less_e)) : d;
  return std::min(d * std::max(1.0, step_e), counts + step_e * step_e / 4);
}

double count_in_block(double fraction) {
  const double mean = fraction * channel_pixels;
  if (mean < once_in_a_million) return 0;
  double term = std::exp(-mean), sum = term;
  int count = 0;
  while (sum < 1 - once_in_a_million && count < channel_pixels) {
    ++count;
    term *= mean / count;
    sum += term;
  }
  return std::max(count, 1);
}

MovedChange moved_change(const MovedLight& moved, const Contrast& contrast, int c, const BlockNoise& noise) {
  const double variance = moved.count_variance_e2[c], n = noise.pixels;
  const double steady_e2 = std::max(0.0, noise.variance_e2 - noise.signal_e);  // noise but that of photons
  const double error = bound_sigmas / std::sqrt(n);
  const double unit_e = std::max(1.0, noise.step_e);  // least change of a pixel
  const Counts counts = counts_of(variance / (unit_e * unit_e));
  MovedChange out;
  out.scatter_e = unit_e * (counts.most - counts.expected) / channel_pixels;
  if (counts.expected < many_counts) {
    out.sigmas = std::min(bound_sigmas, normal_quantile(once_in_a_million / -std::expm1(-counts.expected)));
  }
  // Sums over the pixels: of their noise times what is added, and of noise and detail times the counts that change.
  const double by_added_e2 = 2 * error * std::sqrt(moved.variance_e2[c] * steady_e2 + moved.squares_by_signal_e3[c]);
  double by_counts_e2 = 0;
  if (variance > 0) {
    const double noise_e2 = steady_e2 + (moved.counts_by_signal_e3[c] + moved.counts_by_contrast_e4[c]) / variance;
    by_counts_e2 = 2 * unit_e * counts.noise_sum * std::sqrt(noise_e2 / (channel_pixels * n));
  }
  const double change_e2 = std::fabs(moved.more_contrast_e2[c]) + unit_e * out.scatter_e +
                           variance * error * std::numbers::sqrt2 + std::hypot(by_added_e2, by_counts_e2);
  const double detail = contrast.variance_e2[c];
  const double min_detail =
      std::max(0.0, detail - 2 * error * std::sqrt(detail * steady_e2 + contrast.by_signal_e3[c]));
  const double seen = noise.variance_e2 * (1 - error * std::numbers::sqrt2) + min_detail;
  out.relative_variance = change_e2 / std::max(seen, noise.floor_e2);
  return out;
}

}  // namespace lowlux::isp
