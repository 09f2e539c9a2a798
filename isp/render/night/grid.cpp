#include "isp/render/night/grid.h"

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>

namespace lowlux::isp {
namespace {

constexpr int max_reach = 24;  // 3 * 8

struct Gaussian {
  int reach = 0;
  std::array<float, 2 * max_reach + 1> weight{};
};

Gaussian gaussian(double std_cells) {
  Gaussian out;
  out.reach = std::min(max_reach, static_cast<int>(std::ceil(3 * std_cells)));
  double sum = 0;
  const auto at = [&](int k) { return std::exp(-0.5 * k * k / (std_cells * std_cells)); };
  for (int k = -out.reach; k <= out.reach; ++k) sum += at(k);
  for (int k = -out.reach; k <= out.reach; ++k) out.weight[k + out.reach] = static_cast<float>(at(k) / sum);
  return out;
}

void halve_row(const float* upper, const float* lower, int width, float* out) {
  const int whole = width / 2;
  for (int x = 0; x < whole; ++x) {
    out[x] = 0.25f * (upper[2 * x] + upper[2 * x + 1] + (lower[2 * x] + lower[2 * x + 1]));
  }
  if ((width & 1) != 0) out[whole] = 0.5f * (upper[width - 1] + lower[width - 1]);
}

void interpolate_row(const float* near_row, const float* far_row, int cells, int width, float* out) {
  const auto at = [&](int x) { return 0.75f * near_row[x] + 0.25f * far_row[x]; };
  const auto cell = [&](int x, int before, int after) {
    out[2 * x] = 0.75f * at(x) + 0.25f * at(before);
    if (2 * x + 1 < width) out[2 * x + 1] = 0.75f * at(x) + 0.25f * at(after);
  };
  cell(0, 0, std::min(1, cells - 1));
  for (int x = 1; x + 1 < cells; ++x) {  // each element independent, so that the loop can be vectorised
    const float here = 0.75f * at(x);
    out[2 * x] = here + 0.25f * at(x - 1);
    out[2 * x + 1] = here + 0.25f * at(x + 1);
  }
  if (cells > 1) cell(cells - 1, cells - 2, cells - 1);
}

void blur_row(const float* in, int width, const Gaussian& g, float* out) {
  for (int x = 0; x < width; ++x) {
    float sum = 0;
    for (int k = -g.reach; k <= g.reach; ++k) sum += g.weight[k + g.reach] * in[std::clamp(x + k, 0, width - 1)];
    out[x] = sum;
  }
}

void blur_column_row(const PlaneView<const float>& in, int y, const Gaussian& g, float* out) {
  std::fill_n(out, in.width, 0.0f);
  for (int k = -g.reach; k <= g.reach; ++k) {
    const float* const row = in.row(std::clamp(y + k, 0, in.height - 1));
    const float weight = g.weight[k + g.reach];
    for (int x = 0; x < in.width; ++x) out[x] += weight * row[x];
  }
}

}  // namespace

void halve(const PlaneView<const float>& in, const PlaneView<float>& out, Executor& executor) {
  assert(out.width == halved(in.width) && out.height == halved(in.height));
  for_each_band(executor, out.height, [&](RowBand band, int) {
    for (int y = band.first; y < band.last; ++y) {
      halve_row(in.row(2 * y), in.row(std::min(2 * y + 1, in.height - 1)), in.width, out.row(y));
    }
  });
}

void interpolate_twice(const PlaneView<const float>& in, const PlaneView<float>& out, Executor& executor) {
  assert(in.width == halved(out.width) && in.height == halved(out.height));
  for_each_band(executor, out.height, [&](RowBand band, int) {
    for (int y = band.first; y < band.last; ++y) {
      const int beside = std::clamp(y / 2 + ((y & 1) != 0 ? 1 : -1), 0, in.height - 1);
      interpolate_row(in.row(y / 2), in.row(beside), in.width, out.width, out.row(y));
    }
  });
}

void blur(const PlaneView<float>& plane, double std_cells, const PlaneView<float>& scratch, Executor& executor) {
  assert(std_cells >= 0 && std_cells <= 8 && scratch.width == plane.width && scratch.height == plane.height);
  if (std_cells < 1e-3) return;
  const Gaussian g = gaussian(std_cells);
  for_each_band(executor, plane.height, [&](RowBand band, int) {
    for (int y = band.first; y < band.last; ++y) blur_row(plane.row(y), plane.width, g, scratch.row(y));
  });
  for_each_band(executor, plane.height, [&](RowBand band, int) {
    for (int y = band.first; y < band.last; ++y) blur_column_row(scratch, y, g, plane.row(y));
  });
}

}  // namespace lowlux::isp
