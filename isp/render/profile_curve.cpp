#include "isp/render/profile_curve.h"

#include <algorithm>
#include <cmath>
#include <cstddef>

namespace lowlux::isp {
namespace {

constexpr double mid_grey = 0.18;

bool is_fraction(double v) { return v >= 0 && v <= 1; }

bool is_valid(std::span<const CurvePoint> points) {
  if (points.size() < 2 || points.size() > max_curve_points) return false;
  for (std::size_t i = 0; i < points.size(); ++i) {
    if (!is_fraction(points[i].x) || !is_fraction(points[i].y)) return false;
    if (i > 0 && !(points[i].x > points[i - 1].x)) return false;
  }
  const CurvePoint &first = points.front(), &last = points.back();
  return first.x == 0 && first.y == 0 && last.x == 1 && last.y == 1;
}

/// Returns the second derivatives of the natural spline at its points (Press et al., Numerical Recipes, section 3.3):
/// a tridiagonal system, solved by elimination.
std::vector<double> second_derivatives(std::span<const CurvePoint> p) {
  const std::size_t n = p.size();
  std::vector<double> out(n, 0.0), rest(n, 0.0);
  for (std::size_t i = 1; i + 1 < n; ++i) {
    const double before = p[i].x - p[i - 1].x, after = p[i + 1].x - p[i].x;
    const double part = before / (before + after), pivot = part * out[i - 1] + 2;
    out[i] = (part - 1) / pivot;
    const double turn = (p[i + 1].y - p[i].y) / after - (p[i].y - p[i - 1].y) / before;
    rest[i] = (6 * turn / (before + after) - part * rest[i - 1]) / pivot;
  }
  for (std::size_t i = n - 1; i-- > 0;) out[i] = out[i] * out[i + 1] + rest[i];
  out.front() = 0;
  return out;
}

float value_at(const ProfileCurve& curve, float x) {
  const float place = std::sqrt(std::clamp(x, 0.0f, 1.0f)) * ProfileCurve::steps;
  const int low = std::min(static_cast<int>(place), ProfileCurve::steps - 1);
  const auto at = static_cast<std::size_t>(low);
  return std::lerp(curve.value[at], curve.value[at + 1], place - static_cast<float>(low));
}

}  // namespace

std::vector<double> spline_values(std::span<const CurvePoint> points, std::span<const double> at) {
  const std::vector<double> bend = second_derivatives(points);
  std::vector<double> out;
  out.reserve(at.size());
  for (const double x : at) {
    const auto above = std::upper_bound(points.begin() + 1, points.end() - 1, x,
                                        [](double v, const CurvePoint& point) { return v < point.x; });
    const std::size_t i = static_cast<std::size_t>(above - points.begin());
    const double width = points[i].x - points[i - 1].x, a = (points[i].x - x) / width, b = 1 - a;
    const double cubic = ((a * a * a - a) * bend[i - 1] + (b * b * b - b) * bend[i]) * width * width / 6;
    out.push_back(std::clamp(a * points[i - 1].y + b * points[i].y + cubic, 0.0, 1.0));
  }
  return out;
}

std::optional<ProfileCurve> make_profile_curve(std::span<const CurvePoint> points) {
  if (!is_valid(points)) return std::nullopt;
  std::vector<double> at(ProfileCurve::steps + 1);
  for (std::size_t i = 0; i < at.size(); ++i) at[i] = std::pow(static_cast<double>(i) / ProfileCurve::steps, 2);
  const std::vector<double> values = spline_values(points, at);
  ProfileCurve out{.points = static_cast<int>(points.size())};
  for (std::size_t i = 0; i < values.size(); ++i) out.value[i] = static_cast<float>(values[i]);
  const auto reached = std::find_if(values.begin(), values.end(), [](double y) { return y >= mid_grey; });
  out.mid_grey = std::max(at[static_cast<std::size_t>(reached - values.begin())], 1e-3);
  return out;
}

void apply_profile_curve(const ProfileCurve& curve, float (&rgb)[3]) {
  const auto [least, most] = std::minmax({std::max(rgb[0], 0.0f), std::max(rgb[1], 0.0f), std::max(rgb[2], 0.0f)});
  const float low = value_at(curve, least), high = value_at(curve, most), range = std::min(most, 1.0f) - least;
  for (float& channel : rgb) {
    const float part = range > 0 ? std::clamp((std::min(channel, 1.0f) - least) / range, 0.0f, 1.0f) : 0;
    channel = low + part * (high - low) + std::min(channel, 0.0f);
  }
}

}  // namespace lowlux::isp
