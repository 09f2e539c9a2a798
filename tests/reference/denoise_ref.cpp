#include "tests/reference/denoise_ref.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <vector>

#include "denoise/spatial/layout.h"
#include "denoise/spatial/residual_shares.h"
#include "tests/reference/denoise_ref_blocks.h"
#include "tests/reference/nl_bayes_ref.h"
#include "tests/reference/noise_ratio_ref.h"

namespace lowlux::reference {
namespace {

using namespace denoise;
using namespace denoising;

struct Frame {
  const RawElectronsView& raw;
  const RawNoise& noise;
  const DenoiseOptions& options;
  PerSite<int> site;
  int columns, rows, levels;
  std::array<double, 4> dark_e, gain, variance_e2;
  double max_ratio = 0;
  double offset_e = 0;  // c of h(x), see below
  Four value;           // of each cell's sites
  Four sum_of_nine;     // along a row, of the values around each

  Frame(const RawElectronsView& r, const RawNoise& n, const DenoiseOptions& o)
      : raw(r), noise(n), options(o), site(sites_of(r.phase)) {
    columns = (raw.value.width + 1) / 2;
    rows = (raw.value.height + 1) / 2;
    levels = levels_of(columns, rows);
    for (int k = 0; k < 4; ++k) dark_e[k] = noise.dark_mean_e[site[k]];
    dark_e[1] = dark_e[2] = (dark_e[1] + dark_e[2]) / 2;
    gain = {o.white_gain[0], o.white_gain[1], o.white_gain[1], o.white_gain[2]};
    variance_e2 = {noise.variance_e2[0], noise.variance_e2[1], noise.variance_e2[1], noise.variance_e2[2]};
    const double scale = *std::max_element(o.variance_scale.begin(), o.variance_scale.end());
    for (int y = 0; y < raw.noise_ratio.ratio.height; ++y) {
      for (int x = 0; x < raw.noise_ratio.ratio.width; ++x) {
        max_ratio = std::max(max_ratio, static_cast<double>(raw.noise_ratio.ratio.at(x, y)));
      }
    }
    if (raw.noise_ratio.is_one()) max_ratio = 1;
    for (int k = 0; k < 4; ++k) {
      offset_e = std::max(
          offset_e, gain[k] * (10 * std::max(max_ratio, 1.0) + 2 * max_ratio * scale * (dark_e[k] + variance_e2[k])));
    }
    for (int k = 0; k < 4; ++k) set_values(k);
  }

  void set_values(int k) {
    value[k] = sum_of_nine[k] = Image(columns, rows);
    for (int cy = 0; cy < rows; ++cy) {
      for (int cx = 0; cx < columns; ++cx) {
        const float e =
            raw.value.at(raw_of(cx, site[k] & 1, raw.value.width), raw_of(cy, site[k] >> 1, raw.value.height));
        value[k].at(cx, cy) = std::isnan(e) ? 0 : std::clamp(static_cast<double>(e), -1e9, 1e9);
      }
      for (int cx = 0; cx < columns; ++cx) {
        for (int i = -4; i <= 4; ++i) sum_of_nine[k].at(cx, cy) += y(k, cx + i, cy);
      }
    }
  }

  // h(x) = 2 c (sqrt(1 + x / c) - 1), below x = -c / 2 its tangent there.
  double stabilised(double x) const {
    const double edge = -0.5 * offset_e, at = 2 * x / (1 + std::sqrt(1 + std::max(x, edge) / offset_e));
    return x >= edge ? at : 2 * offset_e * (std::sqrt(0.5) - 1) + std::numbers::sqrt2 * (x - edge);
  }
  double edge() const { return 2 * offset_e * (std::sqrt(0.5) - 1); }  // h(-c / 2)
  double light(double u) const {
    return u >= edge() ? u + u * u / (4 * offset_e) : -0.5 * offset_e + (u - edge()) / std::numbers::sqrt2;
  }
  double slope(double u) const { return std::max(1 + u / (2 * offset_e), std::sqrt(0.5)); }  // of light(u)

  double y(int k, int cell_x, int cell_y) const {
    return value[k].at(mirrored(cell_x, columns), mirrored(cell_y, rows));
  }

  bool saturated(int k, int cell_x, int cell_y) const {
    const auto colour = static_cast<std::size_t>((k + 1) / 2);  // both greens are 1
    return y(k, cell_x, cell_y) >= static_cast<float>(noise.saturation_e[colour]);
  }

