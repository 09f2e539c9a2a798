#include "isp/model/colour/camera_colour.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <optional>
#include <string>
#include <utility>

#include "isp/base/text.h"
#include "isp/model/colour/correlated_colour_temperature.h"

namespace lowlux::isp {
namespace {

constexpr double d65_cct_k = 6504;  // white_d65 is more exact than the temperature

/// Holds the interpolated matrices at one white.
struct Calibration {
  Matrix3 reference_to_camera = identity3();  // AnalogBalance * CameraCalibration
  Matrix3 xyz_to_camera = identity3();        // the above * ColorMatrix
  std::optional<Matrix3> forward;
};

bool is_finite(const Vector3& v) {
  return std::all_of(v.begin(), v.end(), [](double value) { return std::isfinite(value); });
}
bool is_finite(const Matrix3& m) {
  return std::all_of(m.begin(), m.end(), [](const Vector3& row) { return is_finite(row); });
}
bool is_positive(const Vector3& v) {
  return is_finite(v) && std::all_of(v.begin(), v.end(), [](double value) { return value > 0; });
}

Matrix3 mix(const Matrix3& a, const Matrix3& b, double weight_b) {
  Matrix3 out{};
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) out[i][j] = (1 - weight_b) * a[i][j] + weight_b * b[i][j];
  }
  return out;
}

std::string text_of(const Vector3& v) { return number_text(v[0]) + " " + number_text(v[1]) + " " + number_text(v[2]); }
std::string text_of(const Xy& xy) { return "x " + number_text(xy.x) + " y " + number_text(xy.y); }

/// Returns the first fault of the figures; nullopt if they are usable.
std::optional<Error> fault_of(const CameraColour& colour) {
  if (colour.calibrations.empty()) {
    return Error{ErrorCode::insufficient,
                 "the file holds no colour matrix, so its camera RGB has no known colour; the camera space needs none",
                 "ColorMatrix1"};
  }
  if (!is_positive(colour.analog_balance)) {
    return Error{ErrorCode::malformed, "expected three positive gains, found " + text_of(colour.analog_balance),
                 "AnalogBalance"};
  }
  for (const ColourCalibration& c : colour.calibrations) {
    if (!is_finite(c.xyz_to_camera) || !is_finite(c.camera_calibration) || (c.forward && !is_finite(*c.forward)) ||
        !std::isfinite(c.cct_k)) {
      return Error{ErrorCode::malformed, "a colour matrix holds a value that is not a finite number", "ColorMatrix"};
    }
  }
  return std::nullopt;
}

/// Points to the one or two calibrations in use. `low` and `high` are the same if interpolation is not possible.
struct Bracket {
  const ColourCalibration* low;
  const ColourCalibration* high;
};

/// Without two different temperatures that are known the calibration of the highest one is used, and the first if they
/// are equal or unknown, as in Adobe's DNG SDK.
Bracket bracket_of(const CameraColour& colour) {
  const auto& all = colour.calibrations;
  if (all.size() >= 2 && all.front().cct_k > 0 && all.back().cct_k > all.front().cct_k) {
    return {&all.front(), &all.back()};
  }
  const ColourCalibration* const only = &*std::ranges::max_element(all, {}, &ColourCalibration::cct_k);
  return {only, only};
}

/// Returns the weight of the calibration with the higher temperature at a white: linear in 1/CCT, constant beyond the
/// ends.
double weight_of(const Bracket& bracket, const Xy& white) {
  if (bracket.low == bracket.high) return 1;
  const auto temperature = colour_temperature_of(white);
  if (!temperature) return 1;
  const double low = 1 / bracket.low->cct_k, high = 1 / bracket.high->cct_k;
  return std::clamp((low - 1 / temperature->cct_k) / (low - high), 0.0, 1.0);
}

/// Returns the ForwardMatrix that a ColorMatrix implies: Bradford(w -> D50) ColorMatrix^-1 diag(ColorMatrix w) with w
/// the white of its temperature; nullopt where the temperature is not stated or the matrix has no inverse or no
/// neutral.
std::optional<Matrix3> implied_forward(const ColourCalibration& only) {
  const auto white = only.cct_k == d65_cct_k ? white_d65 : white_of_temperature(only.cct_k);
  const auto to_xyz = inverse(only.xyz_to_camera);
  const auto to_d50 = white ? bradford_adaptation(*white, white_d50) : std::nullopt;
  if (!to_xyz || !to_d50) return std::nullopt;
  const Vector3 neutral = only.xyz_to_camera * vector_of(*xyz_of(*white));
  if (!is_positive(neutral)) return std::nullopt;
  const Matrix3 forward = *to_d50 * *to_xyz * diagonal3(neutral);
  return inverse(forward) ? std::optional(forward) : std::nullopt;
}

