#include "isp/model/appearance/lightness_match.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "isp/model/appearance/bracketed_root.h"

namespace lowlux::isp {
namespace {

constexpr double max_octaves = 10;
constexpr double tolerance = 1e-12;  // relative to the signal of white

struct Excitation {
  Vector3 cones;
  double rods;
};

Excitation times(const Excitation& e, double scale) {
  return {{scale * e.cones[0], scale * e.cones[1], scale * e.cones[2]}, scale * e.rods};
}

/// Returns the octaves that bring `signal` to the target, within the limit of max_octaves; the signal rises
/// monotonically.
double octaves_to(double target, const Excitation& e, const AchromaticSignal& signal) {
  const auto excess = [&](double octaves) {
    const Excitation scaled = times(e, std::exp2(octaves));
    return signal(scaled.cones, scaled.rods) - target;
  };
  const Evaluated here{0, excess(0)};
  if (std::fabs(here.f) <= tolerance) return 0;
  const double farthest = here.f < 0 ? max_octaves : -max_octaves;
  const Evaluated end{farthest, excess(farthest)};
  if ((end.f > 0) == (here.f > 0)) return farthest;
  return bracketed_root(excess, here, end, tolerance);
}

AchromaticSignal above_black(const AchromaticSignal& signal) {
  const double black = signal({}, 0), white = signal({1, 1, 1}, 1) - black;
  return [=](const Vector3& cones, double rods) { return (signal(cones, rods) - black) / white; };
}

}  // namespace

ColourMap lightness_match(const SeenScene& scene, AchromaticSignal dark, AchromaticSignal daylight) {
  const Vector3 white = xyz_to_hpe * scene.white;
  return colour_map([scene, white, dark = std::move(dark), daylight = std::move(daylight)](const Vector3& xyz) {
    const double sign = xyz[1] < 0 ? -1 : 1;
    const Vector3 positive{sign * xyz[0], sign * xyz[1], sign * xyz[2]};
    const Vector3 response = xyz_to_hpe * positive;
    Excitation e{{}, relative_scotopic(scene, positive)};
    for (int i = 0; i < 3; ++i) e.cones[i] = std::max(0.0, response[i] / white[i]);
    const double scale = std::exp2(octaves_to(dark(e.cones, e.rods), e, daylight));
    return Vector3{scale * xyz[0], scale * xyz[1], scale * xyz[2]};
  });
}

Result<ColourMap> lightness_match(const ViewingConditions& conditions, AchromaticModel model) {
  const auto scene = seen_scene(conditions);
  if (!scene) return tl::make_unexpected(scene.error());
  const auto signal_at = [&](double adaptation_cd_m2) {
    return above_black(model(adaptation_cd_m2, conditions.colour_temperature_k));
  };
  return lightness_match(*scene, signal_at(std::min(scene->adaptation_cd_m2, daylight_adaptation_cd_m2)),
                         signal_at(daylight_adaptation_cd_m2));
}

}  // namespace lowlux::isp
