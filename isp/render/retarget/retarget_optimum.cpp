#include "isp/render/retarget/retarget_optimum.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "isp/render/output_space.h"

namespace lowlux::isp {
namespace {

constexpr int max_steps = 100;
constexpr double smallest_step = 1e-7;    // of the code range
constexpr double derivative_step = 1e-5;  // of the code range: the error of a forward difference is then as small
constexpr double largest_damping = 1e9;   // of the mean curvature: steps are then negligible
constexpr double min_damping = 1e-9;      // keeps flat directions from being singular
constexpr int residuals = 6;

using Residual = std::array<double, residuals>;

/// Holds directions and tolerances of CIE 94 about a colour.
struct Tolerance {
  Lab centre;
  double along_a = 1, along_b = 0;
  double chroma = 1, hue = 1;

  explicit Tolerance(const Lab& at) : centre(at) {
    const double c = std::hypot(at.a, at.b);
    chroma += 0.045 * c;
    hue += 0.015 * c;
    if (c <= 1e-9) return;
    along_a = at.a / c;
    along_b = at.b / c;
  }

  Vector3 difference(const Lab& other) const {
    const double a = other.a - centre.a, b = other.b - centre.b;
    return {other.l - centre.l, (along_a * a + along_b * b) / chroma, (along_a * b - along_b * a) / hue};
  }
};

struct Colours {
  Matrix3 to_xyz = rgb_to_xyz(primaries_rec709).value();
  Xyz white = xyz_of(to_xyz * Vector3{1, 1, 1});
};

const Colours& colours() {
  static const Colours all;
  return all;
}

Vector3 light_of(const Vector3& code) {
  return {decode_transfer(OutputSpace::srgb, code[0]), decode_transfer(OutputSpace::srgb, code[1]),
          decode_transfer(OutputSpace::srgb, code[2])};
}

/// Represents the optimisation problem of one source colour.
class Problem {
 public:
  Problem(const AppearanceMatch& match, const Vector3& source)
      : match_(match), seen_(lab_seen(match.seen_source, light_of(source))), own_(lab_of_light(light_of(source))) {}

  Residual at(const Vector3& code) const {
    const Vector3 light = light_of(code);
    const double black = match_.display_black;
    Vector3 emitted{};
    for (std::size_t c = 0; c < 3; ++c) emitted[c] = black + (1 - black) * light[c];
    const Vector3 seen = seen_.difference(lab_seen(match_.seen_display, emitted));
    const Vector3 own = own_.difference(lab_of_light(light));
    const MatchWeights& w = match_.weights;
    const double f = std::sqrt(w.faithfulness);
    return {w.lightness * seen[0],    w.chroma * seen[1],    w.hue * seen[2],
            f * w.lightness * own[0], f * w.chroma * own[1], f * w.hue * own[2]};
  }

 private:
  static Lab lab_of_light(const Vector3& light) { return lab_of(xyz_of(colours().to_xyz * light), colours().white); }
  static Lab lab_seen(const ColourMap& seen, const Vector3& light) {
    return lab_of(seen(xyz_of(colours().to_xyz * light)), colours().white);
  }

  const AppearanceMatch& match_;
  Tolerance seen_;
  Tolerance own_;
};

double squares(const Residual& r) {
  double sum = 0;
  for (const double value : r) sum += value * value;
  return sum;
}

/// Approximates the cost about the current colour by x' H x / 2 + g' x.
struct Quadratic {
  Matrix3 h{};
  Vector3 g{};
};

Quadratic quadratic_at(const Problem& problem, const Vector3& code, const Residual& r) {
  std::array<Residual, 3> slope;
  for (std::size_t k = 0; k < 3; ++k) {
    Vector3 moved = code;
    const double step = code[k] < 0.5 ? derivative_step : -derivative_step;  // inwards: the models end at the cube
    moved[k] += step;
    const Residual there = problem.at(moved);
    for (std::size_t i = 0; i < residuals; ++i) slope[k][i] = (there[i] - r[i]) / step;
  }
  Quadratic q;
  for (std::size_t i = 0; i < residuals; ++i) {
    for (std::size_t j = 0; j < 3; ++j) {
      q.g[j] += slope[j][i] * r[i];
      for (std::size_t k = 0; k < 3; ++k) q.h[j][k] += slope[j][i] * slope[k][i];
    }
  }
  return q;
}

/// Returns the minimum of a strictly convex quadratic within the box low..high, which holds 0: one coordinate after
/// another, each to its own optimum, which converges for every such matrix.
Vector3 min_in_box(const Quadratic& q, const Vector3& low, const Vector3& high) {
  constexpr int max_sweeps = 500;
  Vector3 x{};
  for (int sweep = 0; sweep < max_sweeps; ++sweep) {
    double change = 0;
    for (std::size_t k = 0; k < 3; ++k) {
      const double slope = (q.h * x)[k] + q.g[k];
      const double next = std::clamp(x[k] - slope / q.h[k][k], low[k], high[k]);
      change = std::max(change, std::abs(next - x[k]));
      x[k] = next;
    }
    if (change < 0.01 * smallest_step) break;
  }
  return x;
}

Vector3 step_from(const Quadratic& q, double damping, const Vector3& code) {
  Quadratic damped = q;
  const double mean = (q.h[0][0] + q.h[1][1] + q.h[2][2]) / 3 + 1e-12;
  Vector3 low{}, high{};
  for (std::size_t k = 0; k < 3; ++k) {
    damped.h[k][k] += damping * mean;
    low[k] = -code[k];
    high[k] = 1 - code[k];
  }
  return min_in_box(damped, low, high);
}

double largest(const Vector3& v) { return std::max({std::abs(v[0]), std::abs(v[1]), std::abs(v[2])}); }

/// Returns whether the cost would fall beyond a bound at which the colour lies, by more than 1e-3 units of the squared
/// difference per hundredth of the code range.
bool is_held(const Quadratic& q, const Vector3& code) {
  constexpr double clear_slope = 0.1;
  for (std::size_t k = 0; k < 3; ++k) {
    if (code[k] <= 0 && q.g[k] > clear_slope) return true;
    if (code[k] >= 1 && q.g[k] < -clear_slope) return true;
  }
  return false;
}

}  // namespace

double match_cost(const AppearanceMatch& match, const Vector3& source, const Vector3& shown) {
  return squares(Problem(match, source).at(shown));
}

MatchedColour closest_displayable(const AppearanceMatch& match, const Vector3& source) {
  MatchedColour out;
  for (std::size_t c = 0; c < 3; ++c) out.code[c] = std::isnan(source[c]) ? 0 : std::clamp(source[c], 0.0, 1.0);
  const Problem problem(match, out.code);
  Residual r = problem.at(out.code);
  out.cost = squares(r);
  Quadratic q = quadratic_at(problem, out.code, r);
  double damping = 1e-3;
  while (out.steps < max_steps && !out.converged && damping < largest_damping) {
    ++out.steps;
    const Vector3 step = step_from(q, damping, out.code);
    out.converged = largest(step) < smallest_step;
    Vector3 next{};
    for (std::size_t c = 0; c < 3; ++c) next[c] = std::clamp(out.code[c] + step[c], 0.0, 1.0);
    const Residual there = problem.at(next);
    const double cost = squares(there);
    if (cost >= out.cost) {
      damping *= 8;
      continue;
    }
    out.code = next;
    out.cost = cost;
    r = there;
    q = quadratic_at(problem, next, r);
    damping = std::max(damping / 8, min_damping);
  }
  out.held = is_held(q, out.code);
  return out;
}

}  // namespace lowlux::isp
