#include "isp/metrics/ssim.h"

#include <array>
#include <cassert>
#include <cmath>
#include <numeric>
#include <vector>

namespace lowlux::isp {
namespace {

constexpr double c1 = 0.01 * 0.01, c2 = 0.03 * 0.03;
constexpr double sigma_px = 1.5;

using Window = std::array<double, ssim_window_px>;

Window gaussian() {
  constexpr int middle = ssim_window_px / 2;
  Window w{};
  for (int i = 0; i < ssim_window_px; ++i) {
    const double z = (i - middle) / sigma_px;
    w[static_cast<std::size_t>(i)] = std::exp(-z * z / 2);
  }
  const double sum = std::accumulate(w.begin(), w.end(), 0.0);
  for (double& v : w) v /= sum;
  return w;
}

/// Holds weighted means over a window, or over one of its columns.
struct Moments {
  double a = 0, b = 0, aa = 0, bb = 0, ab = 0;

  void add(double weight, const Moments& m) {
    a += weight * m.a;
    b += weight * m.b;
    aa += weight * m.aa;
    bb += weight * m.bb;
    ab += weight * m.ab;
  }
};

double similarity(const Moments& m) {
  const double variance_a = m.aa - m.a * m.a, variance_b = m.bb - m.b * m.b, covariance = m.ab - m.a * m.b;
  return (2 * m.a * m.b + c1) * (2 * covariance + c2) / ((m.a * m.a + m.b * m.b + c1) * (variance_a + variance_b + c2));
}

struct Planes {
  PlaneView<const float> first;
  PlaneView<const float> second;
  Window weight;
};

/// Returns the sum over the windows whose upper row is y. `columns` has as many elements as the planes have columns.
double row_sum(const Planes& planes, int y, std::vector<Moments>& columns) {
  for (std::size_t x = 0; x < columns.size(); ++x) {
    columns[x] = {};
    for (int i = 0; i < ssim_window_px; ++i) {
      const auto a = static_cast<double>(planes.first.at(static_cast<int>(x), y + i));
      const auto b = static_cast<double>(planes.second.at(static_cast<int>(x), y + i));
      columns[x].add(planes.weight[static_cast<std::size_t>(i)], {a, b, a * a, b * b, a * b});
    }
  }
  double sum = 0;
  for (std::size_t x = 0; x + ssim_window_px <= columns.size(); ++x) {
    Moments whole;
    for (std::size_t i = 0; i < ssim_window_px; ++i) whole.add(planes.weight[i], columns[x + i]);
    sum += similarity(whole);
  }
  return sum;
}

}  // namespace

std::optional<double> ssim(const PlaneView<const float>& first, const PlaneView<const float>& second,
                           Executor& executor) {
  assert(first.width == second.width && first.height == second.height);
  const int across = first.width - ssim_window_px + 1, down = first.height - ssim_window_px + 1;
  if (across < 1 || down < 1) return std::nullopt;
  const Planes planes{first, second, gaussian()};
  // The memory is allocated before the threads start, because they cannot report an allocation failure.
  std::vector<std::vector<Moments>> columns(static_cast<std::size_t>(executor.width()),
                                            std::vector<Moments>(static_cast<std::size_t>(first.width)));
  std::vector<double> rows(static_cast<std::size_t>(down));
  for_each_band(executor, down, [&](RowBand band, int index) {
    for (int y = band.first; y < band.last; ++y) {
      rows[static_cast<std::size_t>(y)] = row_sum(planes, y, columns[static_cast<std::size_t>(index)]);
    }
  });
  return std::accumulate(rows.begin(), rows.end(), 0.0) / (static_cast<double>(across) * down);
}

}  // namespace lowlux::isp
