#include "isp/merge/stars/star_transform.h"

#include <algorithm>
#include <cmath>

#include "isp/merge/stars/normal_equations.h"

namespace lowlux::merge {
namespace {

constexpr int max_parameters = 20;

/// Rows of both coordinates: what each parameter adds to them.
struct Basis {
  std::array<double, max_parameters> x{};
  std::array<double, max_parameters> y{};
};

Point cube(const Point& u) {
  const double square = u.x * u.x + u.y * u.y;
  return {square * u.x, square * u.y};
}

/// Returns how the radial distortion moves a place, for k of 1 and the similarity of these coefficients.
Point radial_part(const std::vector<double>& coefficients, const Point& u) {
  const Similarity s{coefficients[0], coefficients[1], coefficients[2], coefficients[3]};
  const Point after = cube(s.at(u)), before = cube(u);
  return {after.x - (s.a * before.x - s.b * before.y), after.y - (s.b * before.x + s.a * before.y)};
}

/// @param coefficients those of the similarity, for the radial model
Basis basis_of(TransformModel model, const std::vector<double>& coefficients, const Point& u) {
  Basis out;
  if (model == TransformModel::similarity || model == TransformModel::radial) {
    out.x = {u.x, -u.y, 1, 0};
    out.y = {u.y, u.x, 0, 1};
    if (model == TransformModel::radial) {
      const Point part = radial_part(coefficients, u);
      out.x[4] = part.x;
      out.y[4] = part.y;
    }
    return out;
  }
  const int order = model == TransformModel::quadratic ? 2 : 3;
  const auto half = static_cast<std::size_t>(parameters_of(model) / 2);
  std::size_t k = 0;
  double power_y = 1;
  for (int j = 0; j <= order; ++j, power_y *= u.y) {
    double term = power_y;
    for (int i = 0; i + j <= order; ++i, term *= u.x, ++k) {
      out.x[k] = term;
      out.y[half + k] = term;
    }
  }
  return out;
}

double product(const std::array<double, max_parameters>& row, const std::vector<double>& coefficients) {
  double sum = 0;
  for (std::size_t k = 0; k < coefficients.size(); ++k) sum += row[k] * coefficients[k];
  return sum;
}

double variance_of(const std::array<double, max_parameters>& row, const StarTransform& transform) {
  const std::size_t n = transform.coefficients.size();
  double sum = 0;
  for (std::size_t i = 0; i < n; ++i) {
    for (std::size_t j = 0; j < n; ++j) sum += row[i] * transform.covariance[i * n + j] * row[j];
  }
  return sum;
}

/// Solves once, the radial part as it is for the similarity of `start`.
std::optional<LeastSquares> solve_once(const StarTransform& start, const std::vector<StarPair>& pairs) {
  const auto n = static_cast<std::size_t>(parameters_of(start.model));
  NormalEquations equations(parameters_of(start.model));
  for (const StarPair& pair : pairs) {
    const auto scaled = [&](const Point& p) {
      return Point{(p.x - start.centre.x) / start.unit_px, (p.y - start.centre.y) / start.unit_px};
    };
    const Point u = scaled(pair.reference), v = scaled(pair.frame);
    const Basis basis = basis_of(start.model, start.coefficients, u);
    const double weight = start.unit_px * start.unit_px / pair.variance_px2;
    equations.add({basis.x.data(), n}, v.x, weight);
    equations.add({basis.y.data(), n}, v.y, weight);
  }
  return equations.solve();
}

}  // namespace

const char* name_of(TransformModel model) {
  constexpr std::array<const char*, 4> names{"similarity", "radial", "quadratic", "cubic"};
  return names[static_cast<std::size_t>(model)];
}

Point StarTransform::at(const Point& reference) const {
  const Point u{(reference.x - centre.x) / unit_px, (reference.y - centre.y) / unit_px};
  const Basis basis = basis_of(model, coefficients, u);
  return {centre.x + unit_px * product(basis.x, coefficients), centre.y + unit_px * product(basis.y, coefficients)};
}

double StarTransform::standard_error_px(const Point& reference) const {
  const Point u{(reference.x - centre.x) / unit_px, (reference.y - centre.y) / unit_px};
  const Basis basis = basis_of(model, coefficients, u);
  return unit_px * std::sqrt((variance_of(basis.x, *this) + variance_of(basis.y, *this)) / 2);
}

std::optional<TransformFit> fit_transform(TransformModel model, const std::vector<StarPair>& pairs, const Point& centre,
                                          double unit_px) {
  TransformFit fit{.transform = {.model = model, .centre = centre, .unit_px = unit_px}};
  StarTransform& transform = fit.transform;
  if (model == TransformModel::radial) {  // not linear: begins with the similarity
    const std::optional<TransformFit> start = fit_transform(TransformModel::similarity, pairs, centre, unit_px);
    if (!start) return std::nullopt;
    transform.coefficients = start->transform.coefficients;
    transform.coefficients.push_back(0);
  }
  for (int round = 0; round < (model == TransformModel::radial ? 4 : 1); ++round) {
    std::optional<LeastSquares> solution = solve_once(transform, pairs);
    if (!solution) return std::nullopt;
    transform.coefficients = std::move(solution->coefficients);
    transform.covariance = std::move(solution->covariance);
  }
  for (const StarPair& pair : pairs) {
    const Point p = transform.at(pair.reference);
    const double dx = p.x - pair.frame.x, dy = p.y - pair.frame.y;
    fit.chi_square += (dx * dx + dy * dy) / pair.variance_px2;
  }
  return fit;
}

std::optional<Similarity> fit_similarity(const std::vector<StarPair>& pairs) {
  Point from, to;
  const auto count = static_cast<double>(pairs.size());
  for (const StarPair& pair : pairs) {
    from = {from.x + pair.reference.x / count, from.y + pair.reference.y / count};
    to = {to.x + pair.frame.x / count, to.y + pair.frame.y / count};
  }
  double along = 0, across = 0, square = 0;
  for (const StarPair& pair : pairs) {
    const Point p{pair.reference.x - from.x, pair.reference.y - from.y}, q{pair.frame.x - to.x, pair.frame.y - to.y};
    along += p.x * q.x + p.y * q.y;
    across += p.x * q.y - p.y * q.x;
    square += p.x * p.x + p.y * p.y;
  }
  if (!(square > 0)) return std::nullopt;
  Similarity out{along / square, across / square};
  out.dx = to.x - out.a * from.x + out.b * from.y;
  out.dy = to.y - out.b * from.x - out.a * from.y;
  return out;
}

Motion motion_of(const StarTransform& transform, int width, int height, int spacing_px) {
  Motion motion = no_motion(width, height, spacing_px);
  std::array<double, 2> squares{}, counts{};  // of all nodes, of those within the frame
  for (int j = 0; j < motion.dx_px.height(); ++j) {
    for (int i = 0; i < motion.dx_px.width(); ++i) {
      const Point node{static_cast<double>(i) * spacing_px, static_cast<double>(j) * spacing_px};
      const Point p = transform.at(node);
      motion.dx_px.at(i, j) = static_cast<float>(p.x - node.x);
      motion.dy_px.at(i, j) = static_cast<float>(p.y - node.y);
      const double error = transform.standard_error_px(node);
      const bool inside = p.x >= 0 && p.y >= 0 && p.x <= width - 1 && p.y <= height - 1;
      for (std::size_t k = 0; k < (inside ? 2 : 1); ++k) {
        squares[k] += error * error;
        counts[k] += 1;
      }
    }
  }
  const std::size_t k = counts[1] > 0 ? 1 : 0;
  motion.standard_error_px = std::sqrt(squares[k] / counts[k]);
  return motion;
}

}  // namespace lowlux::merge
