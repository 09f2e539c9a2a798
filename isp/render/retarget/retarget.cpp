#include "isp/render/retarget/retarget.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "isp/base/text.h"
#include "isp/model/appearance/cao.h"
#include "isp/model/appearance/gamut_map.h"
#include "isp/model/appearance/shin.h"
#include "isp/model/appearance/wanat_mantiuk.h"
#include "isp/model/vision/mesopic.h"
#include "isp/render/output_space.h"
#include "isp/render/retarget/luminance_curve.h"

namespace lowlux::isp {
namespace {

/// Holds the colour space of the image and the display: primaries and white of sRGB.
struct Space {
  Matrix3 to_xyz = rgb_to_xyz(primaries_rec709).value();
  Matrix3 to_rgb = inverse(to_xyz).value();
  Xyz white = xyz_of(to_xyz * Vector3{1, 1, 1});
};

struct Shown {
  Vector3 light{};  // linear sRGB of the display, 0..1
  bool held = false;
};

/// Returns the light the display shows for the wanted light, relative to its white: black subtracted, then moved
/// towards the neutral of the same luminance until all components are within 0 to 1.
Shown into_gamut(const Vector3& wanted, double black, const Vector3& luminance) {
  Vector3 v{};
  bool held = false;
  for (std::size_t c = 0; c < 3; ++c) {
    constexpr double rounding = 1e-9;
    v[c] = (wanted[c] - black) / (1 - black);
    held = held || v[c] < -rounding || v[c] > 1 + rounding;
  }
  return {toward_white(v, luminance).rgb, held};
}

/// Applies the transfer function before and after a map of light.
/// @param to_light  linear sRGB to the light wanted on the display
template <class ToLight>
RetargetMap mapped(const RetargetOptions& options, const Space& space, ToLight to_light) {
  const double black = options.display_black_cd_m2 / options.display_cd_m2;
  return [to_light = std::move(to_light), black, luminance = space.to_xyz[1]](const Vector3& code) {
    Vector3 light{};
    for (std::size_t c = 0; c < 3; ++c) light[c] = decode_transfer(OutputSpace::srgb, std::clamp(code[c], 0.0, 1.0));
    const Shown shown = into_gamut(to_light(light), black, luminance);
    RetargetedColour out{{}, shown.held};
    for (std::size_t c = 0; c < 3; ++c) out.code[c] = encode_transfer(OutputSpace::srgb, shown.light[c]);
    return out;
  };
}

ViewingConditions conditions_at(double white_cd_m2, const RetargetOptions& options, const Space& space) {
  ViewingConditions out;
  out.white_cd_m2 = white_cd_m2;
  out.white = space.white;
  out.shin = options.shin;
  out.shin_units = options.units;
  return out;
}

/// Applies the model under both conditions and finds the display's best match for each colour of the image.
Result<RetargetMap> matched(const RetargetOptions& options, const Space& space, std::string_view model_name,
                            const MatchWeights& weights) {
  const auto model = appearance_model_named(model_name);
  if (!model) return tl::make_unexpected(model.error());
  auto source = model->at(conditions_at(options.source_cd_m2, options, space));
  if (!source) return tl::make_unexpected(source.error());
  auto display = model->at(conditions_at(options.display_cd_m2, options, space));
  if (!display) return tl::make_unexpected(display.error());
  AppearanceMatch match{std::move(*source), std::move(*display), options.display_black_cd_m2 / options.display_cd_m2,
                        weights};
  return RetargetMap([match = std::move(match)](const Vector3& code) {
    const MatchedColour found = closest_displayable(match, code);
    return RetargetedColour{found.code, found.held};
  });
}

Result<RetargetMap> shin_inverted(const RetargetOptions& options, const Space& space) {
  const ShinTable& table = options.shin ? *options.shin : shin_substitute();
  const ShinCoefficients source = shin_coefficients(table, shin_level(options.source_cd_m2, options.units));
  const ShinCoefficients display = shin_coefficients(table, shin_level(options.display_cd_m2, options.units));
  const ShinEye eye = shin_eye({.white = space.white});
  const bool published = options.method == RetargetMethod::shin;
  return mapped(options, space, [=](const Vector3& light) {
    const Xyz colour = xyz_of(space.to_xyz * light);
    const OpponentSignals signals = shin_forward(colour, source, eye);
    const ShinInverse found = published ? shin_inverse_published(signals, display, eye, scotopic_luminance(colour))
                                        : shin_inverse(signals, display, eye);
    return space.to_rgb * vector_of(found.colour);
  });
}

Result<RetargetMap> cao_matrix(const RetargetOptions& options, const Space& space) {
  const ViewingConditions from = conditions_at(options.source_cd_m2, options, space);
  const ViewingConditions to = conditions_at(options.display_cd_m2, options, space);
  const auto matrix =
      cao_retargeting(from.adaptation(), to.adaptation(), cao_receptors(space.to_xyz, scotopic_weights));
  if (!matrix) return fail(ErrorCode::invalid_argument, "the receptors do not separate the primaries");
  return mapped(options, space, [matrix = *matrix](const Vector3& light) { return matrix * light; });
}

Result<RetargetMap> wanat_saturation_and_curve(const RetargetOptions& options, const Space& space) {
  const double exponent = wanat_exponent(conditions_at(options.source_cd_m2, options, space).adaptation(),
                                         conditions_at(options.display_cd_m2, options, space).adaptation());
  const auto curve = luminance_curve({.source_white_cd_m2 = options.source_cd_m2,
                                      .display_white_cd_m2 = options.display_cd_m2,
                                      .display_black_cd_m2 = options.display_black_cd_m2});
  if (!curve) return tl::make_unexpected(curve.error());
  return mapped(options, space, [=, curve = *curve](const Vector3& light) {
    const Vector3 saturated = wanat_saturated(light, exponent, space.to_xyz[1]);
    const double y = std::max(0.0, (space.to_xyz * light)[1]);
    const double shown = retargeted_luminance(curve, y * options.source_cd_m2) / options.display_cd_m2;
    const double scale = y > 0 ? shown / y : 0;
    const double floor = y > 0 ? 0 : shown;
    return Vector3{scale * saturated[0] + floor, scale * saturated[1] + floor, scale * saturated[2] + floor};
  });
}

Result<void> check(const RetargetOptions& options) {
  // The models of appearance take luminances of adaptation, a fifth of white, from 1e-12 on.
  const auto possible = [](double v) { return v >= 1e-11 && v <= 1e12; };
  constexpr const char* range = "within 1e-11 and 1e12";
  const auto refuse = [](const std::string& what, double found, const std::string& expected) {
    return fail(ErrorCode::invalid_argument,
                "the " + what + " must be " + expected + ", found " + number_text(found) + " cd/m2");
  };
  if (!possible(options.source_cd_m2)) return refuse("source's luminance", options.source_cd_m2, range);
  if (!possible(options.display_cd_m2)) return refuse("display's luminance", options.display_cd_m2, range);
  if (!(options.display_black_cd_m2 >= 0 && options.display_black_cd_m2 < options.display_cd_m2)) {
    return refuse("display's black", options.display_black_cd_m2,
                  "0 or more and below its white of " + number_text(options.display_cd_m2));
  }
  return {};
}

}  // namespace

std::string_view name_of(RetargetMethod method) {
  for (const auto& named : retarget_methods) {
    if (named.method == method) return named.name;
  }
  return "";
}

std::string coefficients_name(const RetargetOptions& options) {
  const RetargetMethod m = options.method;
  if (m != RetargetMethod::constrained && m != RetargetMethod::shin && m != RetargetMethod::shin_consistent) return "";
  return options.shin ? options.shin->name : std::string(shin_substitute_name);
}

Result<RetargetMap> retargeting(const RetargetOptions& options) {
  if (const auto good = check(options); !good) return tl::make_unexpected(good.error());
  const Space space;
  switch (options.method) {
    case RetargetMethod::constrained:
      return matched(options, space, "shin", options.weights);
    case RetargetMethod::shin:
    case RetargetMethod::shin_consistent:
      return shin_inverted(options, space);
    case RetargetMethod::wanat:
      return wanat_saturation_and_curve(options, space);
    case RetargetMethod::cao:
      return cao_matrix(options, space);
    case RetargetMethod::icam06:
      return matched(options, space, "icam06", {.lightness = 1});
    case RetargetMethod::none:
      break;
  }
  return RetargetMap([](const Vector3& code) { return RetargetedColour{code, false}; });
}

}  // namespace lowlux::isp
