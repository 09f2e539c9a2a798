#include "capture/camera/camera_frame.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <cstddef>
#include <optional>
#include <utility>

#include "isp/base/packed/raw_format.h"
#include "isp/model/colour/colorimetry.h"
#include "isp/model/colour/correlated_colour_temperature.h"

namespace lowlux::capture {
namespace {

constexpr double min_gain = 1e-3, max_gain = 1e3;
constexpr double max_coefficient = 255;  // fits in 24 bits with a fraction of 16, as floats do
constexpr double matrix_step = 0x1p-16, neutral_step = 0x1p-20;
constexpr double d65_cct_k = 6504;
constexpr double iso_of_unit_gain = 100;

double rounded(double value, double step) { return std::round(value / step) * step; }

Matrix3 rounded(Matrix3 matrix) {
  for (Vector3& row : matrix) {
    for (double& value : row) value = rounded(value, matrix_step);
  }
  return matrix;
}

bool can_be(const Matrix3& matrix) {
  const bool held = std::ranges::all_of(matrix, [](const Vector3& row) {
    return std::ranges::all_of(row, [](double value) { return std::fabs(value) <= max_coefficient; });
  });
  return held && inverse(matrix).has_value();
}

void set_black(const std::array<double, 4>& black_dn, RawFrame& out) {
  const double white = out.raw.white_dn[0];
  if (!std::ranges::all_of(black_dn, [&](double level) { return level >= 0 && level < white; })) {
    out.warnings.emplace_back("the camera states an implausible black level, which is ignored");
    return;
  }
  BlackLevel& tag = out.raw.black_tag.emplace();
  tag.rows = tag.columns = 2;
  tag.pattern_dn.resize(4);
  for (int site = 0; site < 4; ++site) {
    tag.pattern_dn[static_cast<std::size_t>(site)] = rounded(black_dn[black_channel_of(site, out.raw.phase)], 0x1p-8);
  }
}

std::optional<Vector3> neutral_of(const FrameFacts& facts, RawFrame& out) {
  if (!facts.colour_gains) return std::nullopt;
  const auto [red, blue] = *facts.colour_gains;
  if (!(red >= min_gain && red <= max_gain && blue >= min_gain && blue <= max_gain)) {
    out.warnings.emplace_back("the camera states implausible colour gains, which are ignored");
    return std::nullopt;
  }
  Vector3 neutral{1 / red, 1, 1 / blue};
  const double largest = std::ranges::max(neutral);
  for (double& channel : neutral) channel = std::max(rounded(channel / largest, neutral_step), neutral_step);
  return neutral;
}

std::optional<Matrix3> matrix_of(const FrameFacts& facts, RawFrame& out) {
  if (!facts.colour_matrix) return std::nullopt;
  Matrix3 matrix{};
  for (std::size_t i = 0; i < 9; ++i) matrix[i / 3][i % 3] = (*facts.colour_matrix)[i];
  if (can_be(matrix)) return matrix;
  out.warnings.emplace_back("the camera states an implausible colour matrix, which is ignored");
  return std::nullopt;
}

/// Returns the calibration of a colour matrix; nullopt if its values exceed the range of a DNG.
/// @param to_srgb  to srgb of white-balanced camera RGB
std::optional<ColourCalibration> calibration_of(const Matrix3& to_srgb, const Vector3& neutral,
                                                const std::optional<double>& cct_k) {
  const auto light = cct_k ? isp::white_of_temperature(*cct_k) : std::nullopt;
  const isp::Xy white = light.value_or(isp::white_d65);
  const Matrix3 to_xyz = *isp::rgb_to_xyz(isp::primaries_rec709) * to_srgb;
  const auto to_d50 = isp::bradford_adaptation(isp::white_d65, isp::white_d50);
  const auto to_light = isp::bradford_adaptation(isp::white_d65, white);
  if (!to_light) return std::nullopt;
  ColourCalibration out;
  out.cct_k = light ? *cct_k : d65_cct_k;
  out.forward = rounded(*to_d50 * to_xyz);
  const auto to_camera = inverse(*to_light * to_xyz);
  if (!to_camera) return std::nullopt;
  out.xyz_to_camera = rounded(diagonal3(neutral) * *to_camera);
  if (!can_be(out.xyz_to_camera) || !can_be(*out.forward)) return std::nullopt;
  return out;
}

void set_colour(const FrameFacts& facts, RawFrame& out) {
  out.colour.source = CameraColour::Source::file_tags;
  out.colour.as_shot_neutral = neutral_of(facts, out);
  const Vector3 neutral = out.colour.as_shot_neutral.value_or(Vector3{1, 1, 1});
  std::optional<ColourCalibration> calibration;
  if (const auto matrix = matrix_of(facts, out)) {
    calibration = calibration_of(*matrix, neutral, facts.colour_temperature_k);
    if (!calibration) out.warnings.emplace_back("the camera states an implausible colour matrix, which is ignored");
  }
  if (!calibration) {
    calibration = calibration_of(identity3(), neutral, facts.colour_temperature_k);
    out.warnings.emplace_back(colours_unknown);
  }
  if (calibration) out.colour.calibrations.push_back(*calibration);
}

void set_info(const FrameFacts& facts, const std::string& camera, FrameInfo& out) {
  const auto positive = [](const std::optional<double>& value) {
    return value && std::isfinite(*value) && *value > 0 ? value : std::nullopt;
  };
  out.model = camera;
  // Rounded as DNGs have it: libtiff takes rationals as floats.
  if (const auto time_s = positive(facts.exposure_s)) out.exposure_s = static_cast<float>(*time_s);
  if (const auto gain = positive(facts.analogue_gain)) out.iso = std::round(iso_of_unit_gain * *gain);
  if (facts.temperature_c && std::isfinite(*facts.temperature_c)) out.temperature_c = facts.temperature_c;
}

}  // namespace

RawFrame raw_frame_of(const CameraFrame& frame, const CameraFormat& format, const std::string& camera) {
  assert(frame.bytes.size() >= frame_bytes(format));
  RawFrame out;
  RawDn& raw = out.raw;
  raw.dn = Plane<std::uint16_t>(format.width, format.height);
  raw.layout = format.raw.layout;
  raw.phase = format.raw.phase;
  raw.active = raw.default_crop = {0, 0, format.width, format.height};
  raw.white_dn.fill(largest_code(format.raw));
  for (int y = 0; y < format.height; ++y) {
    unpack_row(format.raw, frame.bytes.data() + static_cast<std::size_t>(y) * format.stride_bytes, format.width,
               raw.dn.row(y));
  }
  set_info(frame.facts, camera, raw.info);
  if (frame.facts.black_level_dn) set_black(*frame.facts.black_level_dn, out);
  if (raw.layout == SensorLayout::bayer) set_colour(frame.facts, out);
  return out;
}

}  // namespace lowlux::capture
