#include "isp/pipeline/plan/look.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "isp/model/colour/colorimetry.h"
#include "isp/model/colour/colour_difference.h"
#include "isp/model/vision/night_eye.h"

namespace lowlux::isp {
namespace {

const Matrix3& to_xyz() {
  static const Matrix3 matrix = *rgb_to_xyz(primaries_rec709);
  return matrix;
}

// Applies LookGrid to one colour, without blur.
Vector3 seen(const Vector3& rgb, double rod_fraction, double chroma, double blue) {
  const Xyz xyz = xyz_of(to_xyz() * rgb);
  const double rods = scotopic_luminance(xyz) / scotopic_luminance(*xyz_of(white_d65));
  const double e = xyz.y + rod_fraction * (std::max(rods, LookGrid::min_rods * xyz.y) - xyz.y);
  Vector3 out{};
  for (int c = 0; c < 3; ++c) {
    out[c] = e * (1 + blue * rod_tint[c]) + chroma * std::max(e, 0.0) / xyz.y * (rgb[c] - xyz.y);
  }
  return out;
}

/// Holds the strengths of the three effects on colours; those that are left out are 0, 1 and 0.
struct ColourEffects {
  double rod_fraction = 0;
  double chroma = 1;
  double blue = 0;
};

double largest_difference(const ColourEffects& first, const ColourEffects& second) {
  const Xyz white = *xyz_of(white_d65);
  const auto lab = [&](const Vector3& rgb, const ColourEffects& shown) {
    return lab_of(xyz_of(to_xyz() * seen(rgb, shown.rod_fraction, shown.chroma, shown.blue)), white);
  };
  double largest = 0;
  for (int colour = 1; colour < 8; ++colour) {
    const Vector3 rgb{static_cast<double>(colour & 1), static_cast<double>((colour >> 1) & 1),
                      static_cast<double>(colour >> 2)};
    largest = std::max(largest, ciede2000(lab(rgb, first), lab(rgb, second)));
  }
  return largest;
}

// Returns the largest change that an effect makes, alone or with the others: faded colours show a tint that saturated
// ones hide.
double size_of(double ColourEffects::*effect, const ColourEffects& all) {
  ColourEffects alone, others = all;
  alone.*effect = all.*effect;
  others.*effect = ColourEffects{}.*effect;
  return std::max(largest_difference({}, alone), largest_difference(others, all));
}

double lost_contrast(double blur_px) {
  constexpr double cycles_per_px = 0.25;
  const double left =
      std::exp(-2 * std::numbers::pi * std::numbers::pi * blur_px * blur_px * cycles_per_px * cycles_per_px);
  const Xyz white = *xyz_of(white_d65);
  const auto bright = [&](double y) { return lab_of({white.x * y, y, white.z * y}, white); };
  return ciede2000(bright(1), bright(0.5 + 0.5 * left));
}

}  // namespace

bool* effect_named(VisionEffects& effects, std::string_view name) {
  const std::array<bool*, 6> switches{&effects.purkinje, &effects.chroma, &effects.hue,
                                      &effects.acuity,   &effects.glare,  &effects.visual_noise};
  const auto* const found = std::ranges::find(night_effect_names, name);
  return found == night_effect_names.end() ? nullptr : switches[found - night_effect_names.begin()];
}

std::array<LookEffect, 6> predict_effects(const NightEye& eye, double scotopic_ratio_of_white,
                                          double pixels_per_degree) {
  const double rods = (1 - eye.state.m) * scotopic_at_555_nm * scotopic_ratio_of_white;
  const double share = rods / (eye.state.m + rods);
  constexpr double taste = std::numeric_limits<double>::quiet_NaN();
  const ColourEffects all{share, eye.chroma, eye.blue};
  const std::array<double, 6> size{size_of(&ColourEffects::rod_fraction, all),
                                   size_of(&ColourEffects::chroma, all),
                                   size_of(&ColourEffects::blue, all),
                                   lost_contrast(eye.blur_std_deg * pixels_per_degree),
                                   taste,
                                   taste};
  std::array<LookEffect, 6> out;
  for (std::size_t k = 0; k < size.size(); ++k) out[k] = {night_effect_names[k], size[k], false};
  return out;
}

}  // namespace lowlux::isp