Calibration interpolate(const CameraColour& colour, const Bracket& bracket, double weight) {
  const ColourCalibration& low = *bracket.low;
  const ColourCalibration& high = *bracket.high;
  Calibration out;
  out.reference_to_camera =
      diagonal3(colour.analog_balance) * mix(low.camera_calibration, high.camera_calibration, weight);
  out.xyz_to_camera = out.reference_to_camera * mix(low.xyz_to_camera, high.xyz_to_camera, weight);
  if (low.forward && high.forward) {
    out.forward = mix(*low.forward, *high.forward, weight);
  } else {
    out.forward = low.forward ? low.forward : high.forward;
  }
  return out;
}

Result<Matrix3> inverse_or_error(const Matrix3& matrix, const char* name) {
  if (const auto inverted = inverse(matrix)) return *inverted;
  return fail(ErrorCode::malformed, "the matrix is singular: it maps different colours to the same camera RGB", name);
}

/// Computes one step of the iteration: the white of a neutral by the matrix of a given weight.
Result<Xy> white_at_weight(const CameraColour& colour, const Bracket& bracket, double weight, const Vector3& neutral) {
  const auto to_xyz = inverse_or_error(interpolate(colour, bracket, weight).xyz_to_camera, "ColorMatrix");
  if (!to_xyz) return tl::make_unexpected(to_xyz.error());
  const auto xy = xy_of(xyz_of(*to_xyz * neutral));
  if (!xy || !xyz_of(*xy) || !uv_prime_of(*xy)) {
    return fail(ErrorCode::malformed,
                "neutral " + text_of(neutral) + " is not the colour of a light under the colour matrices of the file",
                "AsShotNeutral");
  }
  return *xy;
}

Result<Xy> bisect_weight(const CameraColour& colour, const Bracket& bracket, const Vector3& neutral) {
  double low = 0, high = 1;
  for (int i = 0; i < 50; ++i) {
    const double weight = 0.5 * (low + high);
    auto white = white_at_weight(colour, bracket, weight, neutral);
    if (!white) return white;
    (weight_of(bracket, *white) > weight ? low : high) = weight;
  }
  return white_at_weight(colour, bracket, 0.5 * (low + high), neutral);
}

Result<Xy> iterate_white(const CameraColour& colour, const Vector3& neutral) {
  const Bracket bracket = bracket_of(colour);
  Xy white = white_d50;
  for (int i = 0; i < 30; ++i) {
    auto next = white_at_weight(colour, bracket, weight_of(bracket, white), neutral);
    if (!next) return next;
    const bool settled = std::fabs(next->x - white.x) + std::fabs(next->y - white.y) < 1e-10;
    white = *next;
    if (settled) return white;
  }
  return bisect_weight(colour, bracket, neutral);
}

Result<Calibration> calibration_at(const CameraColour& colour, const Xy& scene_white) {
  if (auto fault = fault_of(colour)) return tl::make_unexpected(*std::move(fault));
  if (!xyz_of(scene_white) || !uv_prime_of(scene_white)) {
    return fail(ErrorCode::malformed, "a scene white of " + text_of(scene_white) + " is not the colour of a light",
                "white");
  }
  const Bracket bracket = bracket_of(colour);
  return interpolate(colour, bracket, weight_of(bracket, scene_white));
}

/// Returns ForwardMatrix with each row scaled so that (1, 1, 1) goes to D50.
Result<Matrix3> normalised_forward(const Matrix3& forward) {
  const Vector3 white = vector_of(*xyz_of(white_d50));
  const Vector3 sums = forward * Vector3{1, 1, 1};
  if (!is_positive(sums) || !inverse(forward)) {
    return fail(ErrorCode::malformed, "the matrix is singular or takes white to " + text_of(sums), "ForwardMatrix");
  }
  return diagonal3({white[0] / sums[0], white[1] / sums[1], white[2] / sums[2]}) * forward;
}

