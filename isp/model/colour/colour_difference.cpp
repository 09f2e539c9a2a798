#include "isp/model/colour/colour_difference.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace lowlux::isp {
namespace {

constexpr double radians_per_degree = std::numbers::pi / 180.0;

/// Returns the hue angle in [0, 360) degrees; 0 for a grey.
double hue_degrees(double a, double b) {
  if (a == 0 && b == 0) return 0;
  const double h = std::atan2(b, a) / radians_per_degree;
  return h < 0 ? h + 360 : h;
}

struct HuePair {
  double difference;  // degrees, -180..180
  double mean;        // degrees, on the shorter arc
};

/// Compares hues by Sharma et al. 2005, Eq. 10 and 14.
HuePair compare_hues(double h1, double h2, bool one_is_grey) {
  if (one_is_grey) return {0, h1 + h2};
  const double d = h2 - h1;
  if (std::fabs(d) <= 180) return {d, 0.5 * (h1 + h2)};
  const double sum = h1 + h2;
  return {d > 180 ? d - 360 : d + 360, 0.5 * (sum < 360 ? sum + 360 : sum - 360)};
}

/// Returns c^7 / (c^7 + 25^7).
double chroma_ratio(double c) {
  const double c2 = c * c, c7 = c2 * c2 * c2 * c;
  return c7 / (c7 + 6103515625.0);
}

}  // namespace

double delta_e_ab(const Lab& first, const Lab& second) {
  const double l = first.l - second.l, a = first.a - second.a, b = first.b - second.b;
  return std::sqrt(l * l + a * a + b * b);  // std::hypot of three arguments loses NaN in libstdc++ 12
}

double delta_e_94c(const Lab& reference, const Lab& test) {
  const double chroma = std::hypot(reference.a, reference.b);
  const double delta_c = chroma - std::hypot(test.a, test.b);
  const double delta_a = reference.a - test.a, delta_b = reference.b - test.b;
  const double delta_h2 = std::max(delta_a * delta_a + delta_b * delta_b - delta_c * delta_c, 0.0);  // NaN stays NaN
  return std::hypot(delta_c / (1 + 0.045 * chroma), std::sqrt(delta_h2) / (1 + 0.015 * chroma));
}

double ciede2000(const Lab& first, const Lab& second) {
  const double mean_c = 0.5 * (std::hypot(first.a, first.b) + std::hypot(second.a, second.b));
  const double g = 0.5 * (1 - std::sqrt(chroma_ratio(mean_c)));
  const double a1 = (1 + g) * first.a;
  const double a2 = (1 + g) * second.a;
  const double c1 = std::hypot(a1, first.b);
  const double c2 = std::hypot(a2, second.b);
  const HuePair hue = compare_hues(hue_degrees(a1, first.b), hue_degrees(a2, second.b), c1 * c2 == 0);

  const double delta_l = second.l - first.l;
  const double delta_c = c2 - c1;
  const double delta_h = 2 * std::sqrt(c1 * c2) * std::sin(0.5 * hue.difference * radians_per_degree);

  const double l_offset = 0.5 * (first.l + second.l) - 50;
  const double mean_c_prime = 0.5 * (c1 + c2);
  const double t = 1 - 0.17 * std::cos((hue.mean - 30) * radians_per_degree) +
                   0.24 * std::cos(2 * hue.mean * radians_per_degree) +
                   0.32 * std::cos((3 * hue.mean + 6) * radians_per_degree) -
                   0.20 * std::cos((4 * hue.mean - 63) * radians_per_degree);
  const double s_l = 1 + 0.015 * l_offset * l_offset / std::sqrt(20 + l_offset * l_offset);
  const double s_c = 1 + 0.045 * mean_c_prime;
  const double s_h = 1 + 0.015 * mean_c_prime * t;
  const double blue_angle = (hue.mean - 275) / 25;
  const double delta_theta = 30 * std::exp(-blue_angle * blue_angle);
  const double r_t = -2 * std::sqrt(chroma_ratio(mean_c_prime)) * std::sin(2 * delta_theta * radians_per_degree);

  const double l = delta_l / s_l;
  const double c = delta_c / s_c;
  const double h = delta_h / s_h;
  return std::sqrt(std::fmax(0, l * l + c * c + h * h + r_t * c * h));
}

}  // namespace lowlux::isp
