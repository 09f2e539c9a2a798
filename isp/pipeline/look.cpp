#include "isp/pipeline/look.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "isp/model/colorimetry.h"
#include "isp/model/colour_difference.h"
#include "isp/model/night_eye.h"

namespace lowlux::isp {
namespace {

const Matrix3& to_xyz() {
  static const Matrix3 matrix = *rgb_to_xyz(primaries_rec709);
  return matrix;
}

// LookGrid for one colour, without blur.
Vector3 seen(const Vector3& rgb, double rod_share, double chroma, double blue) {
  const Xyz xyz = xyz_of(to_xyz() * rgb);
  const double rods = scotopic_luminance(xyz) / scotopic_luminance(*xyz_of(white_d65));
  const double e = xyz.y + rod_share * (std::max(rods, LookGrid::least_rods * xyz.y) - xyz.y);
  Vector3 out{};
  for (int c = 0; c < 3; ++c) {
    out[c] = e * (1 + blue * rod_tint[c]) + chroma * std::max(e, 0.0) / xyz.y * (rgb[c] - xyz.y);
  }
  return out;
}

double largest_difference(double rod_share, double chroma, double blue) {
  const Xyz white = *xyz_of(white_d65);
  double largest = 0;
  for (int colour = 1; colour < 8; ++colour) {
    const Vector3 rgb{static_cast<double>(colour & 1), static_cast<double>((colour >> 1) & 1),
                      static_cast<double>(colour >> 2)};
    const Lab before = lab_of(xyz_of(to_xyz() * rgb), white);
    const Lab after = lab_of(xyz_of(to_xyz() * seen(rgb, rod_share, chroma, blue)), white);
    largest = std::max(largest, ciede2000(before, after));
  }
  return largest;
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

bool* effect_named(NightEffects& effects, std::string_view name) {
  const std::array<bool*, 6> switches{&effects.purkinje, &effects.chroma, &effects.hue,
                                      &effects.acuity,   &effects.glare,  &effects.visual_noise};
  const auto* const found = std::ranges::find(night_effect_names, name);
  return found == night_effect_names.end() ? nullptr : switches[found - night_effect_names.begin()];
}

std::array<LookEffect, 6> predict_effects(const NightEye& darkest, double scotopic_ratio_of_white,
                                          double pixels_per_degree) {
  const double rods = (1 - darkest.state.m) * scotopic_at_555_nm * scotopic_ratio_of_white;
  const double share = rods / (darkest.state.m + rods);
  constexpr double taste = std::numeric_limits<double>::quiet_NaN();
  const std::array<double, 6> size{largest_difference(share, 1, 0),
                                   largest_difference(0, darkest.chroma, 0),
                                   largest_difference(0, 1, darkest.blue),
                                   lost_contrast(darkest.blur_std_deg * pixels_per_degree),
                                   taste,
                                   taste};
  std::array<LookEffect, 6> out;
  for (std::size_t k = 0; k < size.size(); ++k) out[k] = {night_effect_names[k], size[k], false};
  return out;
}

}  // namespace lowlux::isp
