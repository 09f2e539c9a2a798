#include "isp/merge/align/global_fit.h"

#include <algorithm>
#include <cmath>

#include "isp/merge/align/estimate.h"

namespace lowlux::merge {
namespace {

constexpr double half_weight_chi_square = 12;      // at which a tile has half of its weight; its mean is 2
constexpr double median_chi_square = 1.386294;     // of 2 degrees of freedom: 2 ln 2
constexpr double significant_chi_square = 20.515;  // of 5 degrees of freedom, exceeded by chance in 0.1 %
constexpr double prior_sigma = 0.01;  // of scale, shear and perspective: displacement at the corner / half diagonal
constexpr double light_sigma = 0.05;  // of the ratio of light that is stated: flicker, tolerances of shutters
constexpr double max_error_cells = 1.0 / 6;  // the linear model of a displacement holds within about one cell
constexpr int iterations = 4;
constexpr int min_tiles_of_perspective = 64;

/// The tiles of a grid with a fit, with what depends on their places alone.
struct Tiles {
  std::vector<const TileFit*> fits;
  std::vector<std::array<MotionStep, 2>> slopes;
  std::vector<double> weights;
};

/// Sums the weighted tiles for the first N parameters.
template <int N>
Measurement<N> sum_of(const Tiles& tiles, double inflation) {
  Measurement<N> sum;
  for (std::size_t t = 0; t < tiles.fits.size(); ++t) {
    const TileFit& fit = *tiles.fits[t];
    const auto& [jx, jy] = tiles.slopes[t];
    const double w = tiles.weights[t], w2 = w * w * inflation;
    for (int i = 0; i < N; ++i) {
      sum.score[i] += w * (jx[i] * fit.score[0] + jy[i] * fit.score[1]);
      const double kx = w * (jx[i] * fit.information[0] + jy[i] * fit.information[1]);
      const double ky = w * (jx[i] * fit.information[1] + jy[i] * fit.information[2]);
      const double mx = w2 * (jx[i] * fit.variance[0] + jy[i] * fit.variance[1]);
      const double my = w2 * (jx[i] * fit.variance[1] + jy[i] * fit.variance[2]);
      for (int j = 0; j <= i; ++j) {
        sum.information[i][j] += kx * jx[j] + ky * jy[j];
        sum.variance[i][j] += mx * jx[j] + my * jy[j];
      }
    }
  }
  for (int i = 0; i < N; ++i) {
    for (int j = i + 1; j < N; ++j) {
      sum.information[i][j] = sum.information[j][i];
      sum.variance[i][j] = sum.variance[j][i];
    }
  }
  return sum;
}

Shift displacement(const Tiles& tiles, std::size_t t, const MotionStep& step) {
  double dx = 0, dy = 0;
  for (int i = 0; i < motion_parameters; ++i) {
    dx += tiles.slopes[t][0][i] * step[i];
    dy += tiles.slopes[t][1][i] * step[i];
  }
  return {static_cast<float>(dx), static_cast<float>(dy)};
}

/// Sets the weights by the residuals after a step, and returns the inflation.
double weigh(Tiles& tiles, const MotionStep& step) {
  std::vector<double>& chi = tiles.weights;
  for (std::size_t t = 0; t < tiles.fits.size(); ++t) {
    const Shift d = displacement(tiles, t, step);
    chi[t] = chi_square_of(*tiles.fits[t],
                           residual_of(*tiles.fits[t], static_cast<double>(d.dx_px), static_cast<double>(d.dy_px)));
  }
  std::vector<double> sorted = chi;
  const auto middle = sorted.begin() + static_cast<std::ptrdiff_t>(sorted.size() / 2);
  std::nth_element(sorted.begin(), middle, sorted.end());
  const double inflation = std::max(1.0, *middle / median_chi_square);
  for (double& c : chi) c = 1 / (1 + c / (half_weight_chi_square * inflation));
  return inflation;
}

template <int N>
DisplacementEstimate<N> solve(const GlobalMotion& motion, Tiles& tiles, double max_error_px,
                              double undetermined_variance, double& inflation) {
  SmallVector<N> prior{}, before{};
  for (int i = rigid_parameters; i < N; ++i) {
    const double sigma = prior_sigma * motion.radius_px();
    prior[i] = 1 / (sigma * sigma);
    before[i] = motion.total()[i];
  }
  inflation = weigh(tiles, {});
  DisplacementEstimate<N> out;
  for (int k = 0; k < iterations; ++k) {
    out = estimate<N>(sum_of<N>(tiles, inflation), prior, before, max_error_px, undetermined_variance);
    MotionStep step{};
    std::copy(out.value.begin(), out.value.end(), step.begin());
    inflation = weigh(tiles, step);
  }
  return out;
}

/// Returns the chi-square of scale, shear and perspective.
double chi_square_of_rest(const DisplacementEstimate<motion_parameters>& all) {
  constexpr int n = motion_parameters - rigid_parameters;
  SmallVector<n> value{};
  SmallMatrix<n> covariance{};
  for (int i = 0; i < n; ++i) {
    value[i] = all.value[i + rigid_parameters];
    for (int j = 0; j < n; ++j) covariance[i][j] = all.covariance[i + rigid_parameters][j + rigid_parameters];
  }
  const SmallVector<n> white = solve_lower<n>(cholesky<n>(covariance), value);
  double sum = 0;
  for (const double w : white) sum += w * w;
  return sum;
}

template <int N>
void store(const DisplacementEstimate<N>& from, const Tiles& tiles, GlobalFit& fit) {
  fit.determined = from.determined;
  std::copy(from.value.begin(), from.value.end(), fit.step.begin());
  double variance = 0, squares = 0;
  for (std::size_t t = 0; t < tiles.fits.size(); ++t) {
    for (const MotionStep& j : tiles.slopes[t]) {
      for (int a = 0; a < N; ++a) {
        for (int b = 0; b < N; ++b) variance += j[a] * from.covariance[a][b] * j[b];
      }
    }
    const Shift d = displacement(tiles, t, fit.step);
    const auto dx = static_cast<double>(d.dx_px), dy = static_cast<double>(d.dy_px);
    fit.largest_px = std::max({fit.largest_px, std::fabs(dx), std::fabs(dy)});
    squares += dx * dx + dy * dy;
  }
  fit.mean_square_px2 = squares / (2 * static_cast<double>(tiles.fits.size()));
  fit.variance_px2 = variance / (2 * static_cast<double>(tiles.fits.size()));
}

double light_change(const Tiles& tiles, const TileGrid& grid, const std::vector<std::size_t>& places, double light,
                    double expected_light) {
  const double sigma = light_sigma * expected_light, prior = 1 / (sigma * sigma);
  double score = prior * (expected_light - light), information = prior;
  for (std::size_t t = 0; t < places.size(); ++t) {
    const auto& tile = grid.tiles[places[t]];
    const double noise = static_cast<double>(tile[rows::noise]) / light;  // sum w V light of the reference alone
    score += tiles.weights[t] * (static_cast<double>(tile[rows::light_score]) + noise);
    information += tiles.weights[t] * std::max(0.0, static_cast<double>(tile[rows::light_info]) - noise / light);
  }
  return score / information;
}

}  // namespace

std::array<double, 2> residual_of(const TileFit& fit, double dx_px, double dy_px) {
  return {fit.score[0] - fit.information[0] * dx_px - fit.information[1] * dy_px,
          fit.score[1] - fit.information[1] * dx_px - fit.information[2] * dy_px};
}

double chi_square_of(const TileFit& fit, const std::array<double, 2>& score) {
  const double floor = 1e-9 * (fit.variance[0] + fit.variance[2]);
  if (!(floor > 0)) return 0;  // a tile of too few cells, which states nothing
  const double xx = fit.variance[0] + floor, yy = fit.variance[2] + floor, xy = fit.variance[1];
  const double determinant = std::max(xx * yy - xy * xy, 1e-12 * xx * yy);
  return (yy * score[0] * score[0] - 2 * xy * score[0] * score[1] + xx * score[1] * score[1]) / determinant;
}

GlobalFit fit_global(const GlobalMotion& motion, const TileGrid& grid, const std::vector<TileFit>& fits,
                     MotionModel model, double undetermined_variance_px2, double light, double expected_light) {
  Tiles tiles;
  std::vector<std::size_t> places;
  for (std::size_t i = 0; i < fits.size(); ++i) {
    if (grid.tiles[i][rows::count] <= 0) continue;
    const int column = static_cast<int>(i) % grid.columns, row = static_cast<int>(i) / grid.columns;
    places.push_back(i);
    tiles.fits.push_back(&fits[i]);
    tiles.slopes.push_back(motion.slopes_at(column * grid.spacing_px(), row * grid.spacing_px()));
  }
  GlobalFit fit;
  if (places.empty()) return fit;
  tiles.weights.resize(places.size());
  const double max_error_px = max_error_cells * grid.cell_px;
  const auto rigid = solve<rigid_parameters>(motion, tiles, max_error_px, undetermined_variance_px2, fit.inflation);
  fit.is_rigid = true;
  store(rigid, tiles, fit);
  if (model != MotionModel::rigid && static_cast<int>(places.size()) >= min_tiles_of_perspective) {
    double inflation = 1;
    const auto all = solve<motion_parameters>(motion, tiles, max_error_px, undetermined_variance_px2, inflation);
    if (all.determined == motion_parameters &&
        (model == MotionModel::full || chi_square_of_rest(all) > significant_chi_square)) {
      fit.is_rigid = false;
      fit.inflation = inflation;
      fit.largest_px = 0;
      store(all, tiles, fit);
    } else {
      fit.inflation = weigh(tiles, fit.step);
    }
  }
  fit.light_change = light_change(tiles, grid, places, light, expected_light);
  return fit;
}

}  // namespace lowlux::merge
