#include "isp/render/output_space.h"

#include <algorithm>
#include <cmath>

namespace lowlux::isp {
namespace {

constexpr double rec2020_a = 1.0993, rec2020_b = 0.0181;

double encode_srgb(double v) { return v <= 0.0031308 ? 12.92 * v : 1.055 * std::pow(v, 1 / 2.4) - 0.055; }
double decode_srgb(double c) { return c <= 12.92 * 0.0031308 ? c / 12.92 : std::pow((c + 0.055) / 1.055, 2.4); }

double encode_rec2020(double v) { return v < rec2020_b ? 4.5 * v : rec2020_a * std::pow(v, 0.45) - (rec2020_a - 1); }
double decode_rec2020(double c) {
  return c < 4.5 * rec2020_b ? c / 4.5 : std::pow((c + (rec2020_a - 1)) / rec2020_a, 1 / 0.45);
}

std::optional<RgbPrimaries> primaries_of(OutputSpace space) {
  switch (space) {
    case OutputSpace::srgb:
    case OutputSpace::linear_srgb:
      return primaries_rec709;
    case OutputSpace::display_p3:
      return primaries_p3_d65;
    case OutputSpace::rec2020:
    case OutputSpace::linear_rec2020:
      return primaries_rec2020;
    case OutputSpace::xyz:
    case OutputSpace::camera:
      break;
  }
  return std::nullopt;
}

}  // namespace

std::string_view name_of(OutputSpace space) {
  const auto* known = std::find_if(output_spaces.begin(), output_spaces.end(),
                                   [&](const NamedOutputSpace& candidate) { return candidate.space == space; });
  return known->name;
}

std::optional<Matrix3> xyz_to_output(OutputSpace space) {
  if (space == OutputSpace::xyz) return identity3();
  const auto primaries = primaries_of(space);
  if (!primaries) return std::nullopt;
  const auto to_xyz = rgb_to_xyz(*primaries);
  return to_xyz ? inverse(*to_xyz) : std::nullopt;
}

std::optional<Vector3> luminance_weights(OutputSpace space) {
  if (space == OutputSpace::xyz) return Vector3{0, 1, 0};
  const auto primaries = primaries_of(space);
  if (!primaries) return std::nullopt;
  const auto to_xyz = rgb_to_xyz(*primaries);
  if (!to_xyz) return std::nullopt;
  return (*to_xyz)[1];
}

double encode_transfer(OutputSpace space, double linear) {
  if (linear < 0) return -encode_transfer(space, -linear);
  if (space == OutputSpace::srgb || space == OutputSpace::display_p3) return encode_srgb(linear);
  return space == OutputSpace::rec2020 ? encode_rec2020(linear) : linear;
}

double decode_transfer(OutputSpace space, double code) {
  if (code < 0) return -decode_transfer(space, -code);
  if (space == OutputSpace::srgb || space == OutputSpace::display_p3) return decode_srgb(code);
  return space == OutputSpace::rec2020 ? decode_rec2020(code) : code;
}

Matrix3 saturation_matrix(double factor, const Vector3& luminance) {
  Matrix3 out{};
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) out[i][j] = (1 - factor) * luminance[j] + (i == j ? factor : 0);
  }
  return out;
}

}  // namespace lowlux::isp
