#include "isp/bench/peers/gat_denoise.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <cstddef>
#include <limits>
#include <numbers>

namespace lowlux::isp {
namespace {

constexpr double scale = 3e4;                 // its square, the variance, is within denoise::largest_e
constexpr double fine_q = 3, middle_q = 0.7;  // denoise/README.md, chroma start

int chroma_start(const DenoiseLight& light) {
  const double variance_e2 = light.mean_e + light.dark_e + light.read_noise_e * light.read_noise_e;
  const double q = light.mean_e / std::sqrt(variance_e2);
  if (q > fine_q) return 0;
  return q > middle_q ? 1 : 2;
}

}  // namespace

void gat_denoise(denoise::Denoiser& denoiser, const DenoiseShot& shot, denoise::Level level,
                 const std::array<double, 3>& white_gain, PlaneView<float> signal_e, Executor& executor) {
  const double noise_std_e = shot.light.read_noise_e;
  const denoise::GatTable table = denoise::gat_table(noise_std_e);
  Plane<float> stabilised(shot.raw_e.width(), shot.raw_e.height());
  for (std::size_t i = 0; i < stabilised.size(); ++i) {
    stabilised.data()[i] =
        static_cast<float>(scale * denoise::gat_forward(static_cast<double>(shot.raw_e.data()[i]), noise_std_e));
  }
  constexpr double variance = scale * scale;
  denoiser.run({stabilised.view(), BayerPhase::rggb}, {.variance_e2 = {variance, variance, variance}},
               {.level = level,
                .white_gain = white_gain,
                .rho = std::numeric_limits<double>::infinity(),
                .chroma_start = chroma_start(shot.light)},
               signal_e, {}, executor);
  for (int y = 0; y < signal_e.height; ++y) {
    float* const row = signal_e.row(y);
    for (int x = 0; x < signal_e.width; ++x) {
      const double total_e = denoise::gat_inverse_exact(table, static_cast<double>(row[x]) / scale);
      row[x] = static_cast<float>(total_e - shot.light.dark_e);
    }
  }
}

}  // namespace lowlux::isp

