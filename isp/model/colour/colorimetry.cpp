#include "isp/model/colour/colorimetry.h"

#include <cmath>

namespace lowlux::isp {
namespace {

constexpr Matrix3 bradford{{{0.8951, 0.2664, -0.1614}, {-0.7502, 1.7135, 0.0367}, {0.0389, -0.0685, 1.0296}}};

/// Computes CIE 15:2018 Eq. 8.6: cube root above (24/116)^3, a line of equal value and slope below.
double lab_f(double ratio) {
  constexpr double knee = (24.0 / 116.0) * (24.0 / 116.0) * (24.0 / 116.0);
  return ratio > knee ? std::cbrt(ratio) : (841.0 / 108.0) * ratio + 16.0 / 116.0;
}

}  // namespace

std::optional<Xy> xy_of(const Xyz& colour) {
  const double sum = colour.x + colour.y + colour.z;
  if (!(sum > 0) || !std::isfinite(sum)) return std::nullopt;
  return Xy{colour.x / sum, colour.y / sum};
}

std::optional<Xyz> xyz_of(const Xy& xy, double y) {
  if (!(xy.y > 0) || !std::isfinite(xy.x) || !std::isfinite(xy.y) || !std::isfinite(y)) return std::nullopt;
  return Xyz{xy.x * y / xy.y, y, (1 - xy.x - xy.y) * y / xy.y};
}

std::optional<UvPrime> uv_prime_of(const Xy& xy) {
  const double denominator = -2 * xy.x + 12 * xy.y + 3;
  const UvPrime uv{4 * xy.x / denominator, 9 * xy.y / denominator};
  if (!(denominator > 0) || !std::isfinite(uv.u) || !std::isfinite(uv.v)) return std::nullopt;
  return uv;
}

std::optional<Xy> xy_of(const UvPrime& uv) {
  const double denominator = 6 * uv.u - 16 * uv.v + 12;
  const Xy xy{9 * uv.u / denominator, 4 * uv.v / denominator};
  if (!(denominator > 0) || !std::isfinite(xy.x) || !std::isfinite(xy.y)) return std::nullopt;
  return xy;
}

std::optional<Matrix3> bradford_adaptation(const Xy& from, const Xy& to) {
  const auto white_from = xyz_of(from);
  const auto white_to = xyz_of(to);
  const auto back = inverse(bradford);
  if (!white_from || !white_to || !back) return std::nullopt;
  const Vector3 cone_from = bradford * vector_of(*white_from);
  const Vector3 cone_to = bradford * vector_of(*white_to);
  Vector3 ratio{};
  for (int i = 0; i < 3; ++i) {
    if (!(cone_from[i] > 0) || !(cone_to[i] > 0)) return std::nullopt;
    ratio[i] = cone_to[i] / cone_from[i];
  }
  return *back * diagonal3(ratio) * bradford;
}

std::optional<Matrix3> rgb_to_xyz(const RgbPrimaries& primaries) {
  const auto red = xyz_of(primaries.red);
  const auto green = xyz_of(primaries.green);
  const auto blue = xyz_of(primaries.blue);
  const auto white = xyz_of(primaries.white);
  if (!red || !green || !blue || !white) return std::nullopt;
  const Matrix3 columns{{{red->x, green->x, blue->x}, {red->y, green->y, blue->y}, {red->z, green->z, blue->z}}};
  const auto back = inverse(columns);
  if (!back) return std::nullopt;
  return columns * diagonal3(*back * vector_of(*white));
}

Lab lab_of(const Xyz& colour, const Xyz& white) {
  const double fx = lab_f(colour.x / white.x);
  const double fy = lab_f(colour.y / white.y);
  const double fz = lab_f(colour.z / white.z);
  return {116 * fy - 16, 500 * (fx - fy), 200 * (fy - fz)};
}

}  // namespace lowlux::isp
