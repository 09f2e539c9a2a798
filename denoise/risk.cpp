#include "denoise/risk.h"

#include <cassert>
#include <cmath>
#include <cstddef>
#include <vector>

#include "isp/base/random.h"

namespace lowlux::denoise {
namespace {

/// n . (F(x + eps n) - F(x)) / eps, of one draw.
double probed_divergence(std::span<const double> noisy, std::span<const double> variance, const Filter& filter,
                         const std::vector<double>& filtered, const DrawStream& stream, double step) {
  std::vector<double> moved(noisy.begin(), noisy.end()), noise(noisy.size()), answer(noisy.size());
  for (std::size_t i = 0; i < noisy.size(); ++i) {
    const PhiloxWords words = words_at(stream, static_cast<std::uint32_t>(i), 0);
    noise[i] = std::sqrt(variance[i]) * normal_of_word(words[0]);
    moved[i] += step * noise[i];
  }
  filter(moved, answer);
  double sum = 0;
  for (std::size_t i = 0; i < noisy.size(); ++i) sum += noise[i] * (answer[i] - filtered[i]);
  return sum / step;
}

}  // namespace

Estimate estimated_risk(std::span<const double> noisy, std::span<const double> variance, const Filter& filter,
                        const RiskProbe& probe) {
  assert(!noisy.empty() && noisy.size() == variance.size() && probe.step > 0 && probe.draws >= 2);
  const auto count = static_cast<double>(noisy.size());
  std::vector<double> filtered(noisy.size());
  filter(noisy, filtered);
  double known = 0;  // what does not depend on the draws
  for (std::size_t i = 0; i < noisy.size(); ++i) {
    assert(variance[i] >= 0);
    known += (filtered[i] - noisy[i]) * (filtered[i] - noisy[i]) - variance[i];
  }
  double sum = 0, squares = 0;
  for (int draw = 0; draw < probe.draws; ++draw) {
    const DrawStream stream{probe.seed, static_cast<std::uint32_t>(draw), draw_purpose::risk_probe};
    const double term = 2 * probed_divergence(noisy, variance, filter, filtered, stream, probe.step) / count;
    sum += term;
    squares += term * term;
  }
  const double mean = sum / probe.draws;
  const double scatter = std::fmax(squares / probe.draws - mean * mean, 0.0);
  return {known / count + mean, std::sqrt(scatter / (probe.draws - 1))};
}

double poisson_gaussian_risk(std::span<const double> charge_e, double noise_std_e, const Filter& filter, double step) {
  assert(!charge_e.empty() && charge_e.size() <= 65536 && noise_std_e >= 0 && step > 0);
  std::vector<double> changed(charge_e.begin(), charge_e.end()), answer(charge_e.size());
  const auto answer_at = [&](std::size_t n, double value) {
    changed[n] = value;
    filter(changed, answer);
    return answer[n];
  };
  filter(charge_e, answer);
  double sum = 0;
  for (const double f : answer) sum += f * f;
  for (std::size_t n = 0; n < charge_e.size(); ++n) {
    const double y = charge_e[n], width = step * noise_std_e;
    sum += y * y - y - 2 * y * answer_at(n, y - 1);
    if (width > 0) {
      const double slope = (answer_at(n, y - 1 + width) - answer_at(n, y - 1 - width)) / (2 * width);
      sum += 2 * noise_std_e * noise_std_e * slope;
    }
    changed[n] = y;
  }
  return sum / static_cast<double>(charge_e.size()) - noise_std_e * noise_std_e;
}

}  // namespace lowlux::denoise
