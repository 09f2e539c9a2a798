#include "tests/reference/nl_bayes_ref.h"

#include <cmath>
#include <utility>

#include "denoise/spatial/layout.h"
#include "denoise/spatial/residual_shares.h"

namespace lowlux::reference::denoising {
namespace {

using denoise::FoundBy;
using denoise::PatchShares;
using denoise::PlaneKind;

constexpr int side = 4, dims = side * side, most = 32;
using Patch = std::array<double, dims>;
using Matrix = std::array<Patch, dims>;

struct Place {
  int x, y;
};

Patch patch_at(const Image& in, Place at) {
  Patch out{};
  for (int i = 0; i < dims; ++i) out[i] = in.at(at.x + i % side, at.y + i / side);
  return out;
}

/// Returns the mean over the 2x2 cells, on the even lattice, that hold the middle of the patch.
double variance_at(const Image& in, Place at) {
  double sum = 0;
  for (const int y : {at.y + 1, at.y + 2}) {
    for (const int x : {at.x + 1, at.x + 2}) {
      for (int i = 0; i < 4; ++i) sum += in.at(x / 2 * 2 + i % 2, y / 2 * 2 + i / 2) / 16;
    }
  }
  return sum;
}

/// Returns the patch itself and the nearest others, by squared distance of the pilot over the noise's variance.
std::vector<Place> nearest(const Four& pilot, const Four& variance, Place own) {
  std::array<double, 4> v{};
  for (int p = 0; p < 4; ++p) v[p] = variance_at(variance[p], own);
  std::vector<std::pair<double, Place>> found;
  found.reserve(17 * 16);
  for (int y = std::max(0, own.y - 8); y <= std::min(pilot[0].height - side, own.y + 8); ++y) {
    for (int x = std::max(0, own.x - 8); x <= std::min(pilot[0].width - side, own.x + 7); ++x) {
      double distance = 0;
      for (int p = 0; p < 4; ++p) {
        const Patch a = patch_at(pilot[p], own), b = patch_at(pilot[p], {x, y});
        for (int i = 0; i < dims; ++i) distance += (a[i] - b[i]) * (a[i] - b[i]) / v[p];
      }
      found.push_back({x == own.x && y == own.y ? -1 : distance, {x, y}});
    }
  }
  std::stable_sort(found.begin(), found.end(), [](const auto& a, const auto& b) { return a.first < b.first; });
  std::vector<Place> out;
  out.reserve(most);
  for (std::size_t i = 0; i < std::min<std::size_t>(most, found.size()); ++i) out.push_back(found[i].second);
  return out;
}

/// Returns the inverse of a symmetric positive matrix, by its Cholesky factor.
Matrix inverse(const Matrix& m) {
  Matrix factor{}, out{};
  for (int i = 0; i < dims; ++i) {
    for (int j = 0; j <= i; ++j) {
      double sum = m[i][j];
      for (int k = 0; k < j; ++k) sum -= factor[i][k] * factor[j][k];
      factor[i][j] = i == j ? std::sqrt(sum) : sum / factor[j][j];
    }
  }
  for (int column = 0; column < dims; ++column) {
    Patch y{};
    for (int i = 0; i < dims; ++i) {
      y[i] = i == column ? 1 : 0;
      for (int k = 0; k < i; ++k) y[i] -= factor[i][k] * y[k];
      y[i] /= factor[i][i];
    }
    for (int i = dims - 1; i >= 0; --i) {
      for (int k = i + 1; k < dims; ++k) y[i] -= factor[k][i] * y[k];
      y[i] /= factor[i][i];
      out[i][column] = y[i];
    }
  }
  return out;
}

Patch mean_of(const std::vector<Patch>& patches) {
  Patch mean{};
  for (const Patch& patch : patches) {
    for (int i = 0; i < dims; ++i) mean[i] += patch[i] / static_cast<double>(patches.size());
  }
  return mean;
}

/// Returns C (C + V)^-1, C the covariance of the patches.
Matrix filter_of(const std::vector<Patch>& patches, double& variance) {
  const Patch mean = mean_of(patches);
  Matrix c{};
  double power = 0;
  for (const Patch& patch : patches) {
    for (int i = 0; i < dims; ++i) {
      for (int k = 0; k < dims; ++k) {
        c[i][k] += (patch[i] - mean[i]) * (patch[k] - mean[k]) / static_cast<double>(patches.size());
      }
    }
  }
  for (int i = 0; i < dims; ++i) power += c[i][i];
  variance = std::max(variance, 1e-6 * power);
  for (int i = 0; i < dims; ++i) c[i][i] += variance;
  Matrix out = inverse(c);
  for (int i = 0; i < dims; ++i) {
    for (int k = 0; k < dims; ++k) out[i][k] = (i == k ? 1 : 0) - variance * out[i][k];
  }
  return out;
}

struct Sums {
  Shrunk sum;
  Four weight, own_weight;
};

void add_group(const Four& x, const Four& variance, const Four& pilot, int p, const std::vector<Place>& places,
               const PatchShares& left, Sums& out) {
  std::vector<Patch> noisy, clean;
  double v = 0;
  noisy.reserve(places.size());
  clean.reserve(places.size());
  for (const Place at : places) {
    noisy.push_back(patch_at(x[p], at));
    clean.push_back(patch_at(pilot[p], at));
    v += variance_at(variance[p], at) / static_cast<double>(places.size());
  }
  const Matrix filter = filter_of(clean, v);
  double kept = 0, squares = 0;
  for (int i = 0; i < dims; ++i) {
    kept += filter[i][i];
    for (int k = 0; k < dims; ++k) squares += filter[i][k] * filter[i][k];
  }
  const auto n = static_cast<double>(places.size());
  const double trust = std::min(1.0, n * kept / dims);
  const Patch noisy_mean = mean_of(noisy), clean_mean = mean_of(clean);
  const double weight = 1 / (v * (squares + 1));
  for (std::size_t m = 0; m < places.size(); ++m) {
    for (int i = 0; i < dims; ++i) {
      double value = clean_mean[i] + trust * (noisy_mean[i] - clean_mean[i]);
      for (int k = 0; k < dims; ++k) value += filter[i][k] * (noisy[m][k] - noisy_mean[k]);
      const int at_x = places[m].x + i % side, at_y = places[m].y + i / side;
      out.sum.value[p].at(at_x, at_y) += weight * value;
      out.weight[p].at(at_x, at_y) += weight;
    }
  }
  const double residual =
      v * ((static_cast<double>(left.trace) * kept + static_cast<double>(left.squares) * squares) / dims +
           static_cast<double>(left.other));
  for (int i = 0; i < dims; ++i) {
    out.sum.residual[p].at(places[0].x + i % side, places[0].y + i / side) += weight * residual;
    out.own_weight[p].at(places[0].x + i % side, places[0].y + i / side) += weight;
  }
}

/// Returns all_planes where chroma starts on this level or a finer one within two tiles of the patch; elsewhere luma,
/// because chroma is not visible there.
FoundBy found_by(const Image& starts, int level, Place at) {
  const auto tile = [level](int cell, int tiles) { return denoise::tile_of(cell << level, tiles); };
  for (int y = tile(at.y, starts.height) - 2; y <= tile(at.y + side - 1, starts.height) + 2; ++y) {
    for (int x = tile(at.x, starts.width) - 2; x <= tile(at.x + side - 1, starts.width) + 2; ++x) {
      if (starts.near(x, y) <= level) return FoundBy::all_planes;
    }
  }
  return FoundBy::luma;
}

}  // namespace

Shrunk nl_bayes(const Four& x, const Four& variance, const Four& pilot, int level, const Image& starts) {
  Sums out;
  for (Four* four : {&out.sum.value, &out.sum.residual, &out.weight, &out.own_weight}) {
    four->fill(Image(x[0].width, x[0].height));
  }
  for (int y = 0; y < x[0].height; y += side) {
    for (int column = 0; column < x[0].width; column += side) {
      const auto places = nearest(pilot, variance, {column, y});
      const FoundBy found = found_by(starts, level, {column, y});
      for (int p = 0; p < 4; ++p) {
        const PatchShares left = patch_fractions(p == 0 ? PlaneKind::luma : PlaneKind::chroma, found);
        add_group(x, variance, pilot, p, places, left, out);
      }
    }
  }
  for (int p = 0; p < 4; ++p) {
    for (std::size_t i = 0; i < out.weight[p].v.size(); ++i) {
      out.sum.value[p].v[i] /= out.weight[p].v[i];
      out.sum.residual[p].v[i] /= out.own_weight[p].v[i];
    }
  }
  return out.sum;
}

}  // namespace lowlux::reference::denoising