/// Returns the matrix that white-balances by the reference neutral, then applies ForwardMatrix: camera RGB -> XYZ under
/// D50.
Result<Matrix3> to_xyz_by_forward(const Calibration& calibration, const Vector3& neutral) {
  auto to_reference = inverse_or_error(calibration.reference_to_camera, "CameraCalibration");
  if (!to_reference) return to_reference;
  auto forward = normalised_forward(*calibration.forward);
  if (!forward) return forward;
  const Vector3 reference = *to_reference * neutral;
  if (!is_positive(reference)) {
    return fail(ErrorCode::malformed, "neutral " + text_of(neutral) + " is not a neutral of the reference camera",
                "CameraCalibration");
  }
  return *forward * diagonal3({1 / reference[0], 1 / reference[1], 1 / reference[2]}) * *to_reference;
}

/// Returns the inverse of the interpolated matrix, scaled so that the neutral (largest component 1) has Y = 1.
Result<Matrix3> to_xyz_by_inverse(const Calibration& calibration, const Vector3& neutral) {
  auto to_xyz = inverse_or_error(calibration.xyz_to_camera, "ColorMatrix");
  if (!to_xyz) return to_xyz;
  return (1 / (*to_xyz * neutral)[1]) * *to_xyz;
}

Result<Vector3> neutral_at(const Calibration& calibration, const Xy& scene_white) {
  const Vector3 rgb = calibration.xyz_to_camera * vector_of(*xyz_of(scene_white));
  if (!is_positive(rgb)) {
    return fail(ErrorCode::malformed,
                "a white of " + text_of(scene_white) + " gives camera RGB " + text_of(rgb) +
                    ", which a sensor cannot measure: the colour matrices of the file are not valid for this light",
                "ColorMatrix");
  }
  const double largest = *std::max_element(rgb.begin(), rgb.end());
  return Vector3{rgb[0] / largest, rgb[1] / largest, rgb[2] / largest};
}

}  // namespace

Result<Matrix3> xyz_to_camera(const CameraColour& colour, const Xy& scene_white) {
  return calibration_at(colour, scene_white).map([](const Calibration& c) { return c.xyz_to_camera; });
}

double calibration_weight(const CameraColour& colour, const Xy& scene_white) {
  return weight_of(bracket_of(colour), scene_white);
}

Result<WhitePoint> white_of_neutral(const CameraColour& colour, const Vector3& neutral) {
  if (auto fault = fault_of(colour)) return tl::make_unexpected(*std::move(fault));
  if (!is_positive(neutral)) {
    return fail(ErrorCode::malformed, "expected three positive figures, found " + text_of(neutral), "AsShotNeutral");
  }
  const double largest = *std::max_element(neutral.begin(), neutral.end());
  const auto white = iterate_white(colour, {neutral[0] / largest, neutral[1] / largest, neutral[2] / largest});
  if (!white) return tl::make_unexpected(white.error());
  const auto temperature = colour_temperature_of(*white);
  return WhitePoint{*white, temperature ? temperature->cct_k : 0, temperature ? temperature->duv : 0};
}

Result<Vector3> neutral_of_white(const CameraColour& colour, const Xy& scene_white) {
  return calibration_at(colour, scene_white).and_then([&](const Calibration& c) { return neutral_at(c, scene_white); });
}

Result<Matrix3> camera_to_xyz(const CameraColour& colour, const Xy& scene_white, const Xy& output_white) {
  auto calibration = calibration_at(colour, scene_white);
  if (!calibration) return tl::make_unexpected(calibration.error());
  const auto neutral = neutral_at(*calibration, scene_white);
  if (!neutral) return tl::make_unexpected(neutral.error());
  const auto from_scene = bradford_adaptation(scene_white, output_white);  // none: no light has such a white
  if (!calibration->forward && from_scene && colour.calibrations.size() == 1) {
    // CameraCalibration may take a neutral of this camera to none of the reference camera: then the inverse remains.
    const auto to_reference = inverse(calibration->reference_to_camera);
    const bool balances = to_reference && is_positive(*to_reference * *neutral);
    if (balances) calibration->forward = implied_forward(colour.calibrations[0]);
  }
  const bool by_forward = calibration->forward.has_value();
  auto to_xyz = by_forward ? to_xyz_by_forward(*calibration, *neutral) : to_xyz_by_inverse(*calibration, *neutral);
  if (!to_xyz) return to_xyz;
  const auto adaptation = by_forward ? bradford_adaptation(white_d50, output_white) : from_scene;
  if (!adaptation) {
    return fail(ErrorCode::malformed,
                "no chromatic adaptation leads from the white " + text_of(scene_white) + " to " +
                    text_of(output_white) + ": use --wb auto or --wb 5500",
                "white");
  }
  return *adaptation * *to_xyz;
}

}  // namespace lowlux::isp
