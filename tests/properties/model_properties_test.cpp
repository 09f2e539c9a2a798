#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <string_view>

#include "isp/model/appearance/appearance_model.h"
#include "isp/model/appearance/seen_scene.h"
#include "isp/model/colour/colour_difference.h"
#include "isp/model/vision/mesopic.h"
#include "tests/properties/draws.h"

namespace lowlux::isp {
namespace {

using namespace properties;

Lab any_lab() { return {any_between(0, 100), any_between(-120, 120), any_between(-120, 120)}; }

RC_GTEST_PROP(ColourDifferenceProperty, OfTwoColoursIsTheSameBothWaysAndOfOneIsNone, ()) {
  const Lab a = any_lab(), b = any_lab();
  RC_ASSERT(ciede2000(a, a) == 0);
  RC_ASSERT(delta_e_ab(a, a) == 0);
  RC_ASSERT(delta_e_ab(a, b) == delta_e_ab(b, a));
  const double there = ciede2000(a, b), back = ciede2000(b, a);
  RC_ASSERT(there > 0 || delta_e_ab(a, b) == 0);
  RC_ASSERT(std::abs(there - back) <= 1e-12 * there);  // sums in another order
}

RC_GTEST_PROP(ColourDifferenceProperty, ADetourIsNoShorterInCielab, ()) {
  const Lab a = any_lab(), b = any_lab(), c = any_lab();
  RC_ASSERT(delta_e_ab(a, c) <= (delta_e_ab(a, b) + delta_e_ab(b, c)) * (1 + 1e-15));  // rounded roots
}

// The weights S_C >= S_H >= 1 of Delta E 94 go with the chroma of the reference.
RC_GTEST_PROP(ColourDifferenceProperty, ChromaticityOfDeltaE94IsWithinItsWeights, ()) {
  const Lab reference = any_lab(), test = any_lab();
  const double plain = std::hypot(test.a - reference.a, test.b - reference.b);
  const double weighed = delta_e_94c(reference, test);
  const double chroma = std::hypot(reference.a, reference.b);
  const double rounding = 3e-6;  // dH^2 is a difference of squares up to 1e5, whose rounding is 1e-11
  RC_ASSERT(weighed <= plain + rounding);
  RC_ASSERT(weighed >= plain / (1 + 0.045 * chroma) - rounding);
}

/// A field and the eye's answer to it, S/P where there is one root.
LuminancePair any_field() {
  const double photopic = any_decade(-7, 5);
  return {photopic, any_between(0.3, 50) * photopic};
}

RC_GTEST_PROP(MesopicProperty, TheStateIsARootAndRisesWithLight, ()) {
  const LuminancePair field = any_field();
  const MesopicState state = mesopic_state(field);
  RC_ASSERT(state.m >= 0 && state.m <= 1);
  RC_ASSERT(std::abs(state.luminance_cd_m2 - mesopic_luminance_cd_m2(state.m, field)) <= 1e-12 * state.luminance_cd_m2);
  RC_ASSERT(std::abs(std::clamp(mes2_response(state.luminance_cd_m2), 0.0, 1.0) - state.m) < 1e-11);
  const double more = any_between(1, 100);
  const MesopicState brighter = mesopic_state({more * field.photopic, more * field.scotopic});
  RC_ASSERT(brighter.m >= state.m - 1e-11);
}

RC_GTEST_PROP(MesopicProperty, LuminanceIsLinearAndBetweenThatOfConesAndOfRods, ()) {
  const double m = any_between(0, 1);
  const LuminancePair a = any_field(), b = any_field();
  const double of_a = mesopic_luminance_cd_m2(m, a), of_b = mesopic_luminance_cd_m2(m, b);
  const auto [low, high] = std::minmax(a.photopic, a.scotopic);
  RC_ASSERT(of_a >= low * (1 - 1e-15) && of_a <= high * (1 + 1e-15));
  const double share = any_between(-2, 2);
  const double of_both = mesopic_luminance_cd_m2(m, {a.photopic + share * b.photopic, a.scotopic + share * b.scotopic});
  RC_ASSERT(std::abs(of_both - (of_a + share * of_b)) <= 1e-13 * (of_a + 2 * of_b + high));
  RC_ASSERT(rod_fraction(m) >= rod_fraction(std::min(1.0, m + 0.01)));
}

RC_GTEST_PROP(MesopicProperty, PupilsNarrowWithLightAndLetMoreOfItThrough, ()) {
  const double dim = any_decade(-6, 5), bright = dim * any_between(1.01, 100);
  RC_ASSERT(pupil_diameter_mm(bright) <= pupil_diameter_mm(dim));
  RC_ASSERT(retinal_illuminance_td(bright) > retinal_illuminance_td(dim));
}

ViewingConditions any_conditions() {
  ViewingConditions out;
  out.white_cd_m2 = any_decade(-7, 5);
  out.white = {any_between(0.7, 1.3), 1, any_between(0.3, 1.6)};
  out.scotopic_ratio = any_between(0.3, 20);
  if (*rc::gen::arbitrary<bool>()) out.adaptation_cd_m2 = any_decade(-7, 5);
  if (*rc::gen::arbitrary<bool>()) out.colour_temperature_k = any_between(1000, 20000);
  return out;
}

Xyz any_light() {
  const Matrix3 to_xyz = *rgb_to_xyz(primaries_rec709);
  return xyz_of(to_xyz * Vector3{any_between(0, 2), any_between(0, 2), any_between(0, 2)});
}

double any_odd() {
  const double huge = std::numeric_limits<double>::max();
  return *rc::gen::element(0.0, 1.0, -1.0, 1e-300, 1e30, -1e30, huge, -huge);
}

bool is_finite(const Xyz& c) { return std::isfinite(c.x) && std::isfinite(c.y) && std::isfinite(c.z); }

RC_GTEST_PROP(AppearanceProperty, FiniteColoursStayFiniteAndBlackStaysBlack, ()) {
  const ViewingConditions conditions = any_conditions();
  const Xyz light = any_light();
  std::array<Xyz, 8> odd{};
  for (Xyz& colour : odd) colour = {any_odd(), any_odd(), any_odd()};
  for (const AppearanceModel& model : appearance_models()) {
    const auto map = model.at(conditions);
    RC_ASSERT(map.has_value());
    RC_ASSERT(is_finite((*map)(light)));
    for (const Xyz& colour : odd) RC_ASSERT(is_finite((*map)(colour)));
    for (const double channel : vector_of((*map)({0, 0, 0}))) RC_ASSERT(std::abs(channel) < 1e-12);
  }
}

RC_GTEST_PROP(AppearanceProperty, ModelsKeepWhatTheySayTheyKeep, ()) {
  const ViewingConditions conditions = any_conditions();
  const auto scene = seen_scene(conditions);
  RC_ASSERT(scene.has_value());
  const Xyz light = any_light();
  RC_PRE(light.y > 1e-3);
  const auto seen = [&](std::string_view model) {
    return appearance_model_named(model)->at(conditions).value()(light);
  };
  for (const char* name : {"hunt", "kwak"}) {  // one factor for all of a colour
    const Xyz out = seen(name);
    const double factor = out.y / light.y;
    RC_ASSERT(factor >= 1.0 / 1024 - 1e-12 && factor <= 1024 + 1e-9);
    RC_ASSERT(std::abs(out.x - factor * light.x) <= 1e-12 * out.x);
    RC_ASSERT(std::abs(out.z - factor * light.z) <= 1e-12 * out.z);
  }
  RC_ASSERT(std::abs(seen("wanat_mantiuk").y - light.y) < 1e-12);
  const double mesopic = relative_mesopic(*scene, vector_of(light));
  for (const char* name : {"khan_pattanaik", "kirk_obrien", "filament"}) {
    RC_ASSERT(seen(name).y <= mesopic + 1e-12);  // no colour is brightened more than eight times
  }
}

RC_GTEST_PROP(AppearanceProperty, MikamosMapIsAMatrix, ()) {
  const auto map = appearance_model_named("mikamo")->at(any_conditions());
  RC_ASSERT(map.has_value());
  const Xyz a = any_light(), b = any_light();
  const double share = any_between(-1, 1);
  const Vector3 both = vector_of((*map)({a.x + share * b.x, a.y + share * b.y, a.z + share * b.z}));
  const Vector3 of_a = vector_of((*map)(a)), of_b = vector_of((*map)(b));
  for (std::size_t i = 0; i < 3; ++i) {
    RC_ASSERT(std::abs(both[i] - (of_a[i] + share * of_b[i])) < 1e-9);  // of lights up to 6, matrices of some hundred
  }
}

}  // namespace
}  // namespace lowlux::isp
