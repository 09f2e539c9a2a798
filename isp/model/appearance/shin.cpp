#include "isp/model/appearance/shin.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "isp/model/appearance/bracketed_root.h"
#include "isp/model/appearance/seen_scene.h"
#include "isp/model/vision/mesopic.h"

namespace lowlux::isp {
namespace {

constexpr double white_reflectance = 0.9;
constexpr double min_coefficient = 0.05;  // lower limit of alpha, l and m in the inverse
constexpr Vector3 equal_energy_cones{2.0 / 3.0, 1.0 / 3.0, 1};
constexpr Matrix3 cones_to_opponent{{{1, 1, 0}, {1, -2, 0}, {1, 1, -1}}};
constexpr Matrix3 published_opponent_to_xyz{{{1.008, 2.149, -0.212}, {1, 0, 0}, {1, 0, -1}}};

double power_of_rods(const ShinEye& eye, double rods) {
  return eye.rod_white * eye.white_y * std::pow(rods / eye.white_scotopic, eye.gamma);
}

/// Holds the inputs of the inverse.
struct Problem {
  OpponentSignals signals;
  ShinCoefficients c;
  ShinEye eye;
};

/// Returns L + M, L - 2 M, L + M - S for rods at a level.
Vector3 opponent_at(const Problem& p, double rods) {
  const double cones = (p.signals.a - p.c.beta * power_of_rods(p.eye, rods)) / p.c.alpha;
  return {std::max(0.0, cones), (p.signals.rg - p.c.a * rods) / p.c.l, (p.signals.by - p.c.b * rods) / p.c.m};
}

double rods_of(const Vector3& xyz) { return scotopic_luminance(xyz_of(xyz)); }

/// Returns the rods' level of the resulting colour minus the assumed level of the rods: 0 where the two agree.
double excess_at(const Problem& p, double rods) { return rods_of(p.eye.from_opponent * opponent_at(p, rods)) - rods; }

struct Solution {
  double rods;
  bool exists;
};

/// Finds the level of the rods at which the excess is 0. The excess at 0 is never negative, and falls with rods unless
/// a or b are large.
Solution self_consistent_rods(const Problem& p) {
  const auto excess = [&](double rods) { return excess_at(p, rods); };
  const Evaluated none{0, excess(0)};
  const bool rods_matter = p.c.beta != 0 || p.c.a != 0 || p.c.b != 0;
  if (!rods_matter || none.f == 0) return {none.f, true};
  Evaluated low = none, high{none.f, excess(none.f)};
  for (int i = 0; high.f > 0; ++i) {
    if (i == 40) return {none.f, false};
    low = high;
    high.x *= 2;
    high.f = excess(high.x);
  }
  return {bracketed_root(excess, low, high, 1e-15 * p.eye.white_scotopic), true};
}

Problem bounded(const OpponentSignals& signals, const ShinCoefficients& c, const ShinEye& eye) {
  Problem p{signals, c, eye};
  p.c.alpha = std::max(c.alpha, min_coefficient);
  p.c.l = std::max(c.l, min_coefficient);
  p.c.m = std::max(c.m, min_coefficient);
  return p;
}

bool is_within_bounds(const Problem& p, const ShinCoefficients& asked, double rods) {
  const bool floored = p.c.alpha != asked.alpha || p.c.l != asked.l || p.c.m != asked.m;
  const double cones = p.signals.a - p.c.beta * power_of_rods(p.eye, rods);
  return !floored && cones >= -1e-10 * p.eye.white_y;  // rounding of the rods' root at black
}

}  // namespace

ShinEye shin_eye(const ShinObserver& observer) {
  const Vector3 white = xyz_to_smith_pokorny * vector_of(observer.white);
  Matrix3 adapt = identity3(), undo = identity3();
  if (observer.adaptation == ShinAdaptation::to_white) {
    for (int i = 0; i < 3; ++i) {
      adapt[i][i] = equal_energy_cones[i] * observer.white.y / white[i];
      undo[i][i] = 1 / adapt[i][i];
    }
  }
  const Matrix3 from_cones = *inverse(xyz_to_smith_pokorny);
  const Matrix3 opponent_to_xyz =
      observer.matrix == ShinMatrix::exact ? from_cones * *inverse(cones_to_opponent) : published_opponent_to_xyz;
  return {.to_opponent = cones_to_opponent * adapt * xyz_to_smith_pokorny,
          .from_opponent = from_cones * undo * xyz_to_smith_pokorny * opponent_to_xyz,
          .white_y = observer.white.y,
          .white_scotopic = scotopic_luminance(observer.white),
          .rod_white = observer.rod_white,
          .gamma = observer.gamma};
}

double shin_level(double white_cd_m2, ShinUnits units) {
  return units == ShinUnits::lux ? std::numbers::pi * white_cd_m2 / white_reflectance : white_cd_m2;
}

OpponentSignals shin_forward(const Xyz& colour, const ShinCoefficients& c, const ShinEye& eye) {
  const Vector3 opponent = eye.to_opponent * vector_of(colour);
  const double rods = scotopic_luminance(colour);
  return {c.alpha * opponent[0] + c.beta * power_of_rods(eye, rods), c.l * opponent[1] + c.a * rods,
          c.m * opponent[2] + c.b * rods};
}

Xyz shin_daylight(const OpponentSignals& signals, const ShinEye& eye) {
  return xyz_of(eye.from_opponent * Vector3{signals.a, signals.rg, signals.by});
}

ShinInverse shin_inverse(const OpponentSignals& signals, const ShinCoefficients& c, const ShinEye& eye) {
  const Problem p = bounded(signals, c, eye);
  const Solution found = self_consistent_rods(p);
  return {xyz_of(p.eye.from_opponent * opponent_at(p, found.rods)), found.exists && is_within_bounds(p, c, found.rods)};
}

ShinInverse shin_inverse_published(const OpponentSignals& signals, const ShinCoefficients& c, const ShinEye& eye,
                                   double source_scotopic) {
  const Problem p = bounded(signals, c, eye);
  const double rods = std::max(0.0, source_scotopic);
  return {xyz_of(p.eye.from_opponent * opponent_at(p, rods)), is_within_bounds(p, c, rods)};
}

namespace {

Result<ColourMap> shin_map(const ViewingConditions& conditions) {
  const auto scene = seen_scene(conditions);
  if (!scene) return tl::make_unexpected(scene.error());
  const ShinTable& table = conditions.shin ? *conditions.shin : shin_substitute();
  const ShinCoefficients c = shin_coefficients(table, shin_level(scene->white_cd_m2, conditions.shin_units));
  return colour_map([c, eye = shin_eye({.white = xyz_of(scene->white)})](const Vector3& xyz) {
    return vector_of(shin_daylight(shin_forward(xyz_of(xyz), c, eye), eye));
  });
}

}  // namespace

AppearanceModel shin_appearance() {
  return {.name = "shin",
          .source = "Shin, Matsuki, Yaguchi & Shioiri 2004",
          .needs = "illuminance of the scene; a table of six coefficients",
          .limits =
              "the coefficients of the authors are not published; SHIN-SUB-1, which is fitted to their abstract, is "
              "used instead",
          .valid_from_cd_m2 = 0.003,
          .valid_to_cd_m2 = 286,
          .at = shin_map};
}

}  // namespace lowlux::isp
