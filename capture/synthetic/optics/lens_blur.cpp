#include "capture/synthetic/optics/lens_blur.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <cstddef>
#include <utility>

namespace lowlux::capture {
namespace {

constexpr double left_out = 1e-7;  // sum of the kernel on both sides beyond its last sample

/// Returns the sample of a row of `count` that its mirror images have at any position.
int mirrored(int at, int count) {
  const int period = 2 * count, within = ((at % period) + period) % period;
  return within < count ? within : period - 1 - within;
}

/// Returns exp(-t) I_n(t) for n = 0, 1... by Miller's algorithm: I_(n-1) = I_(n+1) + (2 n / t) I_n downward from an
/// order at which I_n is negligible, divided by I_0 + 2 (I_1 + I_2 + ...), which is exp(t).
std::vector<double> discrete_gaussian(double t) {
  const auto last = static_cast<std::size_t>(20 + 12 * std::sqrt(t));
  std::vector<double> out(last + 1);
  double above = 0, here = 1e-300, sum = 0;
  for (std::size_t n = last; n > 0; --n) {
    out[n] = here;
    sum += 2 * here;
    const double below = above + 2 * static_cast<double>(n) / t * here;
    above = here;
    here = below;
    if (here > 1e200) {  // only the ratios count
      for (std::size_t i = n; i <= last; ++i) out[i] *= 1e-250;
      above *= 1e-250;
      here *= 1e-250;
      sum *= 1e-250;
    }
  }
  out[0] = here;
  sum += here;
  for (double& value : out) value /= sum;
  return out;
}

}  // namespace

LensBlur::LensBlur(double sigma_px) : kernel_{1} {
  assert(sigma_px >= 0 && sigma_px <= max_lens_blur_px);
  const double t = sigma_px * sigma_px;
  if (t < left_out) return;  // 1 - T(0) is less than t
  kernel_ = discrete_gaussian(t);
  double beyond = 0;
  while (kernel_.size() > 1 && beyond + 2 * kernel_.back() < left_out) {
    beyond += 2 * kernel_.back();
    kernel_.pop_back();
  }
  kernel_[0] += beyond;
  weights_.assign(kernel_.begin() + 1, kernel_.end());
}

void LensBlur::apply(Plane<float>& plane, Executor& executor) const {
  if (weights_.empty()) return;
  Plane<float> out(plane.width(), plane.height());
  for_each_band(executor, plane.height(), [&](RowBand band, int) { blur_rows(plane.view(), band); });
  for_each_band(executor, plane.height(),
                [&](RowBand band, int) { blur_columns(std::as_const(plane).view(), out.view(), band); });
  plane = std::move(out);
}

// Both passes add T(n) (in(x - n) - in(x) + in(x + n) - in(x)) to in(x): even light is kept to the bit.

void LensBlur::blur_rows(PlaneView<float> plane, RowBand band) const {
  const int reach = static_cast<int>(weights_.size()), width = plane.width;
  std::vector<float> padded(static_cast<std::size_t>(width) + 2 * weights_.size());
  float* const own = padded.data() + reach;
  for (int y = band.first; y < band.last; ++y) {
    float* row = plane.row(y);
    for (int i = 0; i < reach; ++i) {
      own[i - reach] = row[mirrored(i - reach, width)];
      own[width + i] = row[mirrored(width + i, width)];
    }
    std::copy_n(row, width, own);
    for (int n = 1; n <= reach; ++n) {
      const float weight = weights_[static_cast<std::size_t>(n - 1)];
      for (int x = 0; x < width; ++x) row[x] += weight * ((own[x - n] - own[x]) + (own[x + n] - own[x]));
    }
  }
}

void LensBlur::blur_columns(PlaneView<const float> in, PlaneView<float> out, RowBand band) const {
  for (int y = band.first; y < band.last; ++y) {
    const float* own = in.row(y);
    float* row = out.row(y);
    std::copy_n(own, in.width, row);
    for (std::size_t i = 0; i < weights_.size(); ++i) {
      const int n = static_cast<int>(i) + 1;
      const float* above = in.row(mirrored(y - n, in.height));
      const float* below = in.row(mirrored(y + n, in.height));
      for (int x = 0; x < in.width; ++x) row[x] += weights_[i] * ((above[x] - own[x]) + (below[x] - own[x]));
    }
  }
}

}  // namespace lowlux::capture
