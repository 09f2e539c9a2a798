#include "tests/reference/denoise_ref_blocks.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>
#include <vector>

#include "denoise/spatial/layout.h"
#include "denoise/spatial/residual_shares.h"

namespace lowlux::reference::denoising {

Image down2(const Image& in) {
  Image out(in.width / 2, in.height / 2);
  for (int y = 0; y < out.height; ++y) {
    for (int x = 0; x < out.width; ++x) {
      out.at(x, y) =
          (in.at(2 * x, 2 * y) + in.at(2 * x + 1, 2 * y) + in.at(2 * x, 2 * y + 1) + in.at(2 * x + 1, 2 * y + 1)) / 4;
    }
  }
  return out;
}

Image up2(const Image& in) {
  Image out(2 * in.width, 2 * in.height);
  for (int y = 0; y < out.height; ++y) {
    for (int x = 0; x < out.width; ++x) {
      const int cx = x / 2, cy = y / 2, sx = 2 * (x % 2) - 1, sy = 2 * (y % 2) - 1;
      out.at(x, y) =
          (9 * in.near(cx, cy) + 3 * in.near(cx + sx, cy) + 3 * in.near(cx, cy + sy) + in.near(cx + sx, cy + sy)) / 16;
    }
  }
  return out;
}

Image binomial3(const Image& in) {
  constexpr std::array weight{0.25, 0.5, 0.25};
  Image out(in.width, in.height);
  for (int y = 0; y < in.height; ++y) {
    for (int x = 0; x < in.width; ++x) {
      for (int j = 0; j < 3; ++j) {
        for (int i = 0; i < 3; ++i) out.at(x, y) += weight[j] * weight[i] * in.near(x + i - 1, y + j - 1);
      }
    }
  }
  return out;
}

namespace {

/// Interpolates values that are not seen: linear between the cells before and after, or that of the only one.
std::vector<double> interpolated(std::vector<double> value, const std::vector<bool>& seen) {
  const int n = static_cast<int>(value.size());
  const std::vector<double> in = value;
  for (int i = 0; i < n; ++i) {
    int before = i, after = i;
    while (before >= 0 && !seen[before]) --before;
    while (after < n && !seen[after]) ++after;
    if (before < 0 && after == n) continue;
    if (before < 0) before = after;
    if (after == n) after = before;
    value[i] = before == after ? in[before] : in[before] + (in[after] - in[before]) * (i - before) / (after - before);
  }
  return value;
}

void fill_coarsest(const Image& seen, Image& value) {
  std::vector<bool> row_seen;
  row_seen.reserve(static_cast<std::size_t>(value.height));
  for (int y = 0; y < value.height; ++y) {
    std::vector<double> row;
    std::vector<bool> there;
    for (int x = 0; x < value.width; ++x) {
      row.push_back(value.at(x, y));
      there.push_back(seen.at(x, y) > 0);
    }
    row = interpolated(row, there);
    for (int x = 0; x < value.width; ++x) value.at(x, y) = row[x];
    row_seen.push_back(std::find(there.begin(), there.end(), true) != there.end());
  }
  for (int x = 0; x < value.width; ++x) {
    std::vector<double> column;
    column.reserve(static_cast<std::size_t>(value.height));
    for (int y = 0; y < value.height; ++y) column.push_back(value.at(x, y));
    column = interpolated(column, row_seen);
    for (int y = 0; y < value.height; ++y) value.at(x, y) = column[y];
  }
}

}  // namespace

void fill_unseen(const Image& seen, Image& value, int levels) {
  if (levels == 1) return fill_coarsest(seen, value);
  const Image half_seen = down2(seen);
  Image weighted = value;
  for (std::size_t i = 0; i < value.v.size(); ++i) weighted.v[i] *= seen.v[i];
  Image half = down2(weighted);
  for (std::size_t i = 0; i < half.v.size(); ++i) half.v[i] = half_seen.v[i] > 0 ? half.v[i] / half_seen.v[i] : 0;
  fill_unseen(half_seen, half, levels - 1);
  const Image around = up2(half);
  for (std::size_t i = 0; i < value.v.size(); ++i) {
    if (seen.v[i] == 0) value.v[i] = around.v[i];
  }
}

namespace {

using denoise::block;

struct Transform {
  double c[block][block];  // c[k][i]: orthonormal DCT-II
  Transform() {
    for (int k = 0; k < block; ++k) {
      for (int i = 0; i < block; ++i) {
        c[k][i] = std::sqrt((k == 0 ? 1.0 : 2.0) / block) * std::cos((2 * i + 1) * k * std::numbers::pi / (2 * block));
      }
    }
  }
};

using Block = std::array<std::array<double, block>, block>;

Block dct(const Image& in, int x0, int y0) {
  static const Transform t;
  Block rows{}, out{};
  for (int v = 0; v < block; ++v) {
    for (int x = 0; x < block; ++x) {
      for (int y = 0; y < block; ++y) rows[v][x] += t.c[v][y] * in.at(x0 + x, y0 + y);
    }
    for (int u = 0; u < block; ++u) {
      for (int x = 0; x < block; ++x) out[v][u] += t.c[u][x] * rows[v][x];
    }
  }
  return out;
}

Block inverse_dct(const Block& in) {
  static const Transform t;
  Block rows{}, out{};
  for (int v = 0; v < block; ++v) {
    for (int x = 0; x < block; ++x) {
      for (int u = 0; u < block; ++u) rows[v][x] += t.c[u][x] * in[v][u];
    }
  }
  for (int y = 0; y < block; ++y) {
    for (int x = 0; x < block; ++x) {
      for (int v = 0; v < block; ++v) out[y][x] += t.c[v][y] * rows[v][x];
    }
  }
  return out;
}

/// Returns whether coefficient (u, v) of plane p exceeds its threshold.
bool is_kept(int p, int u, int v, const std::array<Block, 4>& f, const std::array<double, 4>& variance) {
  const bool luma = f[0][v][u] * f[0][v][u] > 9 * variance[0];
  const double least = p == 0 ? 9 : luma && u + v > 0 ? 6.25 : 16;
  return f[p][v][u] * f[p][v][u] > least * variance[p];
}

/// Returns the squares of all coefficients but the mean; with hard thresholds of those that are kept.
Block power_of(int p, const std::array<Block, 4>& f, const std::array<double, 4>& variance, bool hard) {
  Block out{};
  for (int v = 0; v < block; ++v) {
    for (int u = 0; u < block; ++u) {
      const bool counts = u + v > 0 && (!hard || is_kept(p, u, v, f, variance));
      out[v][u] = counts ? f[p][v][u] * f[p][v][u] : 0;
    }
  }
  return out;
}

double sum_of(const Block& in) {
  double sum = 0;
  for (const auto& row : in) sum = std::accumulate(row.begin(), row.end(), sum);
  return sum;
}

/// Returns A of the spectrum A / sqrt(u^2 + v^2) of the signal in the coefficients of plane p below their thresholds.
double faint_power(int p, const std::array<Block, 4>& f, const std::array<double, 4>& variance) {
  double excess = 0, sum_shape2 = 0;
  for (int v = 0; v < block; ++v) {
    for (int u = 0; u < block; ++u) {
      if (u + v == 0 || is_kept(p, u, v, f, variance)) continue;
      const double shape = 1 / std::hypot(u, v), threshold = p == 0 ? 3 : is_kept(0, u, v, f, variance) ? 2.5 : 4;
      // The mean square of normal values below the threshold; of those below 4 it is that of all.
      const double density = std::exp(-threshold * threshold / 2) / std::sqrt(2 * std::numbers::pi);
      const double below = threshold == 4 ? 1 : 1 - 2 * threshold * density / std::erf(threshold / std::numbers::sqrt2);
      excess += shape * (f[p][v][u] * f[p][v][u] - below * variance[p]);
      sum_shape2 += shape * shape;
    }
  }
  if (sum_shape2 == 0) return 0;
  const double margin = p == 0 ? 2 : 4, factor = p == 0 ? 1 : 4;
  return factor * std::max(0.0, excess / sum_shape2 - margin * variance[p] * std::sqrt(2 / sum_shape2));
}

/// Returns the gains of the coefficients of plane p (sections "pass 1" and "pass 2" of denoise/README.md).
/// @param known  the noisy coefficients, of which those above thresholds are known, or the pilot's
Block gains(int p, const std::array<Block, 4>& known, const std::array<double, 4>& variance, bool hard, int level,
            int levels) {
  const Block own = power_of(p, known, variance, hard), luma = power_of(0, known, variance, hard);
  const double per_luma =
      p == 0 ? 0 : denoise::luma_shaped_power(level, levels) * sum_of(own) / (sum_of(luma) + 4 * variance[0]);
  const double faint = hard ? faint_power(p, known, variance) : 0;
  const double pilot = p == 0 ? denoise::pilot_power_of_luma : denoise::pilot_power_of_chroma(level);
  Block gain{};
  for (int v = 0; v < block; ++v) {
    for (int u = 0; u < block; ++u) {
      const double rest = !hard ? pilot * own[v][u] : u + v == 0 ? 0 : faint / std::hypot(u, v);
      const double power = std::max(rest, per_luma * luma[v][u]);
      gain[v][u] = hard && is_kept(p, u, v, known, variance) ? 1 : power / (power + variance[p]);
    }
  }
  gain[0][0] = 1;
  return gain;
}

/// Returns the factor of row i of a block.
double window(int i, int rows_apart) {
  constexpr std::array<double, block> rising{2, 2, 5, 5, 5, 5, 2, 2};
  return rows_apart == 4 ? rising[i] : 1;
}

}  // namespace

Shrunk shrink(const Four& x, const Four& variance, const Four* pilot, int rows_apart, int level, int levels) {
  const int w = x[0].width, h = x[0].height;
  Shrunk out;
  Four weight;
  for (Four* four : {&out.value, &out.residual, &weight}) four->fill(Image(w, h));
  for (int y0 = 0; y0 + block <= h; y0 += rows_apart) {
    for (int x0 = 0; x0 + block <= w; x0 += 2) {
      std::array<Block, 4> f, of_pilot;
      std::array<double, 4> v{};
      for (int p = 0; p < 4; ++p) {
        f[p] = dct(x[p], x0, y0);
        if (pilot != nullptr) of_pilot[p] = dct((*pilot)[p], x0, y0);
        for (int i = 0; i < block * block; ++i) v[p] += variance[p].at(x0 + i % block, y0 + i / block) / 64;
      }
      for (int p = 0; p < 4; ++p) {
        const Block gain = gains(p, pilot == nullptr ? f : of_pilot, v, pilot == nullptr, level, levels);
        Block kept{};
        double power = 0;
        for (int i = 0; i < block * block; ++i) {
          const double g = gain[i / block][i % block];
          power += g * g;
          kept[i / block][i % block] = g * f[p][i / block][i % block];
        }
        const Block value = inverse_dct(kept);
        const auto left = denoise::residual_fractions(p == 0 ? denoise::PlaneKind::luma : denoise::PlaneKind::chroma,
                                                      pilot == nullptr ? 0 : 1, rows_apart, level, levels);
        const double share = 1 / (v[p] * (level + 1 == levels ? 1 : power));
        const double residual = v[p] * (left.kept * (power - 1) + left.other * (64 - power) + left.mean);
        for (int i = 0; i < block * block; ++i) {
          const int at_x = x0 + i % block, at_y = y0 + i / block;
          const double part = share * window(i / block, rows_apart);
          out.value[p].at(at_x, at_y) += part * value[i / block][i % block];
          out.residual[p].at(at_x, at_y) += part * residual;
          weight[p].at(at_x, at_y) += part;
        }
      }
    }
  }
  for (int p = 0; p < 4; ++p) {
    for (std::size_t i = 0; i < weight[p].v.size(); ++i) {
      out.value[p].v[i] /= weight[p].v[i];
      out.residual[p].v[i] /= weight[p].v[i];
    }
  }
  return out;
}

}  // namespace lowlux::reference::denoising