  int saturated_sites(int cell_x, int cell_y) const {
    int sum = 0;
    for (int k = 0; k < 4; ++k) sum += saturated(k, cell_x, cell_y) ? 1 : 0;
    return sum;
  }

  bool saturated(int cell_x, int cell_y) const {
    return saturated(0, cell_x, cell_y) || saturated(1, cell_x, cell_y) || saturated(2, cell_x, cell_y) ||
           saturated(3, cell_x, cell_y);
  }

  double mean(int k, int cell_x, int cell_y) const {
    double sum = 0;
    for (int j = -4; j <= 4; ++j) {
      const int cx = mirrored(cell_x, columns), cy = mirrored(cell_y + j, rows);
      sum += k == 1 || k == 2 ? (sum_of_nine[1].at(cx, cy) + sum_of_nine[2].at(cx, cy)) / 2 : sum_of_nine[k].at(cx, cy);
    }
    return sum / 81;
  }

  /// Returns the stabilised variance of colour k at a mean raw value, without the noise ratio.
  double variance_of(int k, double mean_e) const {
    const double x = gain[k] * (mean_e - dark_e[k]);
    return options.variance_scale[0] * gain[k] * gain[k] * (std::max(mean_e, 0.3 * dark_e[k] + 0.02) + variance_e2[k]) /
           (1 + std::max(x / offset_e, -0.5));
  }

  /// Returns the correlation of the noise of L = (R + 3 G + B) / 5 and C1 = (R + B) / 2 - G where both greens are one
  /// value.
  double correlation(const std::array<double, 4>& u) const {
    const auto of_site = [&](int k) { return variance_of(k, light(u[k]) / gain[k] + dark_e[k]); };
    const double r = of_site(0), g = of_site(1) / 2, b = of_site(3);
    return (0.1 * (r + b) - 0.6 * g) / std::sqrt((0.04 * (r + b) + 0.36 * g) * (0.25 * (r + b) + g));
  }