namespace lowlux::denoise {
namespace {

constexpr double asymptotic_variance_e2 = 300;  // lambda + sigma^2 from which on the first order is used
constexpr double smallest_mean_e = 1e-4;        // first node of the table after 0
constexpr int places = 400;
constexpr double counting_noise_e = 1e-6;  // below it f(j + sigma x) differs from f(j) by less than 1e-11 in the mean

double log_factorial(double n) {
  int sign = 0;  // sign of the gamma function, which the thread-safe lgamma_r returns
  return ::lgamma_r(n + 1, &sign);
}

/// Returns the mean of f(j + sigma x) over a standard normal x. The root's edge causes no error in t = f / 2, where the
/// integrand 4 t^2 phi((t^2 - j - 3/8 - sigma^2) / sigma) / sigma is smooth and even, so that the trapezium rule
/// converges exponentially.
double mean_for_count(int count, double noise) {
  const double centre = count + 0.375 + noise * noise;
  if (noise < counting_noise_e) return 2 * std::sqrt(centre);
  const double begin = std::sqrt(std::max(centre - 9.5 * noise, 0.0)), end = std::sqrt(centre + 9.5 * noise);
  const double step = noise / (4 * std::sqrt(centre));  // half a standard deviation of t
  const auto steps = static_cast<int>(std::ceil((end - begin) / step));
  double sum = 0;  // the first node, t = 0, has half weight, but the integrand is 0 there
  for (int i = 0; i <= steps; ++i) {
    const double t = begin + i * step;
    const double z = (t * t - centre) / noise;
    sum += t * t * std::exp(-0.5 * z * z);
  }
  return 4 * sum * step / (noise * std::sqrt(2 * std::numbers::pi));
}

/// Returns mean_for_count of 0, 1, ... up to the counts that means below asymptotic_variance_e2 reach.
std::vector<double> means_for_counts(double noise, double largest_mean) {
  const int last = static_cast<int>(std::ceil(largest_mean + 9 * std::sqrt(largest_mean) + 20));
  std::vector<double> out(static_cast<std::size_t>(last) + 1);
  for (int j = 0; j <= last; ++j) out[static_cast<std::size_t>(j)] = mean_for_count(j, noise);
  return out;
}

/// Holds E[f] and its derivative by lambda, sum of Pois(j) (m_j+1 - m_j).
struct MeanAndSlope {
  double mean, slope;
};

MeanAndSlope poisson_mean_of(const std::vector<double>& for_count, double lambda) {
  if (lambda == 0) return {for_count[0], for_count[1] - for_count[0]};
  MeanAndSlope out{0, 0};
  for (std::size_t j = 0; j + 1 < for_count.size(); ++j) {
    const auto n = static_cast<double>(j);
    const double probability = std::exp(n * std::log(lambda) - lambda - log_factorial(n));
    out.mean += probability * for_count[j];
    out.slope += probability * (for_count[j + 1] - for_count[j]);
  }
  return out;
}

double asymptotic_mean_e(double stabilised, double noise) {
  return stabilised * stabilised / 4 - 0.125 - noise * noise;
}

/// Limits slopes to three secants, so that a cubic is monotone (Fritsch & Carlson, SIAM J. Numer. Anal. 17 (1980) 238).
void limit_slopes(GatTable& table) {
  for (std::size_t i = 0; i + 1 < table.mean_e.size(); ++i) {
    const double secant = (table.mean_e[i + 1] - table.mean_e[i]) / (table.stabilised[i + 1] - table.stabilised[i]);
    table.slope_e[i] = std::min(table.slope_e[i], 3 * secant);
    table.slope_e[i + 1] = std::min(table.slope_e[i + 1], 3 * secant);
  }
}

}  // namespace

double gat_forward(double charge_e, double noise_std_e) {
  assert(noise_std_e >= 0);
  return 2 * std::sqrt(std::max(charge_e + 0.375 + noise_std_e * noise_std_e, 0.0));
}

double gat_mean(double poisson_mean_e, double noise_std_e) {
  assert(poisson_mean_e >= 0 && noise_std_e >= 0);
  const double variance = poisson_mean_e + noise_std_e * noise_std_e;
  if (variance >= asymptotic_variance_e2) return 2 * std::sqrt(variance + 0.125);
  return poisson_mean_of(means_for_counts(noise_std_e, poisson_mean_e), poisson_mean_e).mean;
}

double gat_inverse_asymptotic(double stabilised, double noise_std_e) {
  if (!(stabilised > 0)) return 0;
  return std::max(asymptotic_mean_e(stabilised, noise_std_e), 0.0);
}

double gat_inverse_closed_form(double stabilised, double noise_std_e) {
  const double d = stabilised, root = std::sqrt(1.5);
  if (!(d >= root)) return 0;  // 2 sqrt(3/8)
  const double correction = root / (4 * d) - 11 / (8 * d * d) + 5 * root / (8 * d * d * d);
  return std::max(asymptotic_mean_e(d, noise_std_e) + correction, 0.0);
}

GatTable gat_table(double noise_std_e) {
  assert(noise_std_e >= 0 && std::isfinite(noise_std_e));
  GatTable table;
  table.noise_std_e = noise_std_e;
  const double largest = asymptotic_variance_e2 - noise_std_e * noise_std_e;
  if (largest < 1) return table;  // so that a last node that is 4e-4 e- off stays above the one before
  const std::vector<double> for_count = means_for_counts(noise_std_e, largest);
  const double ratio = std::pow(largest / smallest_mean_e, 1.0 / (places - 1));
  table.stabilised.reserve(places + 1);
  table.mean_e.reserve(places + 1);
  table.slope_e.reserve(places + 1);
  for (int i = 0; i <= places; ++i) {
    const double lambda = i == 0 ? 0 : smallest_mean_e * std::pow(ratio, i - 1);
    const MeanAndSlope at = poisson_mean_of(for_count, lambda);
    // The last node lies on the asymptotic form, so that there is no step where that begins.
    table.stabilised.push_back(at.mean);
    table.mean_e.push_back(i < places ? lambda : asymptotic_mean_e(at.mean, noise_std_e));
    table.slope_e.push_back(1 / at.slope);
  }
  limit_slopes(table);
  return table;
}

double gat_inverse_exact(const GatTable& table, double stabilised) {
  const std::vector<double>& d = table.stabilised;
  if (d.empty() || stabilised >= d.back()) return gat_inverse_asymptotic(stabilised, table.noise_std_e);
  if (!(stabilised > d.front())) return 0;
  const auto i = static_cast<std::size_t>(std::upper_bound(d.begin(), d.end(), stabilised) - d.begin()) - 1;
  const double width = d[i + 1] - d[i], t = (stabilised - d[i]) / width, s = 1 - t;
  return s * s * (1 + 2 * t) * table.mean_e[i] + t * t * (3 - 2 * t) * table.mean_e[i + 1] +
         t * s * width * (s * table.slope_e[i] - t * table.slope_e[i + 1]);
}

}  // namespace lowlux::denoise