  /// Returns the chroma start level at each tile.
  Image starts() const {
    Image out(tiles_of(columns), tiles_of(rows));
    Image sum = out, count = out;
    const double dark = (dark_e[0] + dark_e[1] + dark_e[2] + dark_e[3]) / 4;
    const double steady = (variance_e2[0] + variance_e2[1] + variance_e2[2] + variance_e2[3]) / 4;
    for (int cy = 0; cy < rows; ++cy) {
      for (int cx = 0; cx < columns; ++cx) {
        const int tx = tile_of(cx, out.width), ty = tile_of(cy, out.height);
        for (int k = 0; k < 4; ++k) sum.at(tx, ty) += y(k, cx, cy) - dark_e[k];
        count.at(tx, ty) += 4;
      }
    }
    for (std::size_t i = 0; i < out.v.size(); ++i) {
      const double s = sum.v[i] / count.v[i];
      const int tile_x = static_cast<int>(i) % out.width, tile_y = static_cast<int>(i) / out.width;
      const double ratio = ratio_of_tile(raw, tile_x, tile_y, out.width, out.height);
      const double q = s > 0 ? s / std::sqrt(ratio * (s + dark + steady)) : 0;
      out.v[i] = options.chroma_start ? *options.chroma_start : q >= 3 ? 0 : q >= 0.7 ? 1 : 2;
      if (!options.chroma_start && options.level == Level::best && q >= 0.7) out.v[i] = 0;
    }
    for (double& start : out.v) start = std::min<double>(start, levels - 1);
    return out;
  }
};

/// Returns the value of tiles at the position of cell (x, y) of level `grid`, bilinear between their centres.
double between_tiles(const Image& tiles, int grid, int x, int y) {
  const auto place = [grid](int i, int count) {
    return std::clamp((i + 0.5) * (1 << grid) / tile - 0.5, 0.0, static_cast<double>(count - 1));
  };
  const double u = place(x, tiles.width), v = place(y, tiles.height);
  const int i = static_cast<int>(u), j = static_cast<int>(v);
  const double fx = u - i, fy = v - j;
  return (1 - fy) * ((1 - fx) * tiles.near(i, j) + fx * tiles.near(i + 1, j)) +
         fy * ((1 - fx) * tiles.near(i, j + 1) + fx * tiles.near(i + 1, j + 1));
}

/// Returns the fraction of coarser levels in the chroma of `level`, at the position of cell (x, y) of level `grid`.
double coarser_fraction(const Image& starts, int level, int grid, int x, int y) {
  return std::clamp(between_tiles(starts, grid, x, y) - level, 0.0, 1.0);
}

Four decorrelated(const Frame& frame, Four& variance) {
  const int w = padded(frame.columns, frame.levels), h = padded(frame.rows, frame.levels);
  Four out;
  out.fill(Image(w, h));
  variance = out;
  Four loss = out;  // what noise of ratio 1 takes from the mean
  for (int cy = 0; cy < h; ++cy) {
    for (int cx = 0; cx < w; ++cx) {
      std::array<double, 4> x{}, v{};
      const double ratio = ratio_at_cell(frame.raw, cx, cy);
      double most = -1e30;
      for (int k = 0; k < 4; ++k) {
        x[k] = frame.gain[k] * (frame.y(k, cx, cy) - frame.dark_e[k]);
        const double mean = frame.mean(k, mirrored(cx, frame.columns), mirrored(cy, frame.rows));
        v[k] = ratio * frame.variance_of(k, mean);
        const double light = frame.gain[k] * (mean - frame.dark_e[k]) / frame.offset_e;
        loss[k].at(cx, cy) =
            light > -0.5 ? frame.variance_of(k, mean) / (4 * frame.offset_e * std::sqrt(1 + light)) : 0;
        most = std::max(most, x[k]);
      }
      for (int k = 0; k < 4; ++k) {
        if (frame.saturated(k, cx, cy)) x[k] = most;
        x[k] = frame.stabilised(x[k]);
      }
      out[0].at(cx, cy) = 0.2 * x[0] + 0.3 * x[1] + 0.3 * x[2] + 0.2 * x[3];
      out[1].at(cx, cy) = 0.5 * (x[0] + x[3] - x[1] - x[2]);
      out[2].at(cx, cy) = (x[0] - x[3]) / std::numbers::sqrt2;
      out[3].at(cx, cy) = x[1] - x[2];
      variance[0].at(cx, cy) = 0.04 * (v[0] + v[3]) + 0.09 * (v[1] + v[2]);
      variance[1].at(cx, cy) = 0.25 * (v[0] + v[1] + v[2] + v[3]);
      variance[2].at(cx, cy) = 0.5 * (v[0] + v[3]);
      variance[3].at(cx, cy) = v[1] + v[2];
    }
  }
  for (Image& image : loss) image = down2(image);
  for (int cy = 0; cy < h; ++cy) {
    for (int cx = 0; cx < w; ++cx) {
      const double less = frame.max_ratio - ratio_at_cell(frame.raw, cx, cy);
      const auto at = [&](int k) { return less * loss[k].at(cx / 2, cy / 2); };
      out[0].at(cx, cy) -= 0.2 * (at(0) + at(3)) + 0.3 * (at(1) + at(2));
      out[1].at(cx, cy) -= 0.5 * (at(0) + at(3) - at(1) - at(2));
      out[2].at(cx, cy) -= (at(0) - at(3)) / std::numbers::sqrt2;
    }
  }
  return out;
}

/// Recomposes levels from coarse to fine, in place: what was shrunk becomes the image at that level.
void recompose(std::vector<Four>& levels, const Image& starts) {
  for (int l = static_cast<int>(levels.size()) - 2; l >= 0; --l) {
    for (int p = 0; p < 4; ++p) {
      Image& fine = levels[l][p];
      const Image& coarse = levels[l + 1][p];
      Image difference = down2(fine);
      for (std::size_t i = 0; i < difference.v.size(); ++i) difference.v[i] = coarse.v[i] - difference.v[i];
      const Image correction = up2(binomial3(difference)), smooth = up2(coarse);
      for (int y = 0; y < fine.height; ++y) {
        for (int x = 0; x < fine.width; ++x) {
          const double share = p == 0 ? 0 : coarser_fraction(starts, l, l, x, y);
          fine.at(x, y) = (1 - share) * (fine.at(x, y) + correction.at(x, y)) + share * smooth.at(x, y);
        }
      }
    }
  }
}

/// Returns residual variances summed over levels, at the finest.
Four total_residual(const std::vector<Four>& levels, const Image& starts) {
  Four total;
  for (int l = static_cast<int>(levels.size()) - 1; l >= 0; --l) {
    for (int p = 0; p < 4; ++p) {
      const Image own = down2(levels[l][p]);
      Image sum = total[p].v.empty() ? Image(own.width, own.height) : up2(total[p]);
      for (int y = 0; y < own.height; ++y) {
        for (int x = 0; x < own.width; ++x) {
          const double coarser = p == 0 ? 0 : coarser_fraction(starts, l, l + 1, x, y);
          const bool between = l > 0 && l + 1 < static_cast<int>(levels.size());  // the coarsest counts as it is
          const double finer = p != 0 && between ? coarser_fraction(starts, l - 1, l + 1, x, y) : 0;
          sum.at(x, y) += (1 - coarser) * (1 + (as_finest - 1) * finer) * own.at(x, y);
        }
      }
      total[p] = sum;
    }
  }
  for (Image& image : total) image = up2(image);
  return total;
}

/// Returns `result_e`, with dark charge, or what is nearer to the raw value of pixel (x, y) if they differ by more than
/// five standard deviations of noise.
double without_excess(const Frame& frame, int k, int x, int y, double result_e) {
  if (std::isnan(frame.raw.value.at(x, y))) return result_e;
  const double ratio = static_cast<double>(frame.raw.noise_ratio.at(x, y));
  const double measured_e = frame.y(k, x / 2, y / 2), change = result_e - measured_e;
  const double mean_e = std::max({result_e, measured_e, 0.3 * frame.dark_e[k] + 0.02});
  const double sigma = std::sqrt(frame.options.variance_scale[0] * ratio * (mean_e + frame.variance_e2[k]));
  if (std::abs(change) <= 5 * sigma) return result_e;
  return std::abs(change) >= 10 * sigma ? measured_e : measured_e + change * (10 * sigma / std::abs(change) - 1);
}

/// Gives saturated cells the chroma of their surroundings.
void fill_saturated(const Frame& frame, Four& x) {
  Image seen(x[0].width, x[0].height);
  for (int cy = 0; cy < seen.height; ++cy) {
    for (int cx = 0; cx < seen.width; ++cx) seen.at(cx, cy) = frame.saturated(cx, cy) ? 0 : 1;
  }
  if (std::find(seen.v.begin(), seen.v.end(), 1) == seen.v.end()) {
    for (int p = 1; p < 4; ++p) std::fill(x[p].v.begin(), x[p].v.end(), 0);
    return;
  }
  for (int p = 1; p < 4; ++p) fill_unseen(seen, x[p], frame.levels);
}

/// Adds the coarser levels to the pyramids of the planes, and of their variances.
void add_coarser(std::vector<Four>& x, std::vector<Four>& variance, const Frame& frame) {
  const int levels = frame.levels;
  const auto& scale = frame.options.variance_scale;
  x.reserve(static_cast<std::size_t>(levels));
  variance.reserve(static_cast<std::size_t>(levels));
  while (static_cast<int>(x.size()) < levels) {
    Four half, half_variance;
    for (int p = 0; p < 4; ++p) {
      half[p] = down2(x.back()[p]);
      half_variance[p] = down2(variance.back()[p]);
      for (double& v : half_variance[p].v) v *= scale[x.size()] / scale[x.size() - 1] / 4;
    }
    x.push_back(std::move(half));
    variance.push_back(std::move(half_variance));
  }
}

/// Returns the harmonic mean of two steps of one sign, else 0.
double slope(double before, double after) { return before * after > 0 ? 2 * before * after / (before + after) : 0; }

/// Adds to C2 and C3 `sign` times the effect of the luma's slopes, over the cells of the frame; mirrored beyond. There
/// is none where the sites of a cell coincide.
void add_slopes(const Frame& frame, double sign, const Image& luma, Four& planes) {
  if (frame.options.sites_coincide) return;
  const double sx = red_column(frame.raw.phase) == 0 ? -1 : 1, sy = red_row(frame.raw.phase) == 0 ? -1 : 1;
  const auto at = [&](int x, int y) {
    return luma.at(std::clamp(x, 0, frame.columns - 1), std::clamp(y, 0, frame.rows - 1));
  };
  for (int y = 0; y < planes[2].height; ++y) {
    for (int x = 0; x < planes[2].width; ++x) {
      const int cx = mirrored(x, frame.columns), cy = mirrored(y, frame.rows);
      const double here = at(cx, cy);
      const double gx = slope(here - at(cx - 1, cy), at(cx + 1, cy) - here);
      const double gy = slope(here - at(cx, cy - 1), at(cx, cy + 1) - here);
      planes[2].at(x, y) += sign * (sx * gx + sy * gy) / (2 * std::numbers::sqrt2);
      planes[3].at(x, y) += sign * (sy * gy - sx * gx) / 2;
    }
  }
}

/// Returns the values of R, the G in its row, the G in the row of B, and B.
std::array<double, 4> of_sites(double luma, double c1, double c2, double c3) {
  const double a = 2 * luma + 1.2 * c1, g = 2 * luma - 0.8 * c1;  // R + B and G1 + G2
  return {a / 2 + c2 / std::numbers::sqrt2, (g + c3) / 2, (g - c3) / 2, a / 2 - c2 / std::numbers::sqrt2};
}

/// Returns for each tile the variance of noise that is missing in the means, over that of RawNoise: of the largest
/// ratio, less what was left of the stated variance. What was removed is the excess of light(noisy) over its tangent at
/// the denoised value, which on the curved part is the square of the difference over 4 c; differences are limited to 5
/// standard deviations.
Image removed_noise(const Frame& frame, const Four& noisy, const Four& variance, const Four& value) {
  Image out(tiles_of(frame.columns), tiles_of(frame.rows));
  const double edge = frame.edge();
  Image removed = out, stated = out;
  const Image other = down2(variance[2]), green = down2(variance[3]);
  for (int cy = 0; cy < frame.rows; ++cy) {
    const int ty = tile_of(cy, out.height);
    if ((cy - ty * tile) % 3 != 0) continue;
    for (int cx = 0; cx < frame.columns; ++cx) {
      const auto at = [&](const Four& x) {
        return of_sites(x[0].at(cx, cy), x[1].at(cx, cy), x[2].at(cx, cy), x[3].at(cx, cy));
      };
      const auto before = at(noisy), after = at(value);
      const int tx = tile_of(cx, out.width);
      for (int k = 0; k < 4; ++k) {
        if (!(after[k] > edge)) continue;
        const double v = k == 1 || k == 2 ? green.at(cx / 2, cy / 2) / 2 : other.at(cx / 2, cy / 2);
        const double to = after[k] + std::clamp(before[k] - after[k], -5 * std::sqrt(v), 5 * std::sqrt(v));
        const double tangent = frame.light(after[k]) + frame.slope(after[k]) * (to - after[k]);
        removed.at(tx, ty) += 4 * frame.offset_e * (frame.light(to) - tangent);
        stated.at(tx, ty) += v;
      }
    }
  }
  for (int ty = 0; ty < out.height; ++ty) {
    for (int tx = 0; tx < out.width; ++tx) {
      const double part = stated.at(tx, ty) > 0 ? removed.at(tx, ty) / stated.at(tx, ty) : 0;
      out.at(tx, ty) = frame.max_ratio - (1 - part) * ratio_of_tile(frame.raw, tx, ty, out.width, out.height);
    }
  }
  return out;
}

struct Pictures {
  Four value;
  Four residual;
  Image removed;  // of tiles
};

Pictures both_passes(const Frame& frame, const Image& starts) {
  std::vector<Four> x(1), variance(1);
  x[0] = decorrelated(frame, variance[0]);
  add_slopes(frame, -1, x[0][0], x[0]);
  fill_saturated(frame, x[0]);
  add_coarser(x, variance, frame);
  std::vector<Four> value(frame.levels), residual(frame.levels);
  const int rows_apart = frame.options.level >= Level::high ? 2 : 4;
  const auto pass = [&](const std::vector<Four>* pilot) {
    std::vector<Four> out(frame.levels);
    for (int l = 0; l < frame.levels; ++l) {
      Shrunk shrunk = shrink(x[l], variance[l], pilot == nullptr ? nullptr : &(*pilot)[l], rows_apart, l, frame.levels);
      out[l] = std::move(shrunk.value);
      residual[l] = std::move(shrunk.residual);
    }
    recompose(out, starts);
    value = std::move(out);
  };
  pass(nullptr);
  if (frame.options.level != Level::draft) {
    const std::vector<Four> pilot = value;
    pass(&pilot);
  }
  if (frame.options.level == Level::best) {
    const auto finest = static_cast<std::size_t>(std::min(4, frame.levels - 1));
    value.resize(finest + 1);
    for (std::size_t l = 0; l < finest; ++l) {
      Shrunk shrunk = nl_bayes(x[l], variance[l], value[l], static_cast<int>(l), starts);
      value[l] = std::move(shrunk.value);
      residual[l] = std::move(shrunk.residual);
    }
    recompose(value, starts);
  }
  return {value[0], total_residual(residual, starts), removed_noise(frame, x[0], variance[0], value[0])};
}

}  // namespace

Denoised denoise(const RawElectronsView& raw, const RawNoise& noise, const DenoiseOptions& options) {
  const Frame frame(raw, noise, options);
  const Pictures p = both_passes(frame, frame.starts());
  Denoised out{Plane<double>(raw.value.width, raw.value.height),
               Plane<double>(frame.columns, frame.rows),
               Plane<double>(frame.columns, frame.rows),
               {}};
  for (auto& plane : out.site_variance) plane = Plane<double>(frame.columns, frame.rows);
  Four slopes;
  slopes.fill(Image(p.value[0].width, p.value[0].height));
  add_slopes(frame, 1, p.value[0], slopes);
  for (int cy = 0; cy < frame.rows; ++cy) {
    for (int cx = 0; cx < frame.columns; ++cx) {
      const double luma = p.value[0].at(cx, cy), prior = std::max(luma, 0.0) * options.rho;
      const auto factor = [&](double residual) {
        if (frame.saturated(cx, cy)) return 0.0;
        return std::isinf(options.rho) ? 1.0 : prior * prior / (prior * prior + residual);
      };
      std::array<double, 4> c{}, left{};
      for (int i = 1; i < 4; ++i) {
        const double residual = p.residual[i].at(cx, cy), share = factor(residual);
        c[i] = p.value[i].at(cx, cy) * share;
        left[i] = share * share * residual;
      }
      for (int i = 2; i < 4; ++i) c[i] += slopes[i].at(cx, cy);
      const int saturated = frame.saturated_sites(cx, cy);
      const bool measured = saturated > 0 && saturated < 4;
      const std::array<double, 4> u = of_sites(luma, c[1], c[2], c[3]);
      const double removed = between_tiles(p.removed, 0, cx, cy);
      for (int k = 0; k < 4; ++k) {
        const int at_x = 2 * cx + (frame.site[k] & 1), at_y = 2 * cy + (frame.site[k] >> 1);
        if (at_x >= raw.value.width || at_y >= raw.value.height) continue;
        const double x = frame.light(u[k]);
        const double variance = frame.variance_of(k, x / frame.gain[k] + frame.dark_e[k]);
        const double mean = u[k] > frame.edge() ? removed * variance / (4 * frame.offset_e) : 0;
        double result = frame.dark_e[k] + (x + mean) / frame.gain[k];
        if (measured) result = frame.y(k, cx, cy);
        if (saturated == 0 && !raw.noise_ratio.is_one()) result = without_excess(frame, k, at_x, at_y, result);
        out.signal_e.at(at_x, at_y) = result - frame.dark_e[k];
      }
      const double kept = p.residual[0].at(cx, cy);
      out.residual_variance.at(cx, cy) = std::pow(frame.slope(luma), 2) * kept;
      double other = kept + 0.36 * left[1] + 0.5 * left[2], green = kept + 0.16 * left[1];
      if (options.sites_coincide) {
        const double common = frame.correlation(u) * std::sqrt(kept * left[1]);  // covariance of L and C1
        other += 1.2 * common;
        green -= 0.8 * common;
      } else {
        green += 0.25 * left[3];
      }
      const std::array<double, 3> of_colour{other, green, other};
      const std::array<double, 3> at{u[0], (u[1] + u[2]) / 2, u[3]};
      for (int k = 0; k < 3; ++k) {
        out.site_variance[k].at(cx, cy) = std::pow(frame.slope(at[k]) / frame.options.white_gain[k], 2) * of_colour[k];
      }
      if (measured) {
        const double ratio = static_cast<double>(frame.raw.noise_ratio.at(2 * cx, 2 * cy)) * options.variance_scale[0];
        const std::array<double, 3> mean_e{frame.y(0, cx, cy), (frame.y(1, cx, cy) + frame.y(2, cx, cy)) / 2,
                                           frame.y(3, cx, cy)};
        double of_luma = 0;
        for (int k = 0; k < 3; ++k) {
          const int site = k == 2 ? 3 : k;
          const double own = ratio * (std::max(mean_e[k], 0.3 * frame.dark_e[site] + 0.02) + frame.variance_e2[site]);
          out.site_variance[k].at(cx, cy) = own;
          of_luma += (k == 1 ? 0.18 : 0.04) * std::pow(options.white_gain[k], 2) * own;
        }
        out.residual_variance.at(cx, cy) = of_luma;
      }
      out.chroma_confidence.at(cx, cy) = factor((p.residual[1].at(cx, cy) + p.residual[2].at(cx, cy)) / 2);
    }
  }
  return out;
}

}  // namespace lowlux::reference
